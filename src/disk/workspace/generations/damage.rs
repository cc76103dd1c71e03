//! Damaged work of tasks: what of it is needed is found and forgotten, so that tasks make it again.

use super::attempt::{append, of_task};
use super::{Generation, Opened, Resources, SharedFolder};
use crate::error::Result;
use crate::workspace::journal::{Entry, Failure, Journal, Record};
use crate::workspace::progress::{Cancel, Observer};
use crate::workspace::recover::{Whereabouts, recover};
use std::path::PathBuf;

impl SharedFolder {
    /// Begins an attempt at a generation in which damaged work is open again. Reads all scratch files that are
    /// needed. If nothing is damaged, that is noted, and none is returned.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`], [`crate::error::Error::Memory`].
    pub fn begin_repair(
        &self,
        generation: &mut Generation,
        resources: &Resources<'_>,
        (observer, cancel): (&dyn Observer, &Cancel),
    ) -> Result<Option<Opened>> {
        let units = generation.history.count();
        let output: [PathBuf; 2] = Default::default();
        let places = Whereabouts {
            folder: &self.path,
            output: &output,
            away: self.away.as_deref(),
        };
        let (done, _) = self.finished_tasks(generation)?;
        let end = recover(&mut generation.history, &places, observer, cancel)?;
        if end.is_none() && generation.history.count() == units {
            self.note_no_damage(generation)?;
            return Ok(None);
        }
        let number = generation.number + 1;
        let (attempt, path, journal) = self.claim(|attempt| self.attempt(number, attempt))?;
        let history = &generation.history;
        let stays = |entry: &Entry<'_>| match entry.record {
            Record::Manifest(_) | Record::Shared(_) | Record::Attempt(_) | Record::Took(_) => true,
            Record::Open(_) => false,
            Record::Unit { step, unit, .. } => {
                end.is_none_or(|end| entry.at < end) && history.payload(step, *unit).is_some()
            }
            _ => end.is_none_or(|end| entry.at < end),
        };
        append(&journal, &self.generation(generation.number), stays)?;
        // What is done again from an earlier stage on includes the work of these.
        for done in done.iter().filter(|_| end.is_none()) {
            append(&journal, done, of_task)?;
        }
        self.go_on(generation, attempt, (journal, path), resources)
            .map(Some)
    }

    /// Notes that what processes of this generation took for damage was none.
    fn note_no_damage(&self, generation: &Generation) -> Result<()> {
        for path in self.failed(generation)? {
            let Some((bytes, records)) = crate::workspace::journal::read(&path, None, |_| true)?
            else {
                continue;
            };
            let why = "it found damage, but all files were whole when they were checked";
            Journal::go_on(&path, bytes, records)?.append(Record::Failed(Failure {
                why: why.into(),
                damage: false,
            }))?;
            self.put_again(&path)?;
        }
        Ok(())
    }
}
