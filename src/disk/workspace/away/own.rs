//! The folders in which processes have their copies. A process locks its folder, so that others tell the folders of
//! those that were killed.

use super::super::lock;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Beginning of the names of folders.
const PREFIX: &str = "outcrop-copies-";

/// Names in it: of the file that is locked, before and after, and of the folder for copies.
const NEW: &str = "new";
const LOCK: &str = "lock";
const COPIES: &str = "run";

/// The folders of this process.
static ALL: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The folder of a process, which is deleted at the end.
#[derive(Debug)]
pub(super) struct Own {
    /// The folder for copies.
    pub folder: PathBuf,
    whole: PathBuf,
    lock: Option<File>,
}

impl Own {
    /// A new folder in `parent`.
    pub fn new(parent: &Path) -> io::Result<Self> {
        let new = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        let locked = File::create_new(new.path().join(NEW))?;
        // Where there are no locks, the folder of a killed process stays.
        let _ = locked.try_lock();
        outcrop_platform::make_private_folder(&new.path().join(COPIES))?;
        std::fs::rename(new.path().join(NEW), new.path().join(LOCK))?;
        let whole = new.keep();
        lock(&ALL).push(whole.clone());
        Ok(Self {
            folder: whole.join(COPIES),
            whole,
            lock: Some(locked),
        })
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        lock(&ALL).retain(|path| *path != self.whole);
        // Windows keeps the name of a file that is open.
        drop(self.lock.take());
        let _ = std::fs::remove_dir_all(&self.whole);
    }
}

/// Deletes all folders of this process, which ends at once.
pub fn remove_all() {
    for path in std::mem::take(&mut *lock(&ALL)) {
        let _ = std::fs::remove_dir_all(path);
    }
}

/// Deletes the folders in `parent` of processes that were killed.
pub(super) fn remove_abandoned(parent: &Path) {
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_str().is_some_and(|name| name.starts_with(PREFIX)) {
            let locked = File::open(entry.path().join(LOCK));
            // It is closed before it is deleted: Windows keeps the name of a file that is open.
            if locked.is_ok_and(|locked| locked.try_lock().is_ok()) {
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
    }
}
