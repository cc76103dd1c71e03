//! Inputs behind a URL, on a web server or in a store of objects.

#[cfg_attr(not(feature = "cloud"), path = "remote/without.rs")]
mod there;

use serde::{Deserialize, Serialize};
use std::path::Path;
pub(super) use there::{Beside, Expected, Remote, below};

/// The schemes of URLs that are read.
const SCHEMES: [&str; 9] = [
    "http", "https", "s3", "s3a", "gs", "az", "azure", "abfs", "abfss",
];

/// True if a path is a URL of a remote file.
#[must_use]
pub fn is_remote(path: &Path) -> bool {
    let scheme = path.to_str().and_then(|text| text.split_once("://"));
    scheme.is_some_and(|(scheme, _)| SCHEMES.contains(&&*scheme.to_ascii_lowercase()))
}

/// What was asked of a server.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fetched {
    /// Requests, with those that failed.
    pub requests: u64,
    /// Bytes of the answers.
    pub bytes: u64,
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_told_from_paths() {
        for url in ["https://a/b.laz", "S3://bucket/x/", "az://c/d", "gs://b"] {
            assert!(is_remote(Path::new(url)), "{url}");
        }
        for path in ["a/b.laz", "C:\\a", "https:/a", "file:///a", "odd://a", ""] {
            assert!(!is_remote(Path::new(path)), "{path}");
        }
    }
}
