//! The finished work of earlier attempts according to the journal, and the part of it that survives damage.

use super::journal::{Entry, Record};
use super::place::Place;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Finished units, files and their parts.
#[derive(Debug, Default)]
pub struct History {
    /// For each unit of each step the offset and length of its payload in the journal.
    steps: HashMap<String, BTreeMap<u64, (u64, usize)>>,
    files: HashMap<String, FileHistory>,
    /// Stages begun, with the offsets of their records.
    begun: Vec<(String, u64)>,
}

#[derive(Debug, Default)]
struct FileHistory {
    parts: BTreeMap<u32, Part>,
    /// Offset of the first record about the file.
    first: u64,
    deleted: Option<u64>,
    /// Steps that wrote to the file.
    steps: HashSet<String>,
}

/// A part of a file, and the unit that wrote it.
#[derive(Debug, Clone)]
struct Part {
    place: Place,
    step: String,
    unit: u64,
    record: u64,
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
    /// These units are repeated; all others stay finished.
    Redo(Vec<(String, u64)>),
    /// The journal is cut at `end`: a stage is repeated from its start.
    Rewind {
        /// Offset of the cut.
        end: u64,
        /// The stage that follows; none if the journal has no stage.
        stage: Option<String>,
    },
}

impl History {
    /// The history in the records of a journal.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let mut history = Self::default();
        for entry in entries {
            history.add(entry);
        }
        history
    }

    fn add(&mut self, entry: &Entry) {
        match &entry.record {
            Record::Manifest(_) => {}
            Record::Begin(stage) => self.begun.push((stage.clone(), entry.offset)),
            Record::Deleted(name) => {
                let file = self.files.entry(name.clone()).or_default();
                file.deleted.get_or_insert(entry.offset);
            }
            Record::Unit {
                step, unit, puts, ..
            } => {
                let units = self.steps.entry(step.clone()).or_default();
                units.insert(*unit, entry.payload);
                for put in puts {
                    let file = self.files.entry(put.file.to_string()).or_default();
                    if file.steps.is_empty() {
                        file.first = entry.offset;
                    }
                    file.steps.insert(step.clone());
                    let part = Part {
                        place: put.place,
                        step: step.clone(),
                        unit: *unit,
                        record: entry.offset,
                    };
                    file.parts.insert(put.section, part);
                }
            }
        }
    }

    /// True if an earlier attempt began the stage.
    #[must_use]
    pub fn began(&self, stage: &str) -> bool {
        self.begun.iter().any(|(name, _)| name == stage)
    }

    /// Finished units, ascending.
    #[must_use]
    pub fn units(&self, step: &str) -> Vec<u64> {
        let units = self.steps.get(step);
        units.map_or_else(Vec::new, |units| units.keys().copied().collect())
    }

    /// Offset and length of the payload of a unit.
    #[must_use]
    pub fn payload(&self, step: &str, unit: u64) -> Option<(u64, usize)> {
        self.steps.get(step)?.get(&unit).copied()
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

    /// Names of the files that exist.
    pub fn live(&self) -> impl Iterator<Item = &str> {
        let live = self.files.iter().filter(|(_, file)| file.deleted.is_none());
        live.map(|(name, _)| name.as_str())
    }

    /// All parts of files that exist.
    #[must_use]
    pub fn needed(&self) -> Vec<Needed> {
        let live = self.files.iter().filter(|(_, file)| file.deleted.is_none());
        let parts = live.flat_map(|(name, file)| file.parts.iter().map(move |part| (name, part)));
        parts
            .map(|(name, (section, part))| Needed {
                file: name.clone(),
                section: *section,
                place: part.place,
            })
            .collect()
    }

    /// The repair for damaged parts; `None` if there are none.
    #[must_use]
    pub fn remedy(&self, damaged: &[Needed]) -> Option<Remedy> {
        let parts: Vec<&Part> = damaged
            .iter()
            .filter_map(|d| self.files.get(&d.file)?.parts.get(&d.section))
            .collect();
        if parts.is_empty() {
            return None;
        }
        if parts.iter().all(|part| self.can_redo(part)) {
            let mut units: Vec<_> = parts.iter().map(|p| (p.step.clone(), p.unit)).collect();
            units.sort();
            units.dedup();
            return Some(Remedy::Redo(units));
        }
        let holds = |start: u64| {
            let damage = parts.iter().any(|part| part.record < start);
            let missing = self.files.values().any(|file| {
                let needed = !file.steps.is_empty() && file.first < start;
                needed && file.deleted.is_some_and(|at| at >= start)
            });
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
    fn can_redo(&self, part: &Part) -> bool {
        !part.step.is_empty()
            && self.files.values().all(|file| {
                let later = file.deleted.is_some_and(|at| at > part.record);
                !later || file.first > part.record || file.steps.contains(&part.step)
            })
    }

    /// Marks units, and the steps around them, as not finished.
    pub fn forget(&mut self, units: &[(String, u64)]) {
        for (step, unit) in units {
            if let Some(known) = self.steps.get_mut(step) {
                known.remove(unit);
            }
            for (at, _) in step.match_indices('/').skip(1) {
                if let Some(around) = self.steps.get_mut(&step[..at]) {
                    around.remove(&0);
                }
            }
            for file in self.files.values_mut() {
                file.parts
                    .retain(|_, part| (&part.step, part.unit) != (step, *unit));
            }
        }
    }
}

#[cfg(test)]
mod tests;
