//! Outputs behind a URL. A run writes its files on this machine, in a folder beside its scratch files; when all are
//! finished, they are sent to the store. The other way, to send the mesh while it is written, would not do: its parts
//! are written in any order, some formats know their header last, and a resumed run reads what it wrote.

#[cfg(feature = "cloud")]
mod noted;
#[cfg(feature = "cloud")]
mod send;
#[cfg_attr(not(feature = "cloud"), path = "deliver/without.rs")]
mod there;
#[cfg(feature = "cloud")]
mod uploads;

use outcrop_points::is_remote;
use serde::{Deserialize, Serialize};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
pub(crate) use there::{Delivery, check_text, put_text};

/// The kinds of outputs behind a URL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A mesh, and what lies beside it.
    Mesh,
    /// A folder with a tileset.
    #[cfg(any(feature = "cloud", feature = "levels"))]
    Folder,
}

/// Name of the file of a tileset with the tree.
pub(crate) const TREE: &str = "tileset.json";

/// Counts of an output that was sent to a store.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Uploaded {
    /// Number of files.
    pub files: u64,
    /// Bytes of all files.
    pub bytes: u64,
    /// Number of requests to the store, of the attempt that sent the last file.
    pub requests: u64,
}

/// The ending of the name of a scratch folder.
pub(crate) const SCRATCH: &str = ".outcrop-scratch";

/// The name of a scratch folder in one that may have those of several outputs of this `name`: `output` tells them apart.
pub(crate) fn scratch_name(name: &OsStr, output: &Path) -> OsString {
    let crc = crc32fast::hash(&outcrop_platform::path_bytes(output));
    let mut name = name.to_os_string();
    name.push(format!("-{crc:08x}{SCRATCH}"));
    name
}

/// The scratch folder of a run whose output is behind a URL, in `parent` or here; none for a path. Outputs of one name
/// have several.
pub(crate) fn scratch_of(output: &Path, parent: Option<&Path>) -> Option<PathBuf> {
    if !is_remote(output) {
        return None;
    }
    let text = output.to_string_lossy();
    let mut names = text.trim_end_matches('/').rsplit('/');
    let name = match names.next() {
        Some(TREE) => names.next(),
        name => name,
    };
    let name = scratch_name(name.unwrap_or_default().as_ref(), output);
    Some(parent.map_or_else(|| PathBuf::from(&name), |parent| parent.join(&name)))
}
