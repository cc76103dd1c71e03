//! The files in a scratch folder.

use super::journal;
use crate::error::{Error, Result};
use std::path::Path;

pub(super) const LOCK: &str = "lock";
pub(super) const MANIFEST: &str = "manifest";

/// Files of the folder that are not data.
pub(super) const OURS: [&str; 3] = [LOCK, MANIFEST, journal::NAME];

/// True if a file of this name is not data.
pub(super) fn is_ours(name: &str) -> bool {
    OURS.contains(&name) || journal::worker(name).is_some()
}

/// Names of the data files in the folder.
pub(super) fn data(path: &Path) -> Result<Vec<String>> {
    let mut names = listing(path)?;
    names.retain(|name| !is_ours(name));
    Ok(names)
}

/// Names of all files in the folder.
pub(super) fn listing(path: &Path) -> Result<Vec<String>> {
    let io = |e| Error::io(path, "list", e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io)? {
        let entry = entry.map_err(io)?;
        // A name that is not UTF-8 is not one of this program's.
        names.extend(entry.file_name().into_string());
    }
    Ok(names)
}
