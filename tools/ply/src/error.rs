//! The error types.

use std::path::{Path, PathBuf};

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// The errors of reading a file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file cannot be read.
    #[error("cannot read: {0}")]
    Io(#[from] std::io::Error),
    /// It is no PLY file, or lacks the required elements.
    #[error("{place}: found {found}, expected {expected}")]
    Input {
        /// Place in the file: a line of the header, an entry of an element, or a byte offset.
        place: String,
        /// The content found, in printable characters.
        found: String,
        /// The expected content.
        expected: String,
    },
}

/// The errors of a file with a name.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The file cannot be read.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The failed action, e.g. `open`.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Its content is wrong.
    #[error("{path}: {source}", path = path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The place and the content.
        source: Error,
    },
}

impl Error {
    pub(crate) fn input(
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self::Input {
            place: place.into(),
            found: found.into(),
            expected: expected.into(),
        }
    }
}

impl FileError {
    pub(crate) fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        let path = path.to_path_buf();
        Self::Io {
            path,
            action,
            source,
        }
    }
}
