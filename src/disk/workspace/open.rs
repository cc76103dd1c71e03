//! Options for opening files, and the error of a failed write.

use crate::error::Error;
use std::fs::{File, OpenOptions};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Options for scratch files: private, never through a symbolic link.
#[must_use]
pub fn options() -> OpenOptions {
    let mut options = File::options();
    options
        .read(true)
        .write(true)
        .mode(0o600)
        .custom_flags(rustix::fs::OFlags::NOFOLLOW.bits().cast_signed());
    options
}

/// Opens an existing scratch file, which must be a regular file.
///
/// # Errors
/// Errors of the system; an error of kind `InvalidInput` for a file that is not regular.
pub fn open_existing(path: &Path) -> std::io::Result<File> {
    // Opening a pipe must not block.
    let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
    let file = options()
        .custom_flags(flags.bits().cast_signed())
        .open(path)?;
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(std::io::Error::new(
            std::io::ErrorKind::InvalidInput,
            "not a regular file",
        ))
    }
}

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
