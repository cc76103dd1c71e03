//! The state of shards, as far as their files tell.

use super::away::Entry;
use super::{Generation, SharedFolder};
use crate::error::Result;
use crate::workspace::journal::{self, Failure, Record};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The state of a shard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shard {
    /// It has no units in this generation.
    Empty,
    /// No task began it.
    New,
    /// These attempts began; none is finished.
    Begun(Attempts),
    /// It is finished.
    Done,
}

/// Attempts at a piece of work, none of which is finished.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Attempts {
    /// Their number.
    pub count: u32,
    /// The time when one of them last wrote to its journal.
    pub written: Option<SystemTime>,
    /// Number of the last one that told why it failed, and its reason.
    pub failed: Option<(u32, Failure)>,
}

impl Attempts {
    /// Adds the attempt with this journal.
    fn add(&mut self, attempt: u32, entry: &Entry, folder: &SharedFolder) {
        self.count += 1;
        self.written = self.written.max(entry.modified);
        if self.failed.as_ref().is_none_or(|(last, _)| *last < attempt)
            && let Ok(path) = folder.here(entry.path.clone())
            && let Some(why) = reason(&path)
        {
            self.failed = Some((attempt, why));
        }
    }

    /// True if the last one failed because the work of others is damaged.
    #[must_use]
    pub fn found_damage(&self) -> bool {
        self.failed
            .as_ref()
            .is_some_and(|(_, failure)| failure.damage)
    }

    /// True if no attempt can be at work: all of them told that they failed, or the last one did.
    #[must_use]
    pub fn all_failed(&self) -> bool {
        self.failed
            .as_ref()
            .is_some_and(|(last, _)| last + 1 >= self.count)
    }
}

/// The reason why an attempt failed, if its journal tells.
fn reason(path: &Path) -> Option<Failure> {
    let mut why = None;
    // A journal that cannot be read tells nothing.
    let _ = journal::read(path, None, |entry| {
        if let Record::Failed(failure) = entry.record {
            why = Some(failure.clone());
        }
        true
    });
    why
}

impl SharedFolder {
    /// The state of all shards of a generation.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn shards(&self, generation: &Generation) -> Result<Vec<Shard>> {
        let count = generation.sharing.shards;
        let state = |shard| match generation.is_left(shard) {
            true => Shard::New,
            false => Shard::Empty,
        };
        let mut shards: Vec<Shard> = (0..count).map(state).collect();
        let folder = self.tasks(generation.number);
        let mut entries = self.entries(&folder)?;
        // Finished shards first, so that journals of their other attempts are not read.
        entries.sort_by_key(|entry| !entry.name.ends_with(".done"));
        for entry in &entries {
            let name = entry.name.split_once('.');
            let Some((Ok(shard), end)) = name.map(|(n, e)| (n.parse(), e)) else {
                continue;
            };
            let shard: usize = shard;
            let Some(state) = shards.get_mut(shard) else {
                continue;
            };
            match (&mut *state, end.parse()) {
                (Shard::Done, _) => {}
                (_, Err(_)) if end == "done" => *state = Shard::Done,
                (Shard::Begun(attempts), Ok(attempt)) => attempts.add(attempt, entry, self),
                (_, Ok(attempt)) => {
                    let mut attempts = Attempts::default();
                    attempts.add(attempt, entry, self);
                    *state = Shard::Begun(attempts);
                }
                _ => {}
            }
        }
        Ok(shards)
    }

    /// The attempts to make the generation after this one.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn advances(&self, generation: &Generation) -> Result<Attempts> {
        let next = generation.number + 1;
        let prefix = format!("{next:06}.");
        let mut attempts = Attempts::default();
        for entry in &self.entries(&self.path.join(super::GENERATIONS))? {
            if let Some(Ok(attempt)) = entry.name.strip_prefix(&prefix).map(str::parse) {
                attempts.add(attempt, entry, self);
            }
        }
        Ok(attempts)
    }

    /// The journals of processes that found damage.
    pub(super) fn failed(&self, generation: &Generation) -> Result<Vec<PathBuf>> {
        let mut paths = Vec::new();
        for (shard, state) in self.shards(generation)?.into_iter().enumerate() {
            if let Shard::Begun(Attempts {
                failed: Some((attempt, failure)),
                ..
            }) = state
                && failure.damage
            {
                let name = format!("{shard}.{attempt}");
                paths.push(self.tasks(generation.number).join(name));
            }
        }
        if let Some((attempt, failure)) = self.advances(generation)?.failed
            && failure.damage
        {
            paths.push(self.attempt(generation.number + 1, attempt));
        }
        Ok(paths)
    }

    /// True if a process of this generation found the work of others damaged.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn is_damaged(&self, generation: &Generation) -> Result<bool> {
        let shards = self.shards(generation)?;
        let task =
            |shard: &Shard| matches!(shard, Shard::Begun(attempts) if attempts.found_damage());
        Ok(shards.iter().any(task) || self.advances(generation)?.found_damage())
    }

    /// Seconds of wall-clock time of each finished task of a generation.
    #[must_use]
    pub fn seconds(&self, generation: &Generation, done: &[u32]) -> Vec<f64> {
        let of = |shard: &u32| {
            let mut seconds = None;
            let path = self.here(self.done(generation.number, *shard)).ok()?;
            journal::read(&path, None, |entry| {
                if let Record::Took(took) = entry.record {
                    seconds = Some(took.seconds);
                }
                true
            })
            .ok()?;
            seconds
        };
        done.iter().filter_map(of).collect()
    }

    /// The time when a generation began.
    #[must_use]
    pub fn begun(&self, number: u64) -> Option<SystemTime> {
        self.modified(&self.generation(number))
    }
}
