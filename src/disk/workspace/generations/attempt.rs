//! The beginning of an attempt: at a shard, or at the work between two generations.

use super::away::Sizes;
use super::{Generation, Opened, Resources, SharedFolder, TRIES};
use crate::error::{Error, Result};
use crate::workspace::journal::{self, Entry, Journal, Record, Task};
use crate::workspace::keeper::Keeper;
use crate::workspace::make_folder;
use crate::workspace::run::{ResumableRun, Role};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Bytes of memory for what a thread fetches of a store at a time, and its copy.
const FETCHING: u64 = 8 << 20;

impl SharedFolder {
    /// Begins an attempt at a shard of a generation.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::Memory`].
    pub fn begin_task(
        &self,
        generation: Generation,
        shard: u32,
        resources: &Resources<'_>,
    ) -> Result<Opened> {
        let number = generation.number;
        if !generation.is_left(shard) || self.is_there(&self.done(number, shard))? {
            return Ok(Opened::Done);
        }
        let folder = self.tasks(number);
        make_folder(&folder)?;
        let path = |attempt: u32| folder.join(format!("{shard}.{attempt}"));
        let (attempt, path, journal) = self.claim(path)?;
        let task = Task {
            run: generation.sharing.run,
            generation: number,
            shard,
        };
        journal.append(Record::Task(task))?;
        let first = generation.first_segment(shard, attempt);
        let role = Role::Task(generation.parts(shard));
        let past = self.generation(number);
        let run = self.run(role, first, generation, (journal, path, past), resources)?;
        Ok(Opened::Run(Box::new(run)))
    }

