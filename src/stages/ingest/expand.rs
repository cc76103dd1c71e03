//! Replaces folders by the point files in them.

use super::formats::{is_points, readable};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The point files of `inputs`: files are taken as they are, folders recursively, sorted by name.
///
/// In folders, hidden files and files that are not point clouds are skipped; links to folders are not
/// followed.
///
/// # Errors
/// [`Error::Io`] if something cannot be read, [`Error::Input`] for a folder without point files.
pub fn expand(inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for input in inputs {
        let meta = std::fs::metadata(input).map_err(|e| Error::io(input, "open", e))?;
        if !meta.is_dir() {
            files.push(input.clone());
            continue;
        }
        let before = files.len();
        walk(input, &mut files)?;
        if files.len() == before {
            let expected = format!("at least one file of {}", readable());
            return Err(Error::input(input, "folder", "no point file", expected));
        }
    }
    Ok(files)
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let failed = |e| Error::io(folder, "list", e);
    let mut entries = std::fs::read_dir(folder)
        .and_then(Iterator::collect::<std::io::Result<Vec<_>>>)
        .map_err(failed)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let path = entry.path();
        if entry.file_type().map_err(failed)?.is_dir() {
            walk(&path, files)?;
        } else if std::fs::metadata(&path).is_ok_and(|m| m.is_file()) && is_points(&path)? {
            files.push(path);
        }
    }
    Ok(())
}
