//! A run that tasks share, perhaps on several machines. The folder is the only thing that they have in common.
//!
//! * `generations/N` is a journal of all work that was finished when generation N began, and of the steps whose
//!   units are open in it. It never changes.
//! * `tasks/N/SHARD.TRY` is the journal of an attempt at a shard of these units. A task that is finished links
//!   it to `SHARD.done`; of several attempts the first one counts.
//! * Between two generations, one process takes over what the tasks did, does what tasks cannot do, up to the
//!   next step with units, and links its journal to `generations/N+1`. Of several processes one wins.
//! * Every process writes segments of its own, and syncs them before it links its journal.
//!
//! So nothing is written by two, whatever is linked is whole, and anything may be done twice.

use super::IoCounters;
use super::away::Away;
use super::folder::{GENERATIONS, is_private, is_shared, sealed, unsealed};
use super::history::History;
use super::journal::{self, Journal, OpenStep, Record, Sharing, Took};
use super::memory::MemoryPool;
use super::open::{failed_write, open_existing, options};
use super::run::ResumableRun;
use crate::error::{Error, Remedy, Result, Setting};
use outcrop_platform::{FileAt, make_private_folder};
use publish::{link, sync};
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod attempt;
mod away;
mod damage;
mod publish;
mod state;

pub use state::{Attempts, Shard};

const TASKS: &str = "tasks";
const MANIFEST: &str = "manifest";

/// Most attempts at a shard, or at the work between two generations.
const TRIES: u32 = 64;

/// Largest manifest that is read.
const LARGEST: u64 = 64 << 20;

/// The folder of a run that tasks share.
#[derive(Debug, Clone)]
pub struct SharedFolder {
    /// Path of the folder.
    pub path: PathBuf,
    /// The manifest of the run.
    pub manifest: Vec<u8>,
    /// The store that has the run, if no folder is shared; `path` is then that of this process alone.
    away: Option<Arc<Away>>,
}

/// The state of a run at the beginning of a generation.
#[derive(Debug)]
pub struct Generation {
    /// Its number.
    pub number: u64,
    /// How tasks share the run.
    pub sharing: Sharing,
    /// The steps that are open in it; none before the first.
    pub open: Vec<OpenStep>,
    /// The resources that processes took so far.
    pub took: Vec<Took>,
    /// True if the run is finished.
    pub finished: bool,
    /// Bytes and records of its journal.
    end: (u64, u64),
    history: History,
}

/// The run of a process, or the reason why there is nothing to do.
pub enum Opened {
    /// The run.
    Run(Box<ResumableRun>),
    /// The work is finished already.
    Done,
    /// These shards are missing.
    Missing(Vec<u32>),
}

/// Resources of a process.
pub struct Resources<'a> {
    /// Worker threads.
    pub threads: usize,
    /// The memory budget.
    pub memory: &'a MemoryPool,
    /// Bytes moved.
    pub io: &'a Arc<IoCounters>,
}

impl Generation {
    /// Number of units that are open.
    #[must_use]
    pub fn units(&self) -> u64 {
        self.open.iter().map(|step| step.units).sum()
    }

    /// The units of a shard among those of all open steps.
    fn range(&self, shard: u32) -> Range<u64> {
        let (units, shards) = (u128::from(self.units()), u128::from(self.sharing.shards));
        let cut = |shard: u32| (units * u128::from(shard) / shards) as u64;
        cut(shard)..cut(shard + 1)
    }

    /// The units of a shard by step.
    #[must_use]
    pub fn parts(&self, shard: u32) -> Vec<(String, Range<u64>)> {
        let (mut first, wanted, mut parts) = (0, self.range(shard), Vec::new());
        for OpenStep { step, units } in &self.open {
            let begin = wanted.start.clamp(first, first + units) - first;
            let end = wanted.end.clamp(first, first + units) - first;
            if begin < end {
                parts.push((step.clone(), begin..end));
            }
            first += units;
        }
        parts
    }

    /// True if a shard has units that are not finished. Others are finished if work is made again that was
    /// damaged.
    #[must_use]
    pub fn is_left(&self, shard: u32) -> bool {
        let parts = self.parts(shard).into_iter();
        let mut units = parts.flat_map(|(step, units)| units.map(move |unit| (step.clone(), unit)));
        units.any(|(step, unit)| self.history.payload(&step, unit).is_none())
    }

    /// Numbers that one process takes for its segments: one a thread, and one for all others.
    fn width(&self) -> u32 {
        self.sharing.threads + 1
    }

    /// The first segment of an attempt, at a shard or, with the number of shards, at the next generation.
    fn first_segment(&self, shard: u32, attempt: u32) -> Option<u32> {
        let slot = shard.checked_mul(TRIES)?.checked_add(attempt)?;
        self.history
            .next_worker()
            .checked_add(slot.checked_mul(self.width())?)
    }
}

