//! The finished work of earlier attempts according to the journals, and the part of it that survives damage.

use super::journal::{Entry, OpenStep, PayloadPlace, Record, Sharing, Took};
use super::place::Place;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Estimated bytes of memory for a section and for a unit of work.
const SECTION: u64 = 84;
const UNIT: u64 = 64;

/// Finished units, files and their parts.
#[derive(Debug, Default)]
pub struct History {
    steps: Vec<StepHistory>,
    /// The places of steps in `steps` by name.
    numbers: HashMap<String, u32>,
    files: HashMap<String, FileHistory>,
    /// Stages begun, with the times of their records.
    begun: Vec<(String, u64)>,
    /// Larger than the numbers of all workers.
    next_worker: u32,
    /// How tasks share the run.
    pub sharing: Option<Sharing>,
    /// The steps that are open for tasks.
    pub open: Vec<OpenStep>,
    /// The resources that processes took.
    pub took: Vec<Took>,
    /// True if the run is finished.
    pub finished: bool,
}

#[derive(Debug, Default)]
struct StepHistory {
    name: String,
    /// Finished units, each with the time of its record and the place of its payload.
    units: BTreeMap<u64, (u64, PayloadPlace)>,
    /// If all are finished: the time of this record, their number, and the files that they wrote.
    end: Option<(u64, u64, BTreeSet<String>)>,
}

#[derive(Debug)]
struct FileHistory {
    parts: BTreeMap<u32, Part>,
    /// Time of the first record about the file.
    first: u64,
    deleted: Option<u64>,
    /// Steps that wrote to the file.
    steps: BTreeSet<u32>,
}

impl Default for FileHistory {
    fn default() -> Self {
        Self {
            parts: BTreeMap::new(),
            first: u64::MAX,
            deleted: None,
            steps: BTreeSet::new(),
        }
    }
}

/// A part of a file, and the unit that wrote it.
#[derive(Debug, Clone)]
struct Part {
    place: Place,
    step: u32,
    unit: u64,
    at: u64,
}

/// A part of a file that the run needs to continue.
#[derive(Debug, Clone)]
pub struct Needed {
    /// Name of the file.
    pub file: String,
    /// Number of the part.
    pub section: u32,
    /// Its place and checksum.
    pub place: Place,
}

/// The repair after damage.
#[derive(Debug, PartialEq, Eq)]
pub enum Remedy {
    /// These units are repeated, and all units of their steps without a record; all others stay finished.
    Redo(Vec<(String, u64)>),
    /// Records from time `end` on are dropped: a stage is repeated from its start.
    Rewind {
        /// Time of the first record that is dropped.
        end: u64,
        /// The stage that follows; none if no stage began.
        stage: Option<String>,
    },
}

/// Lost work: a unit of a step, and the time after which its inputs may have been deleted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Lost {
    step: u32,
    unit: u64,
    at: u64,
}

impl History {
    /// Adds a record. Of two records of one unit or one part the later one counts; of equally late ones the
    /// one that is added last.
    pub fn add(&mut self, entry: &Entry<'_>) {
        let at = entry.at;
        match entry.record {
            Record::Manifest(_) | Record::Task(_) | Record::Failed(_) => {}
            Record::Shared(sharing) => self.sharing = Some(sharing.clone()),
            Record::Open(steps) => self.open.clone_from(steps),
            Record::Took(took) => self.took.push(*took),
            Record::Finished => self.finished = true,
            Record::Attempt(next) => self.next_worker = self.next_worker.max(*next),
            Record::Begin(stage) => self.begun.push((stage.clone(), at)),
            Record::Deleted(name) => {
                let deleted = &mut self.file(name).deleted;
                *deleted = Some(deleted.map_or(at, |before| before.min(at)));
            }
            Record::End { step, units, files } => {
                let number = self.step(step);
                for name in files {
                    let file = self.file(name);
                    file.first = file.first.min(at);
                    file.steps.insert(number);
                }
                let files = files.iter().cloned().collect();
                self.steps[number as usize].end = Some((at, *units, files));
            }
            Record::Unit {
                step, unit, puts, ..
            } => {
                let number = self.step(step);
                let known = self.steps[number as usize].units.entry(*unit);
                let known = known.or_insert((at, entry.payload));
                if known.0 <= at {
                    *known = (at, entry.payload);
                }
                for put in puts {
                    let file = self.file(&put.file);
                    file.first = file.first.min(at);
                    file.steps.insert(number);
                    let part = Part {
                        place: put.place,
                        step: number,
                        unit: *unit,
                        at,
                    };
                    let known = file
                        .parts
                        .entry(put.section)
                        .or_insert_with(|| part.clone());
                    if known.at <= at {
                        *known = part;
                    }
                }
            }
        }
    }

