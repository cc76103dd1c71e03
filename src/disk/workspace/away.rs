//! The folder of a run that tasks share, as objects of a store: each process has a folder of its own, with copies of
//! what it needs.
//!
//! * An object has the name that its file has in a shared folder. What others look for is put on the condition that no
//!   object has its name, as a shared folder has links.
//! * Journals are fetched whole. Of segments that others made, those parts are fetched that are read; the copies take
//!   no more of the disk than a limit, as far as whole files permit.
//! * What a process makes is in its folder until its journal is published.

mod cache;
mod own;
#[cfg(test)]
mod tests;

pub use super::journal::Traffic;
use super::memory::MemoryPool;
use super::{fault, lock};
use crate::error::{Error, Result};
use cache::Cache;
use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
pub use own::remove_all;
use std::fmt::Debug;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// An object of a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// Its name in the run, such as `tasks/000003/7.done`.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// The time when it was put.
    pub modified: SystemTime,
}

/// The objects of a run. What was put is seen by all that ask afterwards.
pub trait Store: Debug + Send + Sync {
    /// The objects whose names begin with `under`, which is empty or ends with a slash.
    ///
    /// # Errors
    /// Errors of the store.
    fn list(&self, under: &str) -> io::Result<Vec<Stored>>;

    /// An object; none if there is none.
    ///
    /// # Errors
    /// Errors of the store.
    fn look(&self, name: &str) -> io::Result<Option<Stored>>;

    /// The bytes of a range.
    ///
    /// # Errors
    /// [`ErrorKind::NotFound`], [`ErrorKind::UnexpectedEof`]; errors of the store.
    fn read(&self, name: &str, range: Range<u64>) -> io::Result<Vec<u8>>;

    /// Puts the first `bytes` bytes of a file, in place of what has its name. Holds at most [`Store::part`] bytes.
    ///
    /// # Errors
    /// Errors of the store and of the file.
    fn put(&self, name: &str, file: &File, bytes: u64) -> io::Result<()>;

    /// Puts an object unless there is one; false if there is.
    ///
    /// # Errors
    /// Errors of the store.
    fn put_new(&self, name: &str, bytes: Vec<u8>) -> io::Result<bool>;

    /// Deletes an object, if it is there.
    ///
    /// # Errors
    /// Errors of the store.
    fn delete(&self, name: &str) -> io::Result<()>;

    /// Most bytes of memory for a file that is put.
    fn part(&self) -> u64;

    /// Requests so far, and their bytes.
    fn traffic(&self) -> Traffic;
}

/// Objects that are put or deleted at the same time.
const AT_ONCE: usize = 4;

/// Bytes of a whole object that are fetched at a time.
const PIECE: u64 = 4 << 20;

/// Attempts to put what must be new, and the time between them.
const TRIES: u32 = 8;
const PAUSE: Duration = Duration::from_millis(500);

/// Time between two signs of life of a process. Others take it for lost after five minutes.
const BEAT: Duration = Duration::from_secs(60);

/// The objects of a run, and the folder of this process.
#[derive(Debug)]
pub struct Away {
    store: Arc<dyn Store>,
    /// The folder of this process.
    folder: PathBuf,
    cache: Cache,
    beat: Mutex<Option<Beat>>,
    /// Time between two signs of life: [`BEAT`], but in tests.
    every: Duration,
    _own: own::Own,
}

/// A thread that puts a journal again and again, so that others see that its process is alive.
#[derive(Debug)]
struct Beat {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Beat {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Away {
    /// A run in `store`. The folder of this process is made in `parent`, and deleted at the end; copies in it take at
    /// most `limit` bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(store: Arc<dyn Store>, parent: &Path, limit: u64) -> Result<Self> {
        let failed = |e| Error::io(parent, "make a folder in it", e);
        std::fs::create_dir_all(parent).map_err(failed)?;
        own::remove_abandoned(parent);
        let own = own::Own::new(parent).map_err(failed)?;
        let folder = own.folder.clone();
        Ok(Self {
            cache: Cache::new(store.clone(), folder.clone(), limit),
            store,
            folder,
            beat: Mutex::default(),
            every: fault::beat(BEAT),
            _own: own,
        })
    }

    /// The folder of this process.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Requests to the store so far, and their bytes.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.store.traffic()
    }

