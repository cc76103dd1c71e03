//! The units that are repeated after damage and deletion.

use super::super::place::Put;
use super::*;

/// A short journal: the offset of a record is its number.
struct Script(Vec<Entry>);

impl Script {
    fn push(&mut self, record: Record) {
        let offset = self.0.len() as u64;
        self.0.push(Entry {
            offset,
            payload: (offset, 0),
            record,
        });
    }

    fn begin(&mut self, stage: &str) {
        self.push(Record::Begin(stage.into()));
    }

    fn unit(&mut self, step: &str, unit: u64, files: &[(&str, u32)]) {
        let put = |(file, section): &(&str, u32)| Put {
            file: (*file).into(),
            section: *section,
            place: Place::default(),
        };
        self.push(Record::Unit {
            step: step.into(),
            unit,
            puts: files.iter().map(put).collect(),
            payload: Vec::new(),
        });
    }

    fn deleted(&mut self, file: &str) {
        self.push(Record::Deleted(file.into()));
    }
}

/// Two stages: one writes `a`; the next reads it and writes `b` and `letters`, and from these `c`.
fn script() -> Script {
    let mut script = Script(Vec::new());
    script.begin("/one");
    script.unit("/one/tiles", 0, &[("a", 0)]);
    script.unit("/one/tiles", 1, &[("a", 1)]);
    script.unit("/one", 0, &[]);
    script.begin("/two");
    script.unit("/two/tiles", 0, &[("b", 0), ("sent", 0)]);
    script.unit("/two/tiles", 1, &[("b", 1), ("sent", 1)]);
    script.unit("/two/deliver", 0, &[("c", 0)]);
    script.deleted("sent");
    script.unit("/two", 0, &[]);
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
    let history = History::of(&script().0);
    assert_eq!(history.remedy(&[]), None);
    assert_eq!(history.needed().len(), 5);
    assert!(history.is_deleted("sent") && !history.is_deleted("a"));
}

#[test]
fn a_unit_is_done_again_if_its_inputs_are_there() {
    let mut history = History::of(&script().0);
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
    let history = History::of(&script().0);
    assert_eq!(history.remedy(&[damage("c", 0)]), rewind(4, "/two"));
    let mut later = script();
    later.deleted("a");
    let history = History::of(&later.0);
    assert_eq!(history.remedy(&[damage("b", 0)]), rewind(0, "/one"));
    assert_eq!(history.remedy(&[damage("c", 0)]), rewind(0, "/one"));
}

#[test]
fn a_unit_that_was_done_again_counts_as_it_is() {
    let mut again = script();
    again.unit("/two/tiles", 1, &[("b", 1), ("sent", 1)]);
    let history = History::of(&again.0);
    assert_eq!(history.needed().len(), 5);
    assert_eq!(history.units("/two/tiles"), [0, 1]);
}