    fn file(&mut self, name: &str) -> &mut FileHistory {
        self.files.entry(name.to_owned()).or_default()
    }

    fn step(&mut self, name: &str) -> u32 {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.steps.len() as u32;
        self.numbers.insert(name.to_owned(), number);
        self.steps.push(StepHistory {
            name: name.to_owned(),
            ..StepHistory::default()
        });
        number
    }

    fn known(&self, step: &str) -> Option<&StepHistory> {
        Some(&self.steps[*self.numbers.get(step)? as usize])
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let sections: usize = self.files.values().map(|file| file.parts.len()).sum();
        let units: usize = self.steps.iter().map(|step| step.units.len()).sum();
        sections as u64 * SECTION + units as u64 * UNIT
    }

    /// The number of finished units.
    #[must_use]
    pub fn count(&self) -> usize {
        self.steps.iter().map(|step| step.units.len()).sum()
    }

    /// A number that is larger than those of all workers of earlier attempts.
    #[must_use]
    pub fn next_worker(&self) -> u32 {
        self.next_worker
    }

    /// True if an earlier attempt began the stage.
    #[must_use]
    pub fn began(&self, stage: &str) -> bool {
        self.begun.iter().any(|(name, _)| name == stage)
    }

    /// Finished units, ascending.
    #[must_use]
    pub fn units(&self, step: &str) -> Vec<u64> {
        let units = self.known(step);
        units.map_or_else(Vec::new, |step| step.units.keys().copied().collect())
    }

    /// The files that the units of a step wrote, if an earlier attempt finished all units.
    #[must_use]
    pub fn ended(&self, step: &str) -> Option<&BTreeSet<String>> {
        self.known(step)?.end.as_ref().map(|end| &end.2)
    }

    /// The files to which finished units of a step wrote.
    pub fn files_of(&self, step: &str) -> impl Iterator<Item = &str> {
        let number = self.numbers.get(step).copied();
        let files = self.files.iter();
        files
            .filter(move |(_, file)| number.is_some_and(|n| file.steps.contains(&n)))
            .map(|(name, _)| name.as_str())
    }

    /// Place of the payload of a unit.
    #[must_use]
    pub fn payload(&self, step: &str, unit: u64) -> Option<PayloadPlace> {
        Some(self.known(step)?.units.get(&unit)?.1)
    }

    /// Parts of a file, ascending.
    #[must_use]
    pub fn places(&self, file: &str) -> Vec<(u32, Place)> {
        let parts = self.files.get(file).map(|file| file.parts.iter());
        let parts = parts.into_iter().flatten();
        parts
            .map(|(section, part)| (*section, part.place))
            .collect()
    }

    /// True if the file is deleted.
    #[must_use]
    pub fn is_deleted(&self, file: &str) -> bool {
        self.files.get(file).is_some_and(|f| f.deleted.is_some())
    }

    fn live(&self) -> impl Iterator<Item = (&String, &FileHistory)> {
        self.files.iter().filter(|(_, file)| file.deleted.is_none())
    }

    /// Names of the segments that have parts of files that exist.
    #[must_use]
    pub fn segments(&self) -> BTreeSet<String> {
        let parts = self.live().flat_map(|(name, file)| {
            let segments: BTreeSet<u32> = file.parts.values().map(|p| p.place.segment).collect();
            segments.into_iter().map(move |n| format!("{name}.{n}"))
        });
        parts.collect()
    }