    /// The name of the object for a file of the folder.
    fn name(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.folder).unwrap_or(path);
        let parts = inside.components().map(|part| part.as_os_str());
        let parts: Vec<_> = parts.map(|part| part.to_string_lossy()).collect();
        parts.join("/")
    }

    fn failed<'a>(&self, path: &'a Path, action: &'static str) -> impl Fn(io::Error) -> Error + 'a {
        move |e| Error::io(path, action, e)
    }

    /// Fills `bytes` from `offset` of a segment that another process made, which has at least `end` bytes.
    ///
    /// # Errors
    /// As [`Store::read`], and errors of files.
    pub fn read(&self, path: &Path, end: u64, bytes: &mut [u8], offset: u64) -> io::Result<()> {
        self.cache.read(&self.name(path), end, bytes, offset)
    }

    /// Fetches the first `end` bytes of a segment that another process made; its file.
    ///
    /// # Errors
    /// As [`Store::read`], and errors of files.
    pub fn bring(&self, path: &Path, end: u64) -> io::Result<()> {
        self.cache.bring(&self.name(path), end)
    }

    /// Forgets the copy of a segment.
    pub fn forget(&self, path: &Path) {
        self.cache.forget(&self.name(path));
    }

    /// True if an object has the name of this file.
    pub(super) fn exists(&self, path: &Path) -> Result<bool> {
        Ok(self.look(path)?.is_some())
    }

    /// The object for this file.
    pub(super) fn look(&self, path: &Path) -> Result<Option<Stored>> {
        let found = self.store.look(&self.name(path));
        found.map_err(self.failed(path, "look at"))
    }

    /// The objects for the files in a folder and below; names are those of the run.
    pub(super) fn list(&self, folder: &Path) -> Result<Vec<Stored>> {
        let under = match self.name(folder) {
            name if name.is_empty() => name,
            name => name + "/",
        };
        let found = self.store.list(&under);
        found.map_err(self.failed(folder, "list"))
    }

    /// Fetches a whole object to its file, in place of a copy; false if there is none.
    pub(super) fn fetch(&self, path: &Path) -> Result<bool> {
        let failed = self.failed(path, "fetch");
        let Some(found) = self.look(path)? else {
            return Ok(false);
        };
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(&failed)?;
        }
        match self.copy(&found, path) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
            done => done.map(|()| true).map_err(failed),
        }
    }

    fn copy(&self, found: &Stored, path: &Path) -> io::Result<()> {
        let _ = std::fs::remove_file(path);
        let file = super::open::options().create_new(true).open(path)?;
        let mut at = 0;
        while at < found.bytes {
            let end = found.bytes.min(at + PIECE);
            let bytes = self.store.read(&found.name, at..end)?;
            outcrop_platform::FileAt::write_all_at(&file, &bytes, at)?;
            at = end;
        }
        file.set_modified(found.modified)
    }

    /// Puts the content of a file, in place of its object.
    pub(super) fn put(&self, path: &Path) -> Result<()> {
        let file = super::open::open_existing(path);
        let put = file.and_then(|file| {
            let bytes = file.metadata()?.len();
            self.store.put(&self.name(path), &file, bytes)
        });
        put.map_err(self.failed(path, "put"))
    }

    /// Puts an empty object in the place of that of a file.
    pub(super) fn empty(&self, path: &Path) -> Result<()> {
        let file = tempfile::tempfile_in(&self.folder);
        let put = file.and_then(|file| self.store.put(&self.name(path), &file, 0));
        put.map_err(self.failed(path, "put"))
    }

    /// Puts the content of the file `from` as the object of the file `to`, unless there is one; false if there is.
    pub(super) fn publish(&self, from: &Path, to: &Path, memory: &MemoryPool) -> Result<bool> {
        let failed = self.failed(to, "put a finished journal as");
        let size = from.metadata().map_err(&failed)?.len();
        let _held = memory.reserve("scratch sent", 2 * size)?;
        let bytes = std::fs::read(from).map_err(&failed)?;
        self.put_new(to, &bytes).map_err(failed)
    }

    /// As [`Store::put_new`]. The answer to a request that did it may have been lost: the object is then the same.
    fn put_new(&self, path: &Path, bytes: &[u8]) -> io::Result<bool> {
        let name = self.name(path);
        let mut failures = 0;
        loop {
            match self.store.put_new(&name, bytes.to_vec()) {
                Ok(true) => return Ok(true),
                Ok(false) => {}
                // The store does not repeat a request that it may have done.
                Err(error) => {
                    failures += 1;
                    if failures == TRIES || is_final(&error) {
                        return Err(error);
                    }
                }
            }
            match self.store.look(&name)? {
                // The request was not done; or the object was deleted meanwhile, or a store is not sure yet which of
                // several requests was the first.
                None => std::thread::sleep(PAUSE),
                Some(found)
                    if found.bytes != bytes.len() as u64
                        || bytes.len() <= super::journal::MAGIC.len() =>
                {
                    return Ok(false);
                }
                Some(found) => return Ok(self.store.read(&name, 0..found.bytes)? == bytes),
            }
        }
    }

    /// Puts a new object in the place of a file; false if there is one.
    pub(super) fn put_as_new(&self, path: &Path, bytes: &[u8]) -> Result<bool> {
        self.put_new(path, bytes).map_err(self.failed(path, "put"))
    }

    /// Claims the name of a new journal; false if another process has it. From then on there are signs of life.
    pub(super) fn claim(self: &Arc<Self>, path: &Path) -> Result<bool> {
        let bytes = std::fs::read(path).map_err(self.failed(path, "read"))?;
        let new = self.put_as_new(path, &bytes)?;
        if new {
            *lock(&self.beat) = self.begin_beat(self.name(path), bytes);
        }
        Ok(new)
    }

    fn begin_beat(&self, name: String, bytes: Vec<u8>) -> Option<Beat> {
        let (stop, stopped) = bounded::<()>(0);
        let (store, every) = (self.store.clone(), self.every);
        let mut file = tempfile::tempfile_in(&self.folder).ok()?;
        io::Write::write_all(&mut file, &bytes).ok()?;
        let thread = std::thread::Builder::new().name("outcrop-beat".into());
        let thread = thread.spawn(move || {
            while stopped.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                // A sign that does not arrive makes others look twice, not more.
                let _ = store.put(&name, &file, bytes.len() as u64);
            }
        });
        Some(Beat {
            stop: Some(stop),
            thread: Some(thread.ok()?),
        })
    }

    /// Ends the signs of life.
    pub(super) fn end_beat(&self) {
        *lock(&self.beat) = None;
    }

    /// Puts files, some at a time.
    pub(super) fn put_all(&self, paths: &[PathBuf], memory: &MemoryPool) -> Result<()> {
        let bytes = AT_ONCE.min(paths.len()) as u64 * self.store.part();
        let _held = memory.reserve("scratch sent", bytes)?;
        let put = |path: &PathBuf| match path.exists() {
            true => self.put(path),
            // This process has deleted it.
            false => Ok(()),
        };
        side_by_side(paths, put)
    }

    /// Deletes the objects of these names, as far as they can be deleted.
    pub(super) fn delete_all(&self, names: &[String]) {
        let delete = |name: &String| {
            let _ = self.store.delete(name);
            Ok(())
        };
        let _ = side_by_side(names, delete);
    }

    /// Deletes the objects of these files, as far as they can be deleted.
    pub(super) fn delete(&self, paths: &[PathBuf]) {
        let names: Vec<String> = paths.iter().map(|path| self.name(path)).collect();
        self.delete_all(&names);
    }
}

/// True for an error that comes again.
fn is_final(error: &io::Error) -> bool {
    use ErrorKind::{InvalidInput, NotFound, PermissionDenied, Unsupported};
    matches!(
        error.kind(),
        InvalidInput | NotFound | PermissionDenied | Unsupported
    )
}

/// Does work for each of these, some at a time; the first error ends it.
fn side_by_side<T: Sync>(all: &[T], work: impl Fn(&T) -> Result<()> + Sync) -> Result<()> {
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(all.len()) {
            scope.spawn(|| {
                while lock(&failed).is_none()
                    && let Some(one) = all.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    if let Err(error) = work(one) {
                        lock(&failed).get_or_insert(error);
                    }
                }
            });
        }
    });
    let failed = failed.into_inner();
    failed
        .unwrap_or_else(std::sync::PoisonError::into_inner)
        .map_or(Ok(()), Err)
}
