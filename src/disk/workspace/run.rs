//! A run that can be resumed: its journals, its finished steps, the files it still needs.
//!
//! The program is deterministic, so a resumed run is the same program again, in which finished work of the
//! journals is skipped. A step is identified by its name and the names of the steps around it.

use super::away::Away;
use super::history::History;
use super::journal::{self, Journal, OpenStep, Record};
use super::keeper::{Keeper, Leaving};
use super::listing::data;
use super::lock;
use super::memory::Reservation;
use super::place::{Place, Put};
use crate::error::Result;
use std::collections::{BTreeSet, HashSet};
use std::fs::File;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, OnceLock};

/// The stage that writes the mesh, at the beginning of the names of its steps.
const OUTPUT_STAGE: &str = "/export/";

/// The part of the work that this process does.
#[derive(Debug)]
pub enum Role {
    /// All work; the folder is locked meanwhile.
    Alone(File),
    /// The work between the units that tasks do.
    Between,
    /// Units of steps that are open.
    Task(Vec<(String, Range<u64>)>),
}

/// The state of a run that can be resumed.
#[derive(Debug)]
pub struct ResumableRun {
    folder: PathBuf,
    role: Role,
    /// The journal of the thread that runs the program; if tasks share the run, that of all threads.
    journal: Journal,
    /// The journal with the results of earlier attempts that have no worker, and its handle.
    past: PathBuf,
    opened: OnceLock<File>,
    /// The journals of the workers of this attempt, begun when they finish their first units.
    workers: Vec<OnceLock<Journal>>,
    /// The number of the first worker of this attempt among those of all attempts.
    first: u32,
    /// Syncs and deletes files.
    pub keeper: Keeper,
    /// The finished work of earlier attempts.
    history: History,
    /// The open steps of the program, outermost first; the first is the program itself.
    scopes: Mutex<Vec<Scope>>,
    /// Steps that were found open for tasks.
    open: Mutex<Vec<OpenStep>>,
    /// If tasks share the run: the segments that this process made, and other files that it wrote to.
    made: Mutex<HashSet<PathBuf>>,
    touched: Mutex<HashSet<PathBuf>>,
    /// Points of the cloud, as far as they are known.
    pub points: AtomicU64,
    /// The store that has the run, if tasks share no folder, and memory for what is fetched.
    away: Option<(Arc<Away>, Reservation)>,
    _held: Reservation,
}

#[derive(Debug, Default)]
struct Scope {
    path: String,
    /// Names of the steps begun inside.
    begun: HashSet<String>,
}

impl ResumableRun {
    /// A run on `threads` threads whose numbers begin with `first`; `past` is the journal with the results of
    /// earlier attempts.
    #[must_use]
    pub fn new(
        folder: PathBuf,
        role: Role,
        (first, threads): (u32, usize),
        (journal, past): (Journal, PathBuf),
        keeper: Keeper,
        (history, held): (History, Reservation),
    ) -> Self {
        Self {
            folder,
            role,
            journal,
            past,
            opened: OnceLock::new(),
            workers: (0..threads).map(|_| OnceLock::new()).collect(),
            first,
            keeper,
            history,
            scopes: Mutex::new(vec![Scope::default()]),
            open: Mutex::default(),
            made: Mutex::default(),
            touched: Mutex::default(),
            points: AtomicU64::new(0),
            away: None,
            _held: held,
        }
    }

    /// The same run, in a store.
    #[must_use]
    pub fn with_away(mut self, away: Option<(Arc<Away>, Reservation)>) -> Self {
        self.away = away;
        self
    }

    /// The store that has the run, if tasks share no folder.
    #[must_use]
    pub fn away(&self) -> Option<&Away> {
        self.away.as_ref().map(|(away, _)| &**away)
    }

    /// The store that has a segment, if it is not one of this process.
    #[must_use]
    pub fn away_of(&self, segment: u32) -> Option<&Away> {
        let own = self.first..=self.first.saturating_add(self.workers.len() as u32);
        self.away().filter(|_| !own.contains(&segment))
    }

