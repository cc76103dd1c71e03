//! Scratch files in a store: how their places are named, and where a process has its copies.

use outcrop_points::is_remote;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Most bytes of the copies that a process keeps of scratch files in a store: a task of a cloud of 1 G points in 200
/// shards reads less.
const COPIES: u64 = 4 << 30;

/// Where a process has its copies of scratch files, if these are in a store.
#[derive(Debug, Clone)]
pub(crate) struct Copies {
    /// The folder in which that of the copies is made.
    pub folder: PathBuf,
    /// Most bytes of the copies.
    pub limit: u64,
}

impl Copies {
    /// In this folder, of at most so many bytes; by default as usual.
    #[must_use]
    pub fn new(folder: Option<PathBuf>, limit: Option<u64>) -> Self {
        let usual = Self::default();
        Self {
            folder: folder.unwrap_or(usual.folder),
            limit: limit.unwrap_or(usual.limit),
        }
    }
}

impl Default for Copies {
    fn default() -> Self {
        Self {
            folder: std::env::temp_dir(),
            limit: COPIES,
        }
    }
}

/// True if a path is a URL, which names no folder.
pub(crate) fn is_store(path: &Path) -> bool {
    is_remote(path)
}

/// What is in a folder of a store, on any system.
pub(crate) fn below(folder: &Path, name: &OsStr) -> PathBuf {
    let mut path = folder.as_os_str().to_owned();
    if !folder.to_string_lossy().ends_with('/') {
        path.push("/");
    }
    path.push(name);
    path.into()
}
