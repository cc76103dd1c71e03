//! What a run stands on: the scratch folder, the memory budget, threads, progress and cancellation.
//!
//! The workspace knows nothing of stages or records; stages ask it for memory, files and threads.

pub mod fault;
pub mod file;
mod folder;
mod history;
mod journal;
mod keeper;
pub mod limits;
pub mod memory;
pub mod open;
pub mod persist;
pub mod place;
pub mod progress;
mod recover;
mod run;
pub(crate) mod steps;
mod units;

pub use folder::{Folder, Found};
pub use recover::{OUTPUT, RENAMED};

use crate::error::{Error, Result};
use file::{Maker, ScratchFile, Shared};
use memory::{MemoryPool, Reservation};
use open::open_existing;
use place::Place;
use progress::{Cancel, Observer};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Bytes moved and scratch space held, counted where files are read and written.
#[derive(Debug, Default)]
pub struct IoCounters {
    read: AtomicU64,
    written: AtomicU64,
    scratch: AtomicU64,
    scratch_peak: AtomicU64,
    stage_peak: AtomicU64,
}

impl IoCounters {
    /// Counts `bytes` read from a file.
    pub fn add_read(&self, bytes: u64) {
        self.read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts `bytes` written to a file.
    pub fn add_written(&self, bytes: u64) {
        self.written.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts `bytes` of scratch space taken.
    pub fn grow_scratch(&self, bytes: u64) {
        let now = self.scratch.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.scratch_peak.fetch_max(now, Ordering::Relaxed);
        self.stage_peak.fetch_max(now, Ordering::Relaxed);
    }

    /// Begins to look for another peak, see [`IoCounters::stage_peak`].
    pub fn begin_stage(&self) {
        self.stage_peak.store(self.scratch(), Ordering::Relaxed);
    }

    /// Largest scratch space held at one time since the stage began.
    #[must_use]
    pub fn stage_peak(&self) -> u64 {
        self.stage_peak.load(Ordering::Relaxed)
    }

    /// Counts `bytes` of scratch space given back.
    pub fn shrink_scratch(&self, bytes: u64) {
        self.scratch.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Scratch space held now.
    #[must_use]
    pub fn scratch(&self) -> u64 {
        self.scratch.load(Ordering::Relaxed)
    }

    /// Bytes read so far.
    #[must_use]
    pub fn read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Bytes written so far.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Largest scratch space held at one time.
    #[must_use]
    pub fn scratch_peak(&self) -> u64 {
        self.scratch_peak.load(Ordering::Relaxed)
    }
}

/// The scratch folder, memory budget, threads, progress and cancellation of one run.
pub struct Workspace {
    folder: PathBuf,
    /// Removes the folder at the end, unless a later run may go on from there.
    _temporary: Option<tempfile::TempDir>,
    /// The memory budget.
    pub memory: MemoryPool,
    /// Number of worker threads.
    pub threads: usize,
    /// Raised to stop the run.
    pub cancel: Cancel,
    /// Who is told of progress.
    pub observer: Arc<dyn Observer>,
    /// Bytes moved so far.
    pub io: Arc<IoCounters>,
    shared: Arc<Shared>,
    numbers: AtomicU64,
    parts: Mutex<Vec<(&'static str, f64)>>,
    pool: Arc<rayon::ThreadPool>,
}

fn pool(threads: usize, folder: &Path) -> Result<Arc<rayon::ThreadPool>> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("outcrop-{i}"))
        .build();
    pool.map(Arc::new)
        .map_err(|e| Error::io(folder, "start threads", std::io::Error::other(e)))
}

impl Workspace {
    /// Makes a private scratch folder (mode 0700) inside `parent`; it is removed on drop.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder or the threads cannot be made.
    pub fn new(
        parent: &Path,
        memory: MemoryPool,
        threads: usize,
        observer: Arc<dyn Observer>,
        cancel: Cancel,
    ) -> Result<Self> {
        std::fs::create_dir_all(parent)
            .map_err(|e| Error::io(parent, "make the scratch folder", e))?;
        let folder = tempfile::Builder::new()
            .prefix("outcrop-scratch-")
            .tempdir_in(parent)
            .map_err(|e| Error::io(parent, "make a scratch folder in it", e))?;
        let threads = threads.max(1);
        let shared = Arc::new(Shared::default());
        Ok(Self {
            pool: pool(threads, parent)?,
            folder: folder.path().to_path_buf(),
            _temporary: Some(folder),
            memory,
            threads,
            cancel,
            observer,
            io: shared.io.clone(),
            shared,
            numbers: AtomicU64::new(0),
            parts: Mutex::default(),
        })
    }

    /// Works in a folder from which a later run can go on, and goes on from what an earlier one left
    /// there.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::Cancelled`].
    pub fn resumable(
        folder: Folder,
        memory: MemoryPool,
        threads: usize,
        observer: Arc<dyn Observer>,
        cancel: Cancel,
    ) -> Result<Self> {
        let threads = threads.max(1);
        let pool = pool(threads, &folder.path)?;
        let path = folder.path.clone();
        let io: Arc<IoCounters> = Arc::default();
        let run = pool.install(|| folder.open(&io, &*observer, &cancel))?;
        let shared = Arc::new(Shared {
            io: io.clone(),
            run: Some(Arc::new(run)),
            ..Shared::default()
        });
        Ok(Self {
            folder: path,
            _temporary: None,
            memory,
            threads,
            cancel,
            observer,
            io,
            shared,
            numbers: AtomicU64::new(0),
            parts: Mutex::default(),
            pool,
        })
    }

    /// Path of the scratch file `name`.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Makes the scratch file `name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create_file(&self, name: &str) -> Result<ScratchFile> {
        self.maker().make(name, false)
    }

    /// The scratch file `name` of a run that can be resumed, with what earlier attempts put there: new
    /// in others. Whoever puts something there tells so by [`ScratchFile::put`].
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_file(&self, name: &str) -> Result<(ScratchFile, Vec<(u32, Place)>)> {
        let Some(run) = &self.shared.run else {
            return Ok((self.maker().make(name, false)?, Vec::new()));
        };
        let places = run.places(name);
        let path = self.file(name);
        let file = if run.is_deleted(name) {
            ScratchFile::new(name, path, None, true, self.shared.clone())
        } else if places.is_empty() {
            self.maker().make(name, true)?
        } else {
            let file = open_existing(&path).map_err(|e| Error::io(&path, "open", e))?;
            ScratchFile::new(name, path, Some(file), true, self.shared.clone())
        };
        let end = places.iter().filter_map(|(_, p)| p.end()).max();
        file.reach(end.unwrap_or(0));
        Ok((file, places))
    }

    /// Tells the observer of progress, and of as much if the unit that does so is found finished later.
    pub fn advance(&self, items: u64) {
        run::Notes::advance(items);
        self.observer.advance(items);
    }

    /// 0, 1, 2 … to tell things apart that are made in one workspace.
    pub fn number(&self) -> u64 {
        self.numbers.fetch_add(1, Ordering::Relaxed)
    }

    /// Makes scratch files on any thread.
    #[must_use]
    pub fn maker(&self) -> Maker {
        Maker {
            folder: self.folder.clone(),
            shared: self.shared.clone(),
        }
    }

    /// Removes the folder of a run that is `finished`, or that nobody can go on with.
    pub fn remove(&self, finished: bool) {
        let finished = finished && self.shared.run.as_ref().is_some_and(|r| r.retire().is_ok());
        Folder::remove(&self.folder, finished);
    }

    /// Deletes files that were dropped. Only after a step that did not fail.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn let_go(&self) -> Result<()> {
        self.shared.run.as_ref().map_or(Ok(()), |run| run.let_go())
    }

