//! Options for opening files, and the error of a failed write.

use crate::error::Error;
pub use outcrop_platform::{open_regular as open_existing, private_options as options};
use std::path::Path;

/// The error of a failed write of `bytes`, if the run needs `more` bytes besides.
#[must_use]
pub fn failed_write(path: &Path, bytes: usize, more: u64, error: std::io::Error) -> Error {
    use std::io::ErrorKind::{QuotaExceeded, StorageFull};
    if matches!(error.kind(), StorageFull | QuotaExceeded) {
        return Error::Disk {
            path: path.to_path_buf(),
            needed: more.max(bytes as u64),
            free: super::limits::disk_free(path).unwrap_or(0),
        };
    }
    Error::io(path, format!("write {bytes} bytes"), error)
}
