//! Services for a run: the scratch folder, the memory budget, threads, progress and cancellation.
//!
//! The workspace knows neither stages nor rows. Stages obtain memory, files and threads from it.

pub mod away;
pub mod compressed;
mod counters;
pub mod course;
mod disk;
pub mod fault;
pub mod file;
mod files;
mod folder;
pub mod generations;
mod history;
pub mod journal;
mod keeper;
pub mod limits;
mod listing;
pub mod mapped;
pub mod memory;
mod names;
pub mod open;
pub mod outlook;
mod pipe;
pub mod place;
pub mod progress;
mod recover;
mod run;
pub mod steps;
mod storage;
mod unit;
mod units;
mod wait;
pub mod zip;

pub use counters::IoCounters;
pub use files::Files;
pub use folder::{Folder, Found};
pub use names::{OUTPUT, output_of, square_path, temporary};
pub use recover::RENAMED;
pub use storage::{Compression, Storage};
pub use unit::Unit;

use crate::error::{Error, Result};
use generations::{Opened, Resources};
use memory::{MemoryPool, Reservation};
use progress::{Cancel, Observer};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use storage::Shared;

/// The scratch folder, memory budget, threads, progress and cancellation of one run.
pub struct Workspace {
    folder: PathBuf,
    /// Removes the folder at the end, unless a later attempt may resume the run.
    _temporary: Option<tempfile::TempDir>,
    /// The memory budget.
    pub memory: MemoryPool,
    /// Number of worker threads.
    pub threads: usize,
    /// Raised to stop the run.
    pub cancel: Cancel,
    /// Receives the progress.
    pub observer: Arc<dyn Observer>,
    /// Bytes moved so far.
    pub io: Arc<IoCounters>,
    shared: Arc<Shared>,
    /// The scratch files.
    pub files: Files,
    /// Memory for the compression of rows.
    compressing: Mutex<Option<Reservation>>,
    numbers: AtomicU64,
    parts: Mutex<Vec<(&'static str, f64)>>,
    pool: Arc<rayon::ThreadPool>,
    /// The last field, so that all handles are closed before.
    left: Left,
}

/// A folder that could not be removed because files in it were open.
#[derive(Debug, Default)]
struct Left(Mutex<Option<PathBuf>>);

/// Attempts to remove it, and the time between them: the thread that syncs may be at work for a moment.
const REMOVALS: u32 = 50;
const REMOVAL_PAUSE: Duration = Duration::from_millis(20);

impl Drop for Left {
    fn drop(&mut self) {
        let Some(folder) = lock(&self.0).take() else {
            return;
        };
        for _ in 0..REMOVALS {
            if std::fs::remove_dir(&folder).is_ok() || !folder.exists() {
                return;
            }
            std::thread::sleep(REMOVAL_PAUSE);
        }
    }
}

/// Makes a folder in one that exists, unless it is there.
pub fn make_folder(folder: &Path) -> Result<()> {
    match std::fs::create_dir(folder) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => {
            Err(Error::io(folder, "make the folder", e))
        }
        _ => Ok(()),
    }
}

