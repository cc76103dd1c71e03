//! The one error type of the library. Every variant says what was found and what would have worked.

use std::path::{Path, PathBuf};

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can end a run early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused to read or write a file.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// File or folder concerned.
        path: PathBuf,
        /// What was being done, e.g. `open` or `write 65536 bytes`.
        action: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// An input file is not what it claims to be.
    #[error("{path}: {place}: found {found}, expected {expected}", path = path.display())]
    Input {
        /// The input file.
        path: PathBuf,
        /// Where in it: a byte offset, line, header field or chunk.
        place: String,
        /// What is there.
        found: String,
        /// What would have been right.
        expected: String,
    },
    /// The cloud has too few distinct points, or none, to carry a triangle.
    #[error(
        "cannot build a surface: {found}; at least three distinct points that are not on one line are needed"
    )]
    Degenerate {
        /// What the cloud consists of.
        found: String,
    },
    /// All cells were computed and no triangle came of it.
    #[error("the cloud yields no triangle: {why}")]
    NoTriangles {
        /// The reason, with what to change.
        why: String,
    },
    /// A parameter is out of range.
    #[error("{name}: {found} is not valid, expected {expected}")]
    Parameter {
        /// Name as on the command line.
        name: &'static str,
        /// The value given.
        found: String,
        /// The accepted range.
        expected: String,
    },
    /// The memory budget cannot work.
    #[error("memory budget of {budget} bytes is too small: {what} needs {needed} bytes ({needed_mib} MiB); give at least --memory {needed_mib}MiB", needed_mib = needed.div_ceil(1 << 20))]
    Memory {
        /// What asked for memory, with the current holders.
        what: String,
        /// The budget that would do, in bytes.
        needed: u64,
        /// The budget given, in bytes.
        budget: u64,
    },
    /// The scratch folder's file system is too small.
    #[error("{path}: not enough space: {needed} bytes are needed, {free} are free", path = path.display())]
    Disk {
        /// Scratch or output folder.
        path: PathBuf,
        /// Bytes the run needs there.
        needed: u64,
        /// Bytes free.
        free: u64,
    },
    /// A scratch file does not hold what was written to it.
    #[error("{path}: scratch file damaged at byte {offset}: found {found}, expected {expected}", path = path.display())]
    Corrupt {
        /// The scratch file.
        path: PathBuf,
        /// Byte offset of the damaged part.
        offset: u64,
        /// What was found there.
        found: String,
        /// What was written.
        expected: String,
    },
    /// More distinct points than ids.
    #[error("{found} distinct points are more than the {limit} that 32-bit ids can name")]
    TooManyPoints {
        /// Points found.
        found: u64,
        /// Largest number supported.
        limit: u64,
    },
    /// The run was asked to stop.
    #[error("stopped on request")]
    Cancelled,
}

impl Error {
    /// An [`Error::Io`] for `path`; `action` completes "cannot ...".
    pub fn io(path: impl AsRef<Path>, action: impl Into<String>, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            action: action.into(),
            source,
        }
    }

    /// An [`Error::Input`] for a file that cannot be read as what it is.
    pub fn input(
        path: impl AsRef<Path>,
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Error::Input {
            path: path.as_ref().to_path_buf(),
            place: place.into(),
            found: found.into(),
            expected: expected.into(),
        }
    }
}