    /// All parts of files that exist.
    #[must_use]
    pub fn needed(&self) -> Vec<Needed> {
        let parts = self.live();
        let parts = parts.flat_map(|(name, file)| file.parts.iter().map(move |part| (name, part)));
        parts
            .map(|(name, (section, part))| Needed {
                file: name.clone(),
                section: *section,
                place: part.place,
            })
            .collect()
    }

    /// The first unit without a record of each finished step, as far as the run needs what it did. A forged
    /// journal may claim any number of units.
    fn lost(&self) -> Vec<Lost> {
        let mut lost = Vec::new();
        for (number, step) in (0..).zip(&self.steps) {
            let Some((at, units, files)) = &step.end else {
                continue;
            };
            let ends = step.name.match_indices('/').map(|(end, _)| end);
            let around = ends.skip(1).filter_map(|end| self.known(&step.name[..end]));
            let over = around.into_iter().any(|step| step.units.contains_key(&0));
            if over && files.iter().all(|file| self.is_deleted(file)) {
                continue;
            }
            let known = (0..).zip(step.units.keys());
            let first = known.take_while(|(n, unit)| n == *unit).count() as u64;
            if first < *units {
                lost.push(Lost {
                    step: number,
                    unit: first,
                    at: *at,
                });
            }
        }
        lost
    }

    /// The repair for damaged parts and lost records; `None` if there are none.
    #[must_use]
    pub fn remedy(&self, damaged: &[Needed]) -> Option<Remedy> {
        let parts = damaged
            .iter()
            .filter_map(|d| self.files.get(&d.file)?.parts.get(&d.section));
        let mut lost: Vec<Lost> = parts
            .map(|&Part { step, unit, at, .. }| Lost { step, unit, at })
            .chain(self.lost())
            .collect();
        lost.sort_unstable();
        lost.dedup_by_key(|lost| (lost.step, lost.unit));
        if lost.is_empty() {
            return None;
        }
        if lost.iter().all(|lost| self.can_redo(*lost)) {
            let name = |step: u32| self.steps[step as usize].name.clone();
            let units = lost.iter().map(|lost| (name(lost.step), lost.unit));
            return Some(Remedy::Redo(units.collect()));
        }
        let holds = |start: u64| {
            let damage = lost.iter().any(|lost| lost.at < start);
            let missing = self
                .files
                .values()
                .any(|file| file.first < start && file.deleted.is_some_and(|at| at >= start));
            !damage && !missing
        };
        let stage = self.begun.iter().rev().find(|(_, start)| holds(*start));
        stage.map(|(stage, start)| Remedy::Rewind {
            end: *start,
            stage: Some(stage.clone()),
        })
    }

    /// True if all inputs of the unit still exist: since then only files were deleted that the unit's own
    /// step or later ones made.
    fn can_redo(&self, lost: Lost) -> bool {
        !self.steps[lost.step as usize].name.is_empty()
            && self.files.values().all(|file| {
                let later = file.deleted.is_some_and(|at| at > lost.at);
                // Nothing is known of a file without writers.
                let made_later = file.first > lost.at && !file.steps.is_empty();
                !later || made_later || file.steps.contains(&lost.step)
            })
    }

    /// Marks units, and the steps around them, as not finished.
    pub fn forget(&mut self, units: &[(String, u64)]) {
        for (step, unit) in units {
            let Some(number) = self.numbers.get(step).copied() else {
                continue;
            };
            self.steps[number as usize].units.remove(unit);
            for (at, _) in step.match_indices('/').skip(1) {
                if let Some(around) = self.numbers.get(&step[..at]) {
                    self.steps[*around as usize].units.remove(&0);
                }
            }
            for file in self.files.values_mut() {
                file.parts
                    .retain(|_, part| (part.step, part.unit) != (number, *unit));
            }
        }
    }
}

#[cfg(test)]
mod tests;
