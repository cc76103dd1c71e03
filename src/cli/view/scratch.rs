//! The folder of what is deleted when the looking ends.

use outcrop_disk::error::{Error, Result};
use std::fs::File;
use std::path::Path;

/// A folder for what is deleted at the end.
pub struct Scratch {
    /// Locked as long as the program runs, even if it is killed; closed before the folder is deleted.
    _lock: File,
    folder: tempfile::TempDir,
}

impl Scratch {
    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// How folders for what is deleted at the end are called.
const PREFIX: &str = "outcrop-view-";

/// The file in such a folder that is locked.
const LOCK: &str = "lock";

/// A folder for what is deleted at the end: here, or where temporary files go if nothing can be written here. Those
/// that programs left there which were killed are deleted.
pub fn scratch(place: &Path) -> Result<Scratch> {
    let make = |place: &Path| {
        remove_stale(place);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(place)?;
        let lock = File::create_new(folder.path().join(LOCK))?;
        lock.lock()?;
        Ok(Scratch {
            folder,
            _lock: lock,
        })
    };
    make(place)
        .or_else(|_| make(&std::env::temp_dir()))
        .map_err(|e| Error::io(place, "make a folder", e))
}

/// Deletes the folders of programs that do not run any more. One without a lock file may just have been made.
fn remove_stale(place: &Path) {
    let entries = std::fs::read_dir(place).into_iter().flatten().flatten();
    for entry in entries.filter(|e| e.file_name().to_string_lossy().starts_with(PREFIX)) {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let lock = File::open(entry.path().join(LOCK));
        if is_folder && lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
            // It does no harm if it cannot be deleted.
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_programs_that_were_killed_are_deleted() {
        let place = tempfile::tempdir().unwrap();
        let folder = |name: &str| {
            let folder = place.path().join(name);
            std::fs::create_dir_all(folder.join("tiles")).unwrap();
            folder
        };
        let (stale, young, other) = (
            folder("outcrop-view-stale"),
            folder("outcrop-view-young"),
            folder("other"),
        );
        for folder in [&stale, &other] {
            std::fs::write(folder.join(LOCK), "").unwrap();
        }
        let first = scratch(place.path()).unwrap();
        assert!(!stale.exists() && young.exists() && other.exists());
        let second = scratch(place.path()).unwrap();
        assert!(first.folder.path().exists() && second.folder.path().exists());
        // As after a kill: the folder stays, its lock does not.
        let left = first.folder.keep();
        drop(first._lock);
        let third = scratch(place.path()).unwrap();
        assert!(!left.exists() && second.folder.path().exists());
        drop((second, third));
        let mut names: Vec<_> = std::fs::read_dir(place.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["other", "outcrop-view-young"]);
    }
}
