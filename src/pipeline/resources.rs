//! Resources of runs of all kinds, and the methods that set them.

use super::{Start, default_memory, default_threads};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Observer, Silent};
use outcrop_disk::workspace::{Storage, Workspace};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Resources of a run; all have defaults.
#[derive(Clone)]
pub(super) struct Resources {
    pub scratch: Option<PathBuf>,
    pub memory: Option<u64>,
    pub threads: Option<usize>,
    pub observer: Arc<dyn Observer>,
    pub cancel: Cancel,
    pub storage: Storage,
    pub start: Start,
}

impl Default for Resources {
    fn default() -> Self {
        Self {
            scratch: None,
            memory: None,
            threads: None,
            observer: Arc::new(Silent),
            cancel: Cancel::new(),
            storage: Storage::default(),
            start: Start::New,
        }
    }
}

impl Resources {
    /// The memory budget in bytes.
    pub fn memory(&self) -> u64 {
        self.memory.unwrap_or_else(default_memory)
    }

    /// The number of worker threads.
    pub fn threads(&self) -> usize {
        self.threads.unwrap_or_else(default_threads)
    }

    /// A workspace of a run that cannot be resumed.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Memory`].
    pub fn workspace(&self) -> Result<Workspace> {
        let places = (self.scratch.as_deref(), self.storage);
        let sizes = (self.memory(), self.threads());
        temporary(places, sizes, (self.observer.clone(), self.cancel.clone()))
    }
}

/// A workspace of a run that cannot be resumed: in a scratch folder, by default the system's for temporary files, with
/// bytes of memory and threads.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Memory`].
pub(crate) fn temporary(
    (scratch, storage): (Option<&Path>, Storage),
    (memory, threads): (u64, usize),
    (observer, cancel): (Arc<dyn Observer>, Cancel),
) -> Result<Workspace> {
    let memory = MemoryPool::new(memory)?;
    let beside = std::env::temp_dir();
    let workspace = Workspace::new(
        scratch.unwrap_or(&beside),
        memory,
        threads,
        observer,
        cancel,
    )?;
    workspace.set_storage(storage)?;
    Ok(workspace)
}

/// The methods of a builder with the field `resources`.
macro_rules! resource_setters {
    () => {
        /// Folder for scratch files; default: beside the output.
        #[must_use]
        pub fn scratch(mut self, path: impl Into<PathBuf>) -> Self {
            self.resources.scratch = Some(path.into());
            self
        }

        /// Memory budget in bytes; default: half of what machine and cgroup allow.
        #[must_use]
        pub fn memory(mut self, bytes: u64) -> Self {
            self.resources.memory = Some(bytes);
            self
        }

        /// Worker threads; default: all available.
        #[must_use]
        pub fn threads(mut self, threads: usize) -> Self {
            self.resources.threads = Some(threads);
            self
        }

        /// Receiver of progress.
        #[must_use]
        pub fn observer(mut self, observer: Arc<dyn Observer>) -> Self {
            self.resources.observer = observer;
            self
        }

        /// The flag that stops the run.
        #[must_use]
        pub fn cancel(mut self, cancel: Cancel) -> Self {
            self.resources.cancel = cancel;
            self
        }

        /// How scratch files are read and written; does not change the result.
        #[must_use]
        pub fn storage(mut self, storage: Storage) -> Self {
            self.resources.storage = storage;
            self
        }

        /// Treatment of an unfinished run with the same output and scratch folder; default: an error.
        #[must_use]
        pub fn start(mut self, start: Start) -> Self {
            self.resources.start = start;
            self
        }
    };
}
pub(super) use resource_setters;
