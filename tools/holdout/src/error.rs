//! The error type.

use std::path::{Path, PathBuf};

/// Result with this program's [`Error`].
pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;

/// The errors of this program.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// A file cannot be read or written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        path: PathBuf,
        action: &'static str,
        source: std::io::Error,
    },
    /// A file is invalid.
    #[error("{path}: {what}", path = path.display())]
    Input { path: PathBuf, what: String },
    /// A setting is out of range.
    #[error("{name}: {found} is not valid, expected {expected}")]
    Parameter {
        name: &'static str,
        found: String,
        expected: &'static str,
    },
    /// An error of the library.
    #[error(transparent)]
    Outcrop(#[from] outcrop::Error),
}

impl Error {
    pub(crate) fn io(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            action,
            source,
        }
    }

    pub(crate) fn input(path: impl AsRef<Path>, what: impl Into<String>) -> Self {
        Error::Input {
            path: path.as_ref().to_path_buf(),
            what: what.into(),
        }
    }
}
