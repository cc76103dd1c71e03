//! The place of a run that tasks share: a folder that all of them see, or the objects below a prefix of a store.

#[cfg_attr(not(feature = "cloud"), path = "place/without.rs")]
mod store;

use super::super::away::{Copies, below, is_store};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::away::Away;
use outcrop_disk::workspace::generations::SharedFolder;
use outcrop_disk::workspace::journal::Sharing;
use std::path::Path;
pub(super) use store::names;

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