impl SharedFolder {
    /// Makes the folder of a new run.
    ///
    /// # Errors
    /// [`Error::NotResumable`] if the folder exists; [`Error::Io`].
    pub fn create(path: &Path, manifest: Vec<u8>, sharing: Sharing) -> Result<Self> {
        let io = |action: &'static str| move |e| Error::io(path, action, e);
        if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(io("make the folder"))?;
        }
        make_private_folder(path).map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists if is_shared(path) => exists(path),
            ErrorKind::AlreadyExists => Error::not_resumable(path, "it exists already")
                .with(Remedy::Remove)
                .with(Remedy::Another("scratch")),
            _ => Error::io(path, "make the folder", e),
        })?;
        for name in [GENERATIONS, TASKS] {
            std::fs::create_dir(path.join(name)).map_err(io("make a folder in it"))?;
        }
        let file = path.join(MANIFEST);
        let bytes = sealed(&manifest);
        options()
            .create_new(true)
            .open(&file)
            .and_then(|file| file.write_all_at(&bytes, 0).and_then(|()| file.sync_all()))
            .map_err(|e| failed_write(&file, bytes.len(), 0, e))?;
        let new = Self {
            path: path.to_path_buf(),
            manifest,
            away: None,
        };
        let begun = new.attempt(0, 0);
        let journal = Journal::create(&begun)?;
        journal.append(Record::Manifest(new.manifest.clone()))?;
        journal.append(Record::Shared(sharing))?;
        journal.append(Record::Attempt(0))?;
        sync(&begun)?;
        link(&begun, &new.generation(0))?;
        let _ = std::fs::remove_file(&begun);
        Ok(new)
    }

    /// True if a run that tasks share is at this path.
    #[must_use]
    pub fn is_at(path: &Path) -> bool {
        is_shared(path)
    }

    /// Opens the folder.
    ///
    /// # Errors
    /// [`Error::NotResumable`], [`Error::Io`].
    pub fn open(path: &Path) -> Result<Self> {
        let not = |why: &str| Error::not_resumable(path, why);
        if !is_private(path)? || !is_shared(path) {
            let plan = Remedy::Command("plan", "to begin one");
            return Err(not("no run that tasks share is here").with(plan));
        }
        let file = path.join(MANIFEST);
        let bytes = open_existing(&file).and_then(|file| {
            let mut bytes = vec![0; file.metadata()?.len().min(LARGEST) as usize];
            file.read_exact_at(&mut bytes, 0)?;
            Ok(bytes)
        });
        let bytes = bytes.map_err(|e| match e.kind() {
            ErrorKind::NotFound => not("its run is finished, it may be removed"),
            _ => Error::io(&file, "read", e),
        })?;
        let manifest = unsealed(&bytes)
            .ok_or_else(|| not("its manifest is damaged; remove it and plan again"))?;
        Ok(Self {
            path: path.to_path_buf(),
            manifest,
            away: None,
        })
    }

    fn generation(&self, number: u64) -> PathBuf {
        self.path.join(GENERATIONS).join(format!("{number:06}"))
    }

    /// The journal of an attempt to make a generation.
    fn attempt(&self, number: u64, attempt: u32) -> PathBuf {
        let name = format!("{number:06}.{attempt}");
        self.path.join(GENERATIONS).join(name)
    }

    fn tasks(&self, generation: u64) -> PathBuf {
        self.path.join(TASKS).join(format!("{generation:06}"))
    }

    fn done(&self, generation: u64, shard: u32) -> PathBuf {
        self.tasks(generation).join(format!("{shard}.done"))
    }

    /// The number of the newest generation.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn newest(&self) -> Result<u64> {
        let names = self.entries(&self.path.join(GENERATIONS))?.into_iter();
        let numbers = names.filter_map(|entry| entry.name.parse().ok());
        let missing = "its first generation is missing; remove it and plan again";
        numbers
            .max()
            .ok_or_else(|| Error::not_resumable(&self.path, missing))
    }

    /// True if a generation has begun, also if a list of the folder does not show it yet.
    #[must_use]
    pub fn has_begun(&self, number: u64) -> bool {
        self.is_there(&self.generation(number)).unwrap_or(false)
    }

    /// The state of the run at the beginning of a generation.
    ///
    /// # Errors
    /// [`Error::Corrupt`], [`Error::Io`].
    pub fn read(&self, number: u64) -> Result<Generation> {
        self.read_journal(number, &self.here(self.generation(number))?)
    }

    /// How tasks share the run.
    ///
    /// # Errors
    /// [`Error::Corrupt`], [`Error::Io`].
    pub fn sharing(&self) -> Result<Sharing> {
        let newest = self.generation(self.newest()?);
        let (path, mut found) = (self.here(newest)?, None);
        journal::read(&path, None, |entry| {
            if let Record::Shared(sharing) = entry.record {
                found = Some(sharing.clone());
            }
            found.is_none()
        })?;
        found.ok_or_else(|| self.damaged(&path, 0, "no journal"))
    }

    fn read_journal(&self, number: u64, path: &Path) -> Result<Generation> {
        let mut history = History::default();
        let end = journal::read(path, None, |entry| {
            history.add(entry);
            true
        })?;
        let bytes = path.metadata().map(|meta| meta.len());
        let bytes = bytes.map_err(|e| Error::io(path, "look at", e))?;
        let (Some(end), Some(sharing)) = (end, history.sharing.clone()) else {
            return Err(self.damaged(path, 0, "no journal"));
        };
        if end.0 != bytes {
            return Err(self.damaged(path, end.0, "a damaged record"));
        }
        Ok(Generation {
            number,
            sharing,
            open: std::mem::take(&mut history.open),
            took: std::mem::take(&mut history.took),
            finished: history.finished,
            end,
            history,
        })
    }

    fn damaged(&self, path: &Path, offset: u64, found: &str) -> Error {
        Error::Corrupt {
            path: path.to_path_buf(),
            offset,
            found: found.into(),
            expected: "a journal whose records match their checksums".into(),
        }
    }
}

/// The error of a new run in the place of another one.
fn exists(path: &Path) -> Error {
    Error::not_resumable(path, "it exists already")
        .with(Remedy::Give(Setting::Flag("resume"), "goes on with it"))
        .with(Remedy::Give(Setting::Flag("restart"), "begins again"))
        .with(Remedy::Another("scratch"))
}
