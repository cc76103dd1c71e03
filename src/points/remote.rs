//! Inputs behind a URL, on a web server or in a store of objects: how they are known, and what they cost.

use serde::{Deserialize, Serialize};
use std::path::Path;

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
