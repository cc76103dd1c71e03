//! The folder of a run that tasks share, by any name that a user has for it: its own, that of the mesh, or that of
//! the folder for scratch files.

use super::super::away::{below, is_store};
use super::super::start::scratch_folder;
use super::place;
use crate::deliver::SCRATCH;
use outcrop_disk::error::{Error, Remedy, Result};
use outcrop_disk::workspace::generations::SharedFolder;
use outcrop_mesh_files::export::folder_of;
use outcrop_platform::{path_bytes, path_of_bytes};
use std::ffi::{OsStr, OsString};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Most bytes of a path in a file.
const LONGEST: u64 = 16 << 10;

/// The file beside a mesh with the path of the folder of its run, if that lies elsewhere.
fn note_of(mesh: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(mesh.file_name().unwrap_or_default());
    name.push(".outcrop-run");
    folder_of(mesh).join(name)
}

/// Notes beside the mesh where the folder of its run is, unless it is beside it too.
pub(super) fn note(mesh: &Path, folder: &Path) -> Result<()> {
    if folder == scratch_folder(mesh, None) {
        forget(mesh);
        return Ok(());
    }
    let path = note_of(mesh);
    let whole = match is_store(folder) {
        true => folder.to_path_buf(),
        false => std::path::absolute(folder).map_err(|e| Error::io(folder, "find", e))?,
    };
    let bytes = [&path_bytes(&whole)[..], b"\n"].concat();
    std::fs::write(&path, bytes).map_err(|e| Error::io(&path, "write", e))
}

/// Deletes the note; it does no harm if it cannot be deleted.
pub(super) fn forget(mesh: &Path) {
    let _ = std::fs::remove_file(note_of(mesh));
}

/// The folder that is noted beside a mesh.
fn noted(mesh: &Path) -> Option<PathBuf> {
    let file = std::fs::File::open(note_of(mesh)).ok()?;
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).ok()?;
    let path = bytes.strip_suffix(b"\n")?.to_vec();
    Some(path_of_bytes(path))
}

/// The folder of the run that `given` names: the folder itself, the mesh, or the folder that was given as
/// `--scratch`, if there is one run in it.
///
/// # Errors
/// [`Error::NotResumable`] if no run or several are there; [`Error::Io`].
pub fn shared_folder(given: &Path) -> Result<PathBuf> {
    if is_store(given) {
        return in_store(given);
    }
    let mut named = vec![given.to_path_buf()];
    if given.file_name().is_some() {
        named.push(scratch_folder(given, None));
        named.extend(noted(given));
    }
    let is_at = |path: &PathBuf| is_store(path) || SharedFolder::is_at(path);
    if let Some(found) = named.into_iter().find(is_at) {
        return Ok(found);
    }
    let not = |why: String| Error::not_resumable(given, why);
    let none = || {
        let plan = Remedy::Command("plan", "to begin one");
        not("no run that tasks share is here".into()).with(plan)
    };
    if given.is_file() {
        return Err(none());
    }
    let name = given.file_name().map(OsStr::to_string_lossy);
    if !given.is_dir() || name.is_some_and(|name| name.ends_with(SCRATCH)) {
        // What opens it tells what it is.
        return Ok(given.to_path_buf());
    }
    let entries = std::fs::read_dir(given).map_err(|e| Error::io(given, "list", e))?;
    let folders = entries.flatten().map(|entry| entry.path());
    let runs: Vec<PathBuf> = folders.filter(|path| SharedFolder::is_at(path)).collect();
    only(given, runs)
}

/// The run that a URL names: its own, or that of a prefix in which there is one.
fn in_store(given: &Path) -> Result<PathBuf> {
    let text = given.to_string_lossy();
    let given = Path::new(text.trim_end_matches('/'));
    if given.to_string_lossy().ends_with(SCRATCH) {
        return Ok(given.to_path_buf());
    }
    let names = place::names(given)?.into_iter();
    let runs = names.filter(|name| name.ends_with(SCRATCH));
    only(
        given,
        runs.map(|name| below(given, name.as_ref())).collect(),
    )
}

/// The only one of the runs in a folder.
fn only(given: &Path, mut runs: Vec<PathBuf>) -> Result<PathBuf> {
    let not = |why: String| Error::not_resumable(given, why);
    runs.sort();
    match &runs[..] {
        [one] => Ok(one.clone()),
        [] => Err(not("no run that tasks share is here".into())
            .with(Remedy::Command("plan", "to begin one"))),
        several => {
            let names = several.iter().filter_map(|path| path.file_name());
            let names: Vec<_> = names.map(OsStr::to_string_lossy).collect();
            Err(not(format!(
                "several runs are here: {}; name one of them, or its mesh",
                names.join(", ")
            )))
        }
    }
}
