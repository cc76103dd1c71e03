//! Errors of the reader of PLY, with those of whoever takes what it reads.

use outcrop_disk::error::Error;
use outcrop_ply::FileError;

/// An error as the reader returns it: its own, or that of a sink.
pub(crate) struct Failure(Error);

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        Self(match error {
            FileError::Io {
                path,
                action,
                source,
            } => Error::io(path, action, source),
            FileError::Content { path, source } => Error::ply(&path, source),
        })
    }
}

/// The error, with its file.
pub(crate) fn converted(error: impl Into<Failure>) -> Error {
    error.into().0
}
