//! A run that can be resumed: its journal, its finished steps, the files it still needs.
//!
//! The program is deterministic, so a resumed run is the same program again, in which finished work of the
//! journal is skipped. A step is identified by its name and the names of the steps around it.

use super::history::History;
use super::journal::{Journal, Record};
use super::keeper::{Keeper, Leaving};
use super::place::{Place, Put};
use crate::error::Result;
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The state of a run that can be resumed.
#[derive(Debug)]
pub struct ResumableRun {
    folder: PathBuf,
    journal: Journal,
    /// Syncs and deletes files.
    pub keeper: Keeper,
    /// The finished work of earlier attempts.
    history: History,
    /// The open steps of the program, outermost first; the first is the program itself.
    scopes: Mutex<Vec<Scope>>,
    /// Files dropped since the last step began.
    dropped: Mutex<Vec<(Arc<str>, u64)>>,
    /// Number of owners of each file.
    held: Mutex<HashMap<Arc<str>, usize>>,
    /// Locked as long as the run is at work.
    _lock: File,
}

#[derive(Debug, Default)]
struct Scope {
    path: String,
    /// Names of the steps begun inside.
    begun: HashSet<String>,
}

thread_local! {
    /// Notes of the units that are at work on this thread, outermost first.
    static NOTES: RefCell<Vec<Noted>> = const { RefCell::new(Vec::new()) };
}

/// The parts of files and the progress of a unit.
#[derive(Debug, Default)]
pub struct Noted {
    /// Parts of files.
    pub puts: Vec<Put>,
    /// Items of progress.
    pub items: u64,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Collects the notes of a unit on this thread until it is finished or dropped.
#[derive(Debug)]
pub struct Notes(());

impl Notes {
    /// Begins to collect.
    #[must_use]
    pub fn begin() -> Self {
        NOTES.with_borrow_mut(|notes| notes.push(Noted::default()));
        Self(())
    }

    /// The collected notes.
    #[must_use]
    pub fn finish(self) -> Noted {
        let noted = NOTES.with_borrow_mut(Vec::pop).unwrap_or_default();
        std::mem::forget(self);
        noted
    }

    /// Notes progress.
    pub fn advance(items: u64) {
        NOTES.with_borrow_mut(|notes| {
            if let Some(noted) = notes.last_mut() {
                noted.items += items;
            }
        });
    }
}

impl Drop for Notes {
    fn drop(&mut self) {
        NOTES.with_borrow_mut(Vec::pop);
    }
}

impl ResumableRun {
    /// A run in a locked folder.
    #[must_use]
    pub fn new(
        folder: PathBuf,
        journal: Journal,
        keeper: Keeper,
        history: History,
        lock: File,
    ) -> Self {
        Self {
            folder,
            journal,
            keeper,
            history,
            scopes: Mutex::new(vec![Scope::default()]),
            dropped: Mutex::default(),
            held: Mutex::default(),
            _lock: lock,
        }
    }

    /// Notes a part of a file.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn put(&self, put: Put) -> Result<()> {
        let alone = NOTES.with_borrow_mut(|notes| match notes.last_mut() {
            Some(noted) => {
                noted.puts.push(put);
                None
            }
            None => Some(put),
        });
        match alone {
            // A part outside of any unit is recorded at once.
            Some(put) => self.finish("", 0, vec![put], Vec::new()),
            None => Ok(()),
        }
    }

    /// Begins the next step `name` of the program and returns its path. Files that were dropped before are
    /// deleted.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn begin(&self, name: &str) -> Result<String> {
        self.delete_dropped()?;
        let mut scopes = lock(&self.scopes);
        let (depth, Some(scope)) = (scopes.len(), scopes.last_mut()) else {
            return Ok(String::new());
        };
        // A resumed run would take the result of one for that of the other.
        let new = scope.begun.insert(name.to_owned());
        assert!(new, "two steps of {:?} have the name {name:?}", scope.path);
        let path = format!("{}/{name}", scope.path);
        drop(scopes);
        if depth == 1 && !self.history.began(&path) {
            self.journal.append(&Record::Begin(path.clone()))?;
        }
        Ok(path)
    }

    /// Enters a step.
    pub fn enter(&self, path: &str) {
        lock(&self.scopes).push(Scope {
            path: path.to_owned(),
            begun: HashSet::new(),
        });
    }

    /// Leaves the innermost step.
    pub fn leave(&self) {
        lock(&self.scopes).pop();
    }

    /// The units of a step that earlier attempts finished.
    #[must_use]
    pub fn finished(&self, step: &str) -> Vec<u64> {
        self.history.units(step)
    }

    /// The payload of a finished unit; none if it is not finished.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn payload(&self, step: &str, unit: u64) -> Result<Option<Vec<u8>>> {
        match self.history.payload(step, unit) {
            Some((offset, bytes)) => self.journal.payload(offset, bytes).map(Some),
            None => Ok(None),
        }
    }

    /// Records that a unit is finished.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn finish(&self, step: &str, unit: u64, puts: Vec<Put>, payload: Vec<u8>) -> Result<()> {
        self.journal.append(&Record::Unit {
            step: step.to_owned(),
            unit,
            puts,
            payload,
        })
    }

    /// The parts of a file that earlier attempts wrote.
    #[must_use]
    pub fn places(&self, file: &str) -> Vec<(u32, Place)> {
        self.history.places(file)
    }

    /// True if an earlier attempt deleted the file.
    #[must_use]
    pub fn is_deleted(&self, file: &str) -> bool {
        self.history.is_deleted(file)
    }

    /// Notes another owner of a file. A file that a finished step takes and returns has two owners for a
    /// moment: the argument of the step, and its restored result.
    pub fn hold(&self, name: &Arc<str>) {
        *lock(&self.held).entry(name.clone()).or_default() += 1;
    }

    /// Notes that an owner dropped a file; false if there are others. After an error the file is still
    /// needed; it is therefore deleted only when the next step begins.
    pub fn drop_later(&self, name: &Arc<str>, bytes: u64) -> bool {
        let mut held = lock(&self.held);
        let holders = held.entry(name.clone()).or_insert(1);
        *holders = holders.saturating_sub(1);
        let last = *holders == 0;
        if last {
            held.remove(name);
            lock(&self.dropped).push((name.clone(), bytes));
        }
        last
    }

    /// Records that the run is finished and its files are not needed any more.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn retire(&self) -> Result<()> {
        let names = super::folder::data(&self.folder)?.into_iter();
        names
            .map(Record::Deleted)
            .try_for_each(|record| self.journal.append(&record))
    }

    /// Deletes the dropped files.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn delete_dropped(&self) -> Result<()> {
        let dropped = std::mem::take(&mut *lock(&self.dropped));
        let mut leaving = Vec::with_capacity(dropped.len());
        for (name, bytes) in dropped {
            let path = self.folder.join(&*name);
            self.journal.append(&Record::Deleted(name.to_string()))?;
            leaving.push(Leaving { name, path, bytes });
        }
        self.keeper.delete(leaving);
        Ok(())
    }
}
