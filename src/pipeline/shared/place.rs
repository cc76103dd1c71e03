//! The place of a run that tasks share: a folder that all of them see, or the objects below a prefix of a store.

#[cfg_attr(not(feature = "cloud"), path = "place/without.rs")]
mod store;

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::away::Away;
use outcrop_disk::workspace::generations::SharedFolder;
use outcrop_disk::workspace::journal::Sharing;
use outcrop_points::is_remote;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
pub(super) use store::names;

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

fn away(url: &Path, copies: &Copies) -> Result<Away> {
    Away::new(store::open(url)?, &copies.folder, copies.limit).map_err(|e| told(e, url, None))
}

/// Makes the folder of a new run.
pub(super) fn create(path: &Path, manifest: Vec<u8>, sharing: Sharing) -> Result<()> {
    if !is_store(path) {
        return SharedFolder::create(path, manifest, sharing).map(drop);
    }
    let away = away(path, &Copies::default())?;
    let folder = away.folder().to_path_buf();
    SharedFolder::create_away(away, path, manifest, sharing)
        .map(drop)
        .map_err(|e| told(e, path, Some(&folder)))
}

/// Opens a run.
pub(super) fn open(path: &Path, copies: &Copies) -> Result<SharedFolder> {
    if !is_store(path) {
        return SharedFolder::open(path);
    }
    let away = away(path, copies)?;
    let folder = away.folder().to_path_buf();
    SharedFolder::open_away(away, path).map_err(|e| told(e, path, Some(&folder)))
}

/// True if a run is there.
pub(super) fn is_at(path: &Path) -> Result<bool> {
    if !is_store(path) {
        return Ok(SharedFolder::is_at(path));
    }
    let away = away(path, &Copies::default())?;
    let folder = away.folder().to_path_buf();
    SharedFolder::is_away(&away).map_err(|e| told(e, path, Some(&folder)))
}

/// An error of a run in a store, with the URLs of files of which a process has copies in `folder`.
pub(super) fn told(mut error: Error, url: &Path, folder: Option<&Path>) -> Error {
    let Some(folder) = folder.filter(|_| is_store(url)) else {
        return error;
    };
    let path = match &mut error {
        // A disk of this machine.
        Error::Io { source, .. } if source.raw_os_error().is_some() => return error,
        Error::Io { path, .. } | Error::Corrupt { path, .. } | Error::NotResumable { path, .. } => {
            path
        }
        _ => return error,
    };
    if let Ok(inside) = path.strip_prefix(folder) {
        *path = match inside.as_os_str().is_empty() {
            true => url.to_path_buf(),
            false => below(url, inside.as_os_str()),
        };
    }
    error
}