    /// A new journal, the first of these paths that does not exist.
    pub(super) fn claim(&self, path: impl Fn(u32) -> PathBuf) -> Result<(u32, PathBuf, Journal)> {
        for attempt in 0..TRIES {
            let path = path(attempt);
            match Journal::create(&path) {
                Ok(journal) if self.claims(&path)? => return Ok((attempt, path, journal)),
                Ok(_) => {}
                Err(Error::Io { source, .. }) if source.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        let why = format!("{TRIES} attempts at the same work failed; look at their messages");
        Err(Error::not_resumable(&self.path, why))
    }

    pub(super) fn run(
        &self,
        role: Role,
        first: Option<u32>,
        generation: Generation,
        (journal, path, past): (Journal, PathBuf, PathBuf),
        resources: &Resources<'_>,
    ) -> Result<ResumableRun> {
        let Resources {
            threads,
            memory,
            io,
        } = *resources;
        let limit = generation.sharing.threads as usize;
        if threads > limit {
            return Err(Error::Parameter {
                name: "threads",
                found: threads.to_string(),
                expected: format!("at most {limit}, as planned"),
            });
        }
        let many = || Error::not_resumable(&self.path, "it had too many attempts");
        let first = first.ok_or_else(many)?;
        let held = memory.reserve("history", generation.history.bytes())?;
        let fetching = match &self.away {
            Some(_) => memory.promise("scratch fetched", FETCHING * threads as u64)?,
            None => memory.promise("scratch fetched", 0)?,
        };
        let keeper = Keeper::start(journal.file(), &self.path, io.clone())
            .map_err(|e| Error::io(&path, "start a thread for", e))?;
        Ok(ResumableRun::new(
            self.path.clone(),
            role,
            (first, threads),
            (journal, past),
            keeper,
            (generation.history, held),
        )
        .with_away(self.away.clone().map(|away| (away, fetching))))
    }

    /// Begins an attempt at the work between `generation` and the next: takes over what the tasks did.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`], [`Error::Corrupt`], [`Error::Memory`].
    pub fn begin_next(&self, generation: Generation, resources: &Resources<'_>) -> Result<Opened> {
        if generation.finished {
            return Ok(Opened::Done);
        }
        let (done, missing) = self.finished_tasks(&generation)?;
        if !missing.is_empty() {
            return Ok(Opened::Missing(missing));
        }
        let number = generation.number + 1;
        let (attempt, path, _) = self.claim(|attempt| self.attempt(number, attempt))?;
        let journal = self.copy(&generation, &path)?;
        for done in done {
            append(&journal, &done, of_task)?;
        }
        self.go_on(&generation, attempt, (journal, path), resources)
    }

    /// The run of a process that makes the generation after this one, whose journal was begun.
    pub(super) fn go_on(
        &self,
        generation: &Generation,
        attempt: u32,
        (journal, path): (Journal, PathBuf),
        resources: &Resources<'_>,
    ) -> Result<Opened> {
        let first = generation.first_segment(generation.sharing.shards, attempt);
        let next = generation.first_segment(generation.sharing.shards + 1, 0);
        journal.append(Record::Attempt(next.unwrap_or(u32::MAX)))?;
        let state = self.read_journal(generation.number + 1, &path)?;
        let journal = (journal, path.clone(), path);
        let run = self.run(Role::Between, first, state, journal, resources)?;
        Ok(Opened::Run(Box::new(run)))
    }

    /// The journals of the finished tasks of a generation, and the shards without one.
    pub(super) fn finished_tasks(
        &self,
        generation: &Generation,
    ) -> Result<(Vec<PathBuf>, Vec<u32>)> {
        let (mut done, mut missing) = (Vec::new(), Vec::new());
        let sizes = self.sizes()?;
        for shard in 0..generation.sharing.shards {
            if generation.is_left(shard) {
                match self.task_records(generation, shard, &sizes)? {
                    Some(path) => done.push(path),
                    None => missing.push(shard),
                }
            }
        }
        Ok((done, missing))
    }

    /// Copies the journal of a generation to `path`, to continue it there.
    fn copy(&self, generation: &Generation, path: &Path) -> Result<Journal> {
        let from = self.generation(generation.number);
        std::fs::copy(&from, path).map_err(|e| Error::io(path, "copy a journal to", e))?;
        let (bytes, records) = generation.end;
        Journal::go_on(path, bytes, records)
    }

    /// The journal of the finished task of a shard; none if there is none. It must have all units of the shard,
    /// and the segments must have all bytes that it names; otherwise it is removed, and the shard is done again.
    fn task_records(
        &self,
        generation: &Generation,
        shard: u32,
        sizes: &Sizes,
    ) -> Result<Option<PathBuf>> {
        let path = self.done(generation.number, shard);
        if !self.bring(&path)? {
            return Ok(None);
        }
        let parts = generation.parts(shard);
        let expected = Task {
            run: generation.sharing.run,
            generation: generation.number,
            shard,
        };
        let (mut known, mut ended) = (false, false);
        let mut units: BTreeSet<(String, u64)> = BTreeSet::new();
        let mut ends = BTreeMap::new();
        let found = journal::read(&path, None, |entry: &Entry<'_>| {
            match entry.record {
                Record::Task(task) => known = *task == expected,
                Record::Unit {
                    step, unit, puts, ..
                } => {
                    units.insert((step.clone(), *unit));
                    for put in puts.iter().filter(|put| put.place.bytes > 0) {
                        let name = format!("{}.{}", put.file, put.place.segment);
                        let end = ends.entry(name).or_insert(0);
                        *end = (*end).max(put.place.end().unwrap_or(u64::MAX));
                    }
                }
                Record::Took(_) => ended = true,
                _ => {}
            }
            true
        })?;
        if found.is_none() && !path.exists() {
            return Ok(None);
        }
        let mut wanted = parts
            .iter()
            .flat_map(|(step, range)| range.clone().map(|unit| (step.clone(), unit)))
            .filter(|(step, unit)| generation.history.payload(step, *unit).is_none());
        let whole = |(name, end): (&String, &u64)| {
            !name.contains('/') && sizes.of(&self.path, name).is_some_and(|size| size >= *end)
        };
        let good = known && ended && wanted.all(|unit| units.contains(&unit));
        if good && ends.iter().all(whole) {
            return Ok(Some(path));
        }
        self.remove_file(&path)
            .map_err(|e| Error::io(&path, "remove the damaged", e))?;
        Ok(None)
    }
}

/// True for the records of a task that stay.
pub(super) fn of_task(entry: &Entry<'_>) -> bool {
    !matches!(entry.record, Record::Task(_))
}

/// Appends those records of the journal `path` for which `which` is true.
pub(super) fn append(
    journal: &Journal,
    path: &Path,
    which: impl Fn(&Entry<'_>) -> bool,
) -> Result<()> {
    let (mut outcome, file) = (Ok(()), journal::open(path)?);
    journal::read(path, None, |entry| {
        if which(entry) {
            outcome = append_one(journal, path, &file, entry);
        }
        outcome.is_ok()
    })?;
    outcome
}

fn append_one(journal: &Journal, path: &Path, file: &File, entry: &Entry<'_>) -> Result<()> {
    let mut record = entry.record.clone();
    if let Record::Unit { payload, .. } = &mut record {
        let (_, offset, bytes) = entry.payload;
        *payload = journal::payload(path, file, offset, bytes)?;
    }
    journal.append(record)
}
