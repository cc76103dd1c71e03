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
    /// A file system is too small, or full.
    #[error("{path}: not enough space: {needed} more bytes ({mib} MiB) are needed, {free} are free", path = path.display(), mib = needed.div_ceil(1 << 20))]
    Disk {
        /// Scratch or output folder, or the file that could not be written.
        path: PathBuf,
        /// Bytes the run needs there, beside those it has.
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
    /// Another run is at work in the scratch folder.
    #[error("{path}: another run is at work here; wait for it, or choose another --scratch", path = path.display())]
    Locked {
        /// The scratch folder.
        path: PathBuf,
    },
    /// There is an unfinished run already.
    #[error("{path}: an unfinished run is here already; --resume goes on with it, --restart begins again", path = path.display())]
    Unfinished {
        /// The scratch folder.
        path: PathBuf,
    },
    /// The unfinished run is not the one that was asked for.
    #[error("{path}: cannot go on: {what} was {was}, now it is {now}; --restart begins again", path = path.display())]
    Mismatch {
        /// The scratch folder.
        path: PathBuf,
        /// What changed.
        what: String,
        /// As the run began.
        was: String,
        /// As it is now.
        now: String,
    },
    /// The folder holds no run that could be resumed.
    #[error("{path}: {why}", path = path.display())]
    NotResumable {
        /// The folder.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The time that the run was given is up.
    #[error("stopped: the time limit is reached")]
    TimeLimit,
    /// The run was asked to stop.
    #[error("stopped on request")]
    Cancelled,
}

impl Error {
    /// True if a run that ended so can go on from where it was, once the reason is gone.
    #[must_use]
    pub fn can_resume(&self) -> bool {
        match self {
            Error::Io { .. }
            | Error::Memory { .. }
            | Error::Disk { .. }
            | Error::Corrupt { .. }
            | Error::TimeLimit
            | Error::Cancelled => true,
            Error::Input { .. }
            | Error::Degenerate { .. }
            | Error::NoTriangles { .. }
            | Error::Parameter { .. }
            | Error::TooManyPoints { .. }
            | Error::Locked { .. }
            | Error::Unfinished { .. }
            | Error::Mismatch { .. }
            | Error::NotResumable { .. } => false,
        }
    }

    /// An [`Error::Io`] for `path`; `action` completes "cannot ...".
    pub fn io(path: impl AsRef<Path>, action: impl Into<String>, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            action: action.into(),
            source,
        }
    }

    /// What is wrong with a PLY file.
    pub(crate) fn ply(path: &Path, error: outcrop_ply::Error) -> Self {
        match error {
            outcrop_ply::Error::Io(source) => Self::io(path, "read", source),
            outcrop_ply::Error::Input {
                place,
                found,
                expected,
            } => Self::input(path, place, found, expected),
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
