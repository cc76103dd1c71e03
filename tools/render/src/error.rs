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
    /// The input is not a PLY file that can be drawn.
    #[error("{path}: {source}", path = path.display())]
    Ply {
        path: PathBuf,
        source: outcrop_ply::Error,
    },
    /// A setting is out of range.
    #[error("{name}: {found} is not valid, expected {expected}")]
    Parameter {
        name: &'static str,
        found: String,
        expected: &'static str,
    },
}

impl Error {
    pub(crate) fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Error::Io {
            path: path.to_path_buf(),
            action,
            source,
        }
    }

    pub(crate) fn ply(path: &Path, source: outcrop_ply::Error) -> Self {
        Error::Ply {
            path: path.to_path_buf(),
            source,
        }
    }

    pub(crate) fn parameter(
        name: &'static str,
        found: impl std::fmt::Display,
        expected: &'static str,
    ) -> Self {
        Error::Parameter {
            name,
            found: found.to_string(),
            expected,
        }
    }
}
