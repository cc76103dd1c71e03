//! The error type.

/// Result with this program's [`Error`].
pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The table could not be written.
    #[error("standard output: cannot write: {0}")]
    Output(#[from] std::io::Error),
    /// The generator says no.
    #[error(transparent)]
    Cloud(#[from] outcrop_cloudgen::Error),
    /// The library says no.
    #[error(transparent)]
    Outcrop(#[from] outcrop::Error),
}
