//! The scratch files that are in use, by name.

use super::file::ScratchFile;
use super::lock;
use super::storage::Shared;
use crate::error::Result;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// The scratch files of a workspace.
#[derive(Debug, Clone)]
pub struct Files {
    shared: Arc<Shared>,
    open: Arc<Mutex<HashMap<String, Arc<ScratchFile>>>>,
    pool: Arc<rayon::ThreadPool>,
}

impl Files {
    pub(super) fn new(shared: Arc<Shared>, pool: Arc<rayon::ThreadPool>) -> Self {
        Self {
            shared,
            open: Arc::default(),
            pool,
        }
    }

    /// The file `name`: a new one, or the one in use under this name, or, if it is `kept` for later attempts
    /// at the run, that of earlier ones. It exists until it is released.
    ///
    /// # Errors
    /// [`crate::error::Error::Memory`] if there is no room for the list of its sections.
    pub fn open(&self, name: &str, kept: bool) -> Result<Arc<ScratchFile>> {
        let mut open = lock(&self.open);
        if let Some(file) = open.get(name) {
            return Ok(file.clone());
        }
        let file = Arc::new(ScratchFile::open(name, kept, &self.shared)?);
        open.insert(name.to_owned(), file.clone());
        Ok(file)
    }

    /// Deletes the file `name`, which neither this attempt nor a later one needs any more.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn release(&self, name: &str) -> Result<()> {
        let file = self.open(name, true)?;
        lock(&self.open).remove(name);
        file.delete()
    }

    /// The number of the current thread: that of a worker, or the number after these for all others. Each
    /// writes to segments of its own.
    #[must_use]
    pub fn worker(&self) -> usize {
        let pool = &self.pool;
        pool.current_thread_index()
            .unwrap_or_else(|| pool.current_num_threads())
    }

    /// The worker threads.
    #[must_use]
    pub fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }
}
