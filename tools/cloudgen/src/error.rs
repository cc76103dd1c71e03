//! The error type.

use std::path::{Path, PathBuf};

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// The errors of making or writing a cloud.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting is out of range.
    #[error("{name}: {found} is not valid, expected {expected}")]
    Parameter {
        /// Name of the setting.
        name: &'static str,
        /// The given value.
        found: String,
        /// The accepted values.
        expected: String,
    },
    /// Two settings exclude each other.
    #[error("{first} cannot be combined with {second}: {why}")]
    Conflict {
        /// One setting.
        first: &'static str,
        /// The other.
        second: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// The output format is neither given nor recognisable.
    #[error("{path}: no format given, and none known by that file name; use .las, .laz, .ply or .xyz", path = path.display())]
    UnknownFormat {
        /// The output file.
        path: PathBuf,
    },
    /// A file cannot be written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// The output file.
        path: PathBuf,
        /// The failed action.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The reference mesh cannot be used.
    #[error("{path}: cannot use the mesh: {what}", path = path.display())]
    Mesh {
        /// The mesh file.
        path: PathBuf,
        /// The reason.
        what: String,
    },
    /// The cloud cannot be expressed in LAS.
    #[error("{path}: cannot write LAS: {source}", path = path.display())]
    Las {
        /// The output file.
        path: PathBuf,
        /// The error of the LAS writer.
        source: las::Error,
    },
}

impl Error {
    pub(crate) fn parameter(
        name: &'static str,
        found: impl std::fmt::Display,
        expected: impl Into<String>,
    ) -> Self {
        Error::Parameter {
            name,
            found: found.to_string(),
            expected: expected.into(),
        }
    }

    pub(crate) fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Error::Io {
            path: path.to_path_buf(),
            action,
            source,
        }
    }

    pub(crate) fn mesh(path: &Path, what: impl Into<String>) -> Self {
        Error::Mesh {
            path: path.to_path_buf(),
            what: what.into(),
        }
    }

    pub(crate) fn las(path: &Path, source: las::Error) -> Self {
        match source {
            las::Error::Io(source) => Error::io(path, "write", source),
            source => Error::Las {
                path: path.to_path_buf(),
                source,
            },
        }
    }
}
