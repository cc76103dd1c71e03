//! Inputs behind a URL, on a web server or in a store of objects.

#[cfg_attr(not(feature = "cloud"), path = "remote/without.rs")]
mod there;

pub(super) use outcrop_points::{Fetched, is_remote};
use serde::{Deserialize, Serialize};
use std::path::Path;
pub(super) use there::{Beside, Expected, Remote, below};

/// What tells one version of a remote file from another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// Size in bytes.
    pub bytes: u64,
    /// The entity tag, if the server says one.
    pub tag: Option<String>,
    /// Seconds since 1970 and nanoseconds of the last change.
    pub modified: (i64, u32),
}

/// The version of a remote file.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`] if it cannot be read, [`outcrop_disk::error::Error::Input`] for a URL that
/// names none.
pub fn version(path: &Path) -> outcrop_disk::error::Result<Version> {
    Ok(Remote::open(path)?.version())
}
