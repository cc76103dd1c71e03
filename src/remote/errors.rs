//! Errors of stores as those of local files.

use object_store::Error;
use std::error::Error as _;
use std::io::{self, ErrorKind};

/// The error of a file that is another one than when it was opened.
pub(crate) fn changed() -> io::Error {
    io::Error::new(
        ErrorKind::InvalidData,
        "the file has changed on the server since it was opened",
    )
}

/// The error of a file that is newer than the run that reads it.
pub(crate) fn newer() -> io::Error {
    io::Error::new(
        ErrorKind::InvalidData,
        "the file has changed on the server since the run began",
    )
}

/// An error of a store in one line, of the kind that a local file would give.
pub(crate) fn told(error: Error) -> io::Error {
    let kind = match &error {
        Error::NotFound { .. } => ErrorKind::NotFound,
        Error::PermissionDenied { .. } | Error::Unauthenticated { .. } => {
            ErrorKind::PermissionDenied
        }
        Error::AlreadyExists { .. } => ErrorKind::AlreadyExists,
        Error::Precondition { .. } => return changed(),
        Error::NotSupported { .. } | Error::NotImplemented { .. } => ErrorKind::Unsupported,
        // An empty file has no range.
        e if e.to_string().contains("416 Range Not Satisfiable") => ErrorKind::Unsupported,
        _ => ErrorKind::Other,
    };
    // The innermost reasons say what happened; the outer ones repeat each other.
    let mut reasons = vec![error.to_string()];
    let mut inner = error.source();
    while let Some(reason) = inner {
        reasons.push(reason.to_string());
        inner = reason.source();
    }
    let last = reasons.pop().unwrap_or_default();
    let status = reasons.iter().find_map(|text| status_in(text));
    let text = match status {
        Some(status) if !last.contains(&status) => format!("{status}: {last}"),
        _ => last,
    };
    let line: Vec<&str> = text.split_whitespace().collect();
    io::Error::new(kind, line.join(" "))
}

/// The status of HTTP in a message, such as `503 Service Unavailable`.
fn status_in(text: &str) -> Option<String> {
    let (_, after) = text
        .split_once("status code: ")
        .or(text.split_once("status "))?;
    let end = after.find([':', ',']).unwrap_or(after.len());
    Some(after[..end].trim().to_owned())
}