    /// Says how much scratch the run will take at its peak, for those who run out of it.
    pub fn expect_scratch(&self, bytes: u64) {
        self.shared.expected.store(bytes, Ordering::Relaxed);
    }

    /// Scratch bytes that will be needed beside those that are taken.
    #[must_use]
    pub fn more_scratch(&self) -> u64 {
        self.shared.more()
    }

    /// Reserves memory out of the budget.
    ///
    /// # Errors
    /// See [`MemoryPool::reserve`].
    pub fn reserve(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.reserve(name, bytes)
    }

    /// Reserves memory of which nothing is taken yet.
    ///
    /// # Errors
    /// See [`MemoryPool::promise`].
    pub fn promise(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.promise(name, bytes)
    }

    /// Gives back to the system what stages have freed. For before those whose lists are large and of other
    /// sizes; no unit may be at work.
    pub fn trim(&self) {
        self.memory.trim(&self.pool);
    }

    /// The run's threads, for rayon.
    #[must_use]
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        self.pool.clone()
    }

    /// Runs `work` with rayon's parallel iterators bound to this run's threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Does `work` and notes, for the report, how long it took as part `name` of the stage.
    pub fn part<T>(&self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let outcome = work();
        self.note_part(name, start.elapsed().as_secs_f64());
        outcome
    }

    /// Notes a part of the stage that took so many seconds.
    pub fn note_part(&self, name: &'static str, seconds: f64) {
        let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        parts.push((name, seconds));
    }

    /// The parts noted since this was last asked for.
    pub fn take_parts(&self) -> Vec<(&'static str, f64)> {
        std::mem::take(&mut *self.parts.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// # Errors
    /// [`Error::Cancelled`] once the run was asked to stop, [`Error::TimeLimit`] once its time is up.
    pub fn check_cancel(&self) -> Result<()> {
        self.cancel.check()
    }
}
