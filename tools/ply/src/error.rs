//! The error type.

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a file was not read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read it.
    #[error("cannot read: {0}")]
    Io(#[from] std::io::Error),
    /// It is no PLY file, or not one of the kind that was asked for.
    #[error("{place}: found {found}, expected {expected}")]
    Input {
        /// Where in the file: a line of the header, or an entry of an element.
        place: String,
        /// What is there, in printable characters.
        found: String,
        /// What would have been right.
        expected: String,
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
