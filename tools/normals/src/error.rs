//! The error type.

/// Result with this program's [`Error`].
pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;

/// The errors of this program.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The table cannot be written.
    #[error("standard output: cannot write: {0}")]
    Output(#[from] std::io::Error),
    /// An error of the generator.
    #[error(transparent)]
    Cloud(#[from] outcrop_cloudgen::Error),
    /// An error of the library.
    #[error(transparent)]
    Outcrop(#[from] outcrop::Error),
}
