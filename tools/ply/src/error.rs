//! The error type.

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
        /// Place in the file: a line of the header, or an entry of an element.
        place: String,
        /// The content found, in printable characters.
        found: String,
        /// The expected content.
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