/// Locks a mutex; whoever panicked with it left consistent data.
pub fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
    /// Creates a private scratch folder (mode 0700) inside `parent`; it is removed on drop.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder or the threads cannot be created.
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
        let pool = pool(threads, parent)?;
        let path = folder.path().to_path_buf();
        let mut workspace = Self::of(path, Arc::default(), None, memory, pool, observer, cancel);
        workspace._temporary = Some(folder);
        Ok(workspace)
    }

    fn of(
        folder: PathBuf,
        io: Arc<IoCounters>,
        run: Option<run::ResumableRun>,
        memory: MemoryPool,
        pool: Arc<rayon::ThreadPool>,
        observer: Arc<dyn Observer>,
        cancel: Cancel,
    ) -> Self {
        outcrop_platform::process::open_many_files();
        let shared = Arc::new(Shared {
            folder: folder.clone(),
            io: io.clone(),
            run,
            expected: AtomicU64::new(0),
            memory: memory.clone(),
            storage: OnceLock::new(),
            level: AtomicI32::new(storage::UNDECIDED),
        });
        Self {
            folder,
            _temporary: None,
            memory,
            threads: pool.current_num_threads(),
            cancel,
            observer,
            io,
            files: Files::new(shared.clone(), pool.clone()),
            shared,
            compressing: Mutex::default(),
            numbers: AtomicU64::new(0),
            parts: Mutex::default(),
            pool,
            left: Left::default(),
        }
    }

    /// A workspace with the least budget, for unit tests.
    ///
    /// # Errors
    /// [`Error::Io`].
    #[doc(hidden)]
    pub fn for_tests(threads: usize) -> Result<Self> {
        let memory = MemoryPool::new(memory::MINIMUM_BUDGET)?;
        let (observer, cancel) = (Arc::new(progress::Silent), Cancel::new());
        Self::new(&std::env::temp_dir(), memory, threads, observer, cancel)
    }

    /// Uses a folder from which a run can be resumed, and resumes the run of earlier attempts in it.
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
        let run = pool.install(|| folder.open(threads, &memory, &io, &*observer, &cancel))?;
        Ok(Self::of(
            path,
            io,
            Some(run),
            memory,
            pool,
            observer,
            cancel,
        ))
    }

    /// Takes part in a run that tasks share; `begin` begins its part.
    ///
    /// # Errors
    /// Errors of `begin`, [`Error::Io`].
    pub fn shared(
        folder: &Path,
        memory: MemoryPool,
        threads: usize,
        observer: Arc<dyn Observer>,
        cancel: Cancel,
        begin: impl FnOnce(&Resources<'_>) -> Result<Opened>,
    ) -> Result<Result<Self, Opened>> {
        let threads = threads.max(1);
        let io: Arc<IoCounters> = Arc::default();
        let resources = Resources {
            threads,
            memory: &memory,
            io: &io,
        };
        let run = match begin(&resources)? {
            Opened::Run(run) => *run,
            nothing => return Ok(Err(nothing)),
        };
        let pool = pool(threads, folder)?;
        let path = folder.to_path_buf();
        let run = Some(run);
        Ok(Ok(Self::of(path, io, run, memory, pool, observer, cancel)))
    }

    /// Sets how files are read and written; to be called before the first file is. Automatic compression is
    /// decided where the disk need is known, see [`Workspace::expect_scratch`].
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no room for compression.
    pub fn set_storage(&self, storage: Storage) -> Result<()> {
        // The first setting holds.
        let _ = self.shared.storage.set(storage);
        match storage.compression {
            Compression::Level(level) => self.compress_rows(level),
            Compression::Auto | Compression::None => Ok(()),
        }
    }

    /// True if inputs are mapped.
    #[must_use]
    pub fn maps_inputs(&self) -> bool {
        self.shared.storage().io == mapped::Io::Map
    }

    /// Compresses rows from now on.
    fn compress_rows(&self, level: i32) -> Result<()> {
        let bytes = self.threads as u64 * storage::COMPRESSING;
        *lock(&self.compressing) = Some(self.memory.promise("compression", bytes)?);
        self.shared.level.store(level, Ordering::Relaxed);
        Ok(())
    }

    /// Path of `name` in the scratch folder.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The next of the numbers 0, 1, 2 …, for names that are unique in the workspace.
    pub fn number(&self) -> u64 {
        self.numbers.fetch_add(1, Ordering::Relaxed)
    }

    /// Removes the folder if the run is `finished` or cannot be resumed.
    pub fn remove(&self, finished: bool) {
        let finished = finished && self.shared.run.as_ref().is_some_and(|r| r.retire().is_ok());
        if !Folder::remove(&self.folder, finished) {
            *lock(&self.left.0) = Some(self.folder.clone());
        }
    }

    /// Sets the estimated peak of the scratch space in bytes: for the message when the disk is full, and to
    /// decide on automatic compression.
    pub fn expect_scratch(&self, bytes: u64) {
        self.shared.expected.store(bytes, Ordering::Relaxed);
        let auto = self.shared.storage().compression == Compression::Auto;
        if auto && self.shared.level.load(Ordering::Relaxed) == storage::UNDECIDED {
            self.shared.level.store(0, Ordering::Relaxed);
            let away = self.run().is_some_and(|run| run.away().is_some());
            if away || disk::compression_pays(&self.folder, bytes, self.threads) {
                // Without room for it, rows are not compressed.
                let _ = self.compress_rows(1);
            }
        }
    }

    /// Scratch bytes still to be written, according to that estimate.
    #[must_use]
    pub fn more_scratch(&self) -> u64 {
        self.shared.more()
    }

    /// Reserves memory from the budget.
    ///
    /// # Errors
    /// See [`MemoryPool::reserve`].
    pub fn reserve(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.reserve(name, bytes)
    }

    /// Reserves memory that is not in use yet.
    ///
    /// # Errors
    /// See [`MemoryPool::promise`].
    pub fn promise(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.promise(name, bytes)
    }

    /// Returns freed memory to the system. To be called before stages with large lists of other sizes, while
    /// no unit is at work.
    pub fn trim(&self) {
        self.memory.trim(&self.pool);
    }

    /// The run's threads, for rayon.
    #[must_use]
    pub fn pool(&self) -> Arc<rayon::ThreadPool> {
        self.pool.clone()
    }

    /// Runs `work` with rayon's parallel iterators on the threads of this run.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Does `work` and notes its time, for the report, as the part `name` of the stage.
    pub fn part<T>(&self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let outcome = work();
        self.note_part(name, start.elapsed().as_secs_f64());
        outcome
    }

    /// Notes a part of the stage that took `seconds`.
    pub fn note_part(&self, name: &'static str, seconds: f64) {
        lock(&self.parts).push((name, seconds));
    }

    /// The parts noted since the last call.
    pub fn take_parts(&self) -> Vec<(&'static str, f64)> {
        std::mem::take(&mut *lock(&self.parts))
    }

    /// # Errors
    /// [`Error::Cancelled`] if the run is cancelled, [`Error::TimeLimit`] if its time is up.
    pub fn check_cancel(&self) -> Result<()> {
        self.cancel.check()
    }
}
