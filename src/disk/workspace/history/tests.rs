//! The units that are repeated after damage and deletion.

use super::super::place::Put;
use super::*;

/// The records of the program's journal, and those of workers with the numbers of records before them.
#[derive(Default)]
struct Script {
    program: Vec<Record>,
    workers: Vec<(u64, Record)>,
}

impl Script {
    fn begin(&mut self, stage: &str) {
        self.program.push(Record::Begin(stage.into()));
    }

    /// A unit that a worker does.
    fn unit(&mut self, step: &str, unit: u64, files: &[(&str, u32)]) {
        let after = self.program.len() as u64;
        self.workers.push((after, record(step, unit, files)));
    }

    /// A step that the program does itself.
    fn once(&mut self, step: &str, files: &[(&str, u32)]) {
        self.program.push(record(step, 0, files));
    }

    fn end(&mut self, step: &str, units: u64, files: &[&str]) {
        let (step, files) = (step.into(), files.iter().map(|f| (*f).into()).collect());
        self.program.push(Record::End { step, units, files });
    }

    fn deleted(&mut self, file: &str) {
        self.program.push(Record::Deleted(file.into()));
    }

    fn history(&self) -> History {
        let mut history = History::default();
        let program = (0..)
            .zip(&self.program)
            .map(|(n, record)| (2 * n + 1, record));
        let workers = self
            .workers
            .iter()
            .map(|(after, record)| (2 * after, record));
        for (at, record) in program.chain(workers) {
            let payload = (None, at, 0);
            let offset = at;
            history.add(&Entry {
                at,
                offset,
                payload,
                record,
            });
        }
        history
    }
}

fn record(step: &str, unit: u64, files: &[(&str, u32)]) -> Record {
    let put = |(file, section): &(&str, u32)| Put {
        file: (*file).into(),
        section: *section,
        place: Place::default(),
    };
    Record::Unit {
        step: step.into(),
        unit,
        after: 0,
        puts: files.iter().map(put).collect(),
        payload: Vec::new(),
    }
}

/// Two stages: one writes `a`; the next reads it and writes `b` and `letters`, and from these `c`.
fn script() -> Script {
    let mut script = Script::default();
    script.begin("/one");
    script.unit("/one/tiles", 0, &[("a", 0)]);
    script.unit("/one/tiles", 1, &[("a", 1)]);
    script.end("/one/tiles", 2, &["a"]);
    script.once("/one", &[]);
    script.begin("/two");
    script.unit("/two/tiles", 0, &[("b", 0), ("sent", 0)]);
    script.unit("/two/tiles", 1, &[("b", 1), ("sent", 1)]);
    script.end("/two/tiles", 2, &["b", "sent"]);
    script.once("/two/deliver", &[("c", 0)]);
    script.deleted("sent");
    script.once("/two", &[]);
    script
}

fn damage(file: &str, section: u32) -> Needed {
    Needed {
        file: file.into(),
        section,
        place: Place::default(),
    }
}

fn rewind(end: u64, stage: &str) -> Option<Remedy> {
    let stage = Some(stage.into());
    Some(Remedy::Rewind { end, stage })
}

#[test]
fn nothing_is_done_about_no_damage() {
    let history = script().history();
    assert_eq!(history.remedy(&[]), None);
    assert_eq!(history.needed().len(), 5);
    assert!(history.is_deleted("sent") && !history.is_deleted("a"));
}

#[test]
fn a_unit_is_done_again_if_its_inputs_are_there() {
    let mut history = script().history();
    let units = vec![("/two/tiles".to_owned(), 1)];
    let found = history.remedy(&[damage("b", 1)]);
    assert_eq!(found, Some(Remedy::Redo(units.clone())));
    history.forget(&units);
    // The unit and the stage around it, but not the units that used its result.
    assert_eq!(history.units("/two/tiles"), [0]);
    assert!(history.units("/two").is_empty());
    assert_eq!(history.units("/two/deliver"), [0]);
    assert_eq!(history.units("/one"), [0]);
    assert_eq!(history.places("b").len(), 1);
}

#[test]
fn a_stage_begins_again_if_they_are_not() {
    // The rows that were sent are deleted, so they cannot be delivered again.
    let history = script().history();
    assert_eq!(history.remedy(&[damage("c", 0)]), rewind(7, "/two"));
    let mut later = script();
    later.deleted("a");
    let history = later.history();
    assert_eq!(history.remedy(&[damage("b", 0)]), rewind(1, "/one"));
    assert_eq!(history.remedy(&[damage("c", 0)]), rewind(1, "/one"));
}

#[test]
fn a_unit_that_was_done_again_counts_as_it_is() {
    let mut again = script();
    again.unit("/two/tiles", 1, &[("b", 1), ("sent", 1)]);
    let history = again.history();
    assert_eq!(history.needed().len(), 5);
    assert_eq!(history.units("/two/tiles"), [0, 1]);
}

#[test]
fn units_whose_records_were_lost_are_done_again() {
    let mut lost = script();
    lost.workers.retain(|(after, _)| *after < 2);
    // What the second stage left is needed; its inputs are still there.
    let redo = |step: &str, units: &[u64]| {
        let units = units.iter().map(|unit| (step.to_owned(), *unit));
        Some(Remedy::Redo(units.collect()))
    };
    assert_eq!(lost.history().remedy(&[]), redo("/two/tiles", &[0]));
    lost.deleted("a");
    assert_eq!(lost.history().remedy(&[]), rewind(1, "/one"));
    // Nothing that they wrote is needed any more, and the stage is finished.
    lost.deleted("b");
    assert_eq!(lost.history().remedy(&[]), None);
    let mut one = script();
    one.workers.remove(1);
    assert_eq!(one.history().remedy(&[]), redo("/one/tiles", &[1]));
    one.deleted("a");
    assert_eq!(one.history().remedy(&[]), None);
    // The stage that did them is not finished.
    one.program
        .retain(|record| *record != self::record("/one", 0, &[]));
    assert_eq!(one.history().remedy(&[]), redo("/one/tiles", &[1]));
}

/// Found by fuzzing: all units that an end claimed were listed.
#[test]
fn a_claimed_number_of_units_costs_nothing() {
    let mut forged = script();
    forged.end("/two/tiles", u64::MAX, &["b"]);
    let units = vec![("/two/tiles".to_owned(), 2)];
    assert_eq!(forged.history().remedy(&[]), Some(Remedy::Redo(units)));
}
