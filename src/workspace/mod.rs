//! What a run stands on: the scratch folder, the memory budget, threads, progress and cancellation.
//!
//! The workspace knows nothing of stages or records; stages ask it for memory, files and threads.

pub mod limits;
pub mod memory;
pub mod progress;
mod units;

use crate::error::{Error, Result};
use memory::{MemoryPool, Reservation};
use progress::{Cancel, Observer};
use std::fs::File;
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
    }

    /// Counts `bytes` of scratch space given back.
    pub fn shrink_scratch(&self, bytes: u64) {
        self.scratch.fetch_sub(bytes, Ordering::Relaxed);
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
    folder: tempfile::TempDir,
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
    parts: Mutex<Vec<(&'static str, f64)>>,
    pool: Arc<rayon::ThreadPool>,
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
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("outcrop-{i}"))
            .build()
            .map_err(|e| Error::io(parent, "start threads", std::io::Error::other(e)))?;
        Ok(Self {
            folder,
            memory,
            threads,
            cancel,
            observer,
            io: Arc::default(),
            parts: Mutex::default(),
            pool: Arc::new(pool),
        })
    }

    /// Path of the scratch file `name`.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Makes the scratch file `name`, for reading and writing.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create_file(&self, name: &str) -> Result<(PathBuf, File)> {
        let path = self.file(name);
        let file = File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path)
            .map_err(|e| Error::io(&path, "create", e))?;
        Ok((path, file))
    }

    /// Reserves memory out of the budget.
    ///
    /// # Errors
    /// See [`MemoryPool::reserve`].
    pub fn reserve(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.reserve(name, bytes)
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
    /// [`Error::Cancelled`] once the run was asked to stop.
    pub fn check_cancel(&self) -> Result<()> {
        if self.cancel.is_cancelled() {
            Err(Error::Cancelled)
        } else {
            Ok(())
        }
    }
}