    /// True if tasks share the run.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        !matches!(self.role, Role::Alone(_))
    }

    /// True if this process is a task.
    #[must_use]
    pub fn is_task(&self) -> bool {
        matches!(self.role, Role::Task(_))
    }

    /// If `step` is for tasks: the units of it that this process does. None of the `left` of its `units` units
    /// is finished then.
    #[must_use]
    pub fn shared_units(&self, step: &str, units: u64, left: &[usize]) -> Option<Range<u64>> {
        match &self.role {
            // The output is a file that this process alone sees.
            Role::Between if self.away.is_some() && step.starts_with(OUTPUT_STAGE) => None,
            Role::Between if !left.is_empty() => {
                let step = step.to_owned();
                lock(&self.open).push(OpenStep { step, units });
                Some(0..0)
            }
            Role::Task(parts) if !left.is_empty() => {
                let part = parts.iter().find(|(name, _)| name == step);
                Some(part.map_or(0..0, |(_, units)| units.clone()))
            }
            _ => None,
        }
    }

    /// The steps that were found open for tasks.
    pub fn take_open(&self) -> Vec<OpenStep> {
        std::mem::take(&mut *lock(&self.open))
    }

    /// The journal of this process.
    #[must_use]
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Notes that this process made a segment that others may read.
    pub fn made(&self, path: &std::path::Path) {
        if self.is_shared() {
            lock(&self.made).insert(path.to_path_buf());
        }
    }

    /// Notes a file, not a segment, that this process has written to.
    pub fn touched(&self, path: &std::path::Path) {
        if self.is_shared() {
            lock(&self.touched).insert(path.to_path_buf());
        }
    }

    /// The files that are not segments to which this process has written.
    #[must_use]
    pub fn files_touched(&self) -> Vec<PathBuf> {
        lock(&self.touched).iter().cloned().collect()
    }

    /// The segments that this process made.
    #[must_use]
    pub fn segments_made(&self) -> Vec<PathBuf> {
        lock(&self.made).iter().cloned().collect()
    }

    /// The number of the first worker of this attempt among those of all attempts.
    #[must_use]
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Begins the next step `name` of the program and returns its path.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn begin(&self, name: &str) -> Result<String> {
        let mut scopes = lock(&self.scopes);
        let (depth, Some(scope)) = (scopes.len(), scopes.last_mut()) else {
            return Ok(String::new());
        };
        // A resumed run would take the result of one for that of the other.
        let new = scope.begun.insert(name.to_owned());
        assert!(new, "two steps of {:?} have the name {name:?}", scope.path);
        let path = format!("{}/{name}", scope.path);
        drop(scopes);
        if depth == 1 && !self.is_task() && !self.history.began(&path) {
            self.journal.append(Record::Begin(path.clone()))?;
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
    /// [`crate::error::Error::Io`].
    pub fn payload(&self, step: &str, unit: u64) -> Result<Option<Vec<u8>>> {
        match self.history.payload(step, unit) {
            Some((None, offset, bytes)) => {
                let file = match self.opened.get() {
                    Some(file) => file,
                    None => {
                        let file = journal::open(&self.past)?;
                        self.opened.get_or_init(|| file)
                    }
                };
                journal::payload(&self.past, file, offset, bytes).map(Some)
            }
            Some((worker, offset, bytes)) => {
                let path = journal::path_of(&self.folder, worker);
                journal::payload(&path, &journal::open(&path)?, offset, bytes).map(Some)
            }
            None => Ok(None),
        }
    }

    /// Records in the journal of thread `worker` that a unit is finished.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn finish(
        &self,
        worker: usize,
        step: &str,
        unit: u64,
        puts: Vec<Put>,
        payload: Vec<u8>,
    ) -> Result<()> {
        self.keeper.check()?;
        let record = Record::Unit {
            step: step.to_owned(),
            unit,
            after: self.journal.records(),
            puts,
            payload,
        };
        match self.workers.get(worker) {
            Some(journal) if !self.is_shared() => self.of_worker(worker, journal)?.append(record),
            _ => self.journal.append(record),
        }
    }

    fn of_worker<'a>(&self, worker: usize, journal: &'a OnceLock<Journal>) -> Result<&'a Journal> {
        if let Some(begun) = journal.get() {
            return Ok(begun);
        }
        let number = self.first + worker as u32;
        let new = Journal::create(&self.folder.join(journal::of_worker(number)))?;
        self.keeper.journal(new.file());
        Ok(journal.get_or_init(|| new))
    }

    /// Records that all `units` units of a step are finished, with the files that they wrote.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn end(&self, step: &str, units: u64, files: BTreeSet<String>) -> Result<()> {
        self.keeper.check()?;
        let mut files = files;
        match self.history.ended(step) {
            Some(known) if known.is_superset(&files) => return Ok(()),
            known => files.extend(known.into_iter().flatten().cloned()),
        }
        files.extend(self.history.files_of(step).map(str::to_owned));
        let step = step.to_owned();
        let files = files.into_iter().collect();
        self.journal.append(Record::End { step, units, files })
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

    /// Records that the run is finished and its files are not needed any more.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn retire(&self) -> Result<()> {
        let names = data(&self.folder)?.into_iter();
        let files: BTreeSet<String> = names
            .filter_map(|n| Some(n.rsplit_once('.')?.0.to_owned()))
            .collect();
        let mut records = files.into_iter().map(Record::Deleted);
        records.try_for_each(|record| self.journal.append(record))
    }

    /// Deletes the segments `leaving` of the file `name`. If tasks share the run, those of other processes stay.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn delete(&self, name: &str, leaving: impl Iterator<Item = Leaving>) -> Result<()> {
        self.keeper.check()?;
        self.journal.append(Record::Deleted(name.to_owned()))?;
        if self.is_shared() {
            let mut made = lock(&self.made);
            return self
                .keeper
                .delete(leaving.filter(|l| made.remove(&l.0.path)));
        }
        self.keeper.delete(leaving)
    }
}
