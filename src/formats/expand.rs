//! Replaces folders, prefixes of stores and lists of URLs by the point files in them.

mod urls;

use super::ept;
use super::folder::{Judged, Short, is_scratch, is_tileset, judge, stands_alone};
use super::formats::readable;
use super::remote::is_remote;
use outcrop_disk::error::{Error, Result};
use outcrop_points::LeftOut;
use std::collections::{BTreeSet, VecDeque};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Most names in a message about files that are left out.
const NAMED: usize = 8;

/// The point files of inputs.
#[derive(Debug, Default)]
pub(super) struct Expanded {
    /// The files.
    pub(super) files: Vec<PathBuf>,
    /// Files in folders that could be taken for scans, and are none.
    pub(super) left_out: Vec<LeftOut>,
}

/// The point files of `inputs`: files are taken as they are, folders and prefixes of stores recursively, sorted by
/// name. A text whose first line is a URL is a list of inputs.
///
/// In folders, hidden files and files that are not scans are skipped. Links are followed; a folder to which several ways
/// lead is read once.
///
/// # Errors
/// [`Error::Io`] if something cannot be read, [`Error::Input`] for a folder without point files.
pub fn expand(inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    Ok(expanded(inputs)?.files)
}

/// As [`expand`], with what was left out.
pub(super) fn expanded(inputs: &[PathBuf]) -> Result<Expanded> {
    let mut all = Expanded::default();
    for input in inputs {
        if let Some(listed) = urls::listed(input)? {
            all.add(&expanded(&listed)?);
            continue;
        }
        let mut found = Found::default();
        if is_remote(input) {
            let Some(files) = urls::below(input)? else {
                all.files.push(input.clone());
                continue;
            };
            found.scans = files;
        } else {
            let meta = std::fs::metadata(input).map_err(|e| Error::io(input, "open", e))?;
            if !meta.is_dir() {
                all.files.push(input.clone());
                continue;
            }
            found.search(input)?;
            found.sort_out();
        }
        if found.scans.is_empty() {
            let expected = format!("at least one file of {}", readable());
            let place = "no point file".to_owned();
            let more =
                told(&found.left_out).map_or_else(String::new, |told| format!(", but {told}"));
            return Err(Error::input(input, "folder", place + &more, expected));
        }
        all.files
            .extend(found.scans.into_iter().map(|(path, _)| path));
        all.left_out.extend(found.left_out);
    }
    Ok(all)
}

impl Expanded {
    fn add(&mut self, more: &Self) {
        self.files.extend_from_slice(&more.files);
        self.left_out.extend_from_slice(&more.left_out);
    }

    /// A warning about what was left out.
    pub(super) fn warning(&self) -> Option<String> {
        let told = told(&self.left_out)?;
        let count = self.left_out.len();
        let files = if count == 1 { "file" } else { "files" };
        Some(format!(
            "left out {count} {files} in folders, as no scans: {told}; a file that is named itself is read"
        ))
    }
}

/// The names of files, and why they are left out; none without files.
fn told(left_out: &[LeftOut]) -> Option<String> {
    let one = |file: &LeftOut| format!("{} ({})", file.path.display(), file.why);
    let some: Vec<String> = left_out.iter().take(NAMED).map(one).collect();
    let more = left_out.len().saturating_sub(NAMED);
    match (some.is_empty(), more) {
        (true, _) => None,
        (_, 0) => Some(some.join(", ")),
        _ => Some(format!("{} and {more} more", some.join(", "))),
    }
}

/// The scans in a folder, and the files that are left out.
#[derive(Default)]
struct Found {
    /// Scans, and their bytes.
    scans: Vec<(PathBuf, u64)>,
    short: Vec<Short>,
    left_out: Vec<LeftOut>,
    /// Folders that were searched, without links in their paths.
    searched: BTreeSet<PathBuf>,
    /// Links to folders that were met and not yet followed.
    links: VecDeque<PathBuf>,
}

impl Found {
    /// Searches a folder, and then those to which links in it lead: so a folder inside it has its own name.
    fn search(&mut self, folder: &Path) -> Result<()> {
        self.walk(folder)?;
        while let Some(link) = self.links.pop_front() {
            self.walk(&link)?;
        }
        Ok(())
    }

    fn leave_out(&mut self, path: PathBuf, why: String) {
        self.left_out.push(LeftOut { path, why });
    }

    fn walk(&mut self, folder: &Path) -> Result<()> {
        let place = std::fs::canonicalize(folder).map_err(|e| Error::io(folder, "find", e))?;
        if !self.searched.insert(place) {
            return Ok(());
        }
        let tiles = folder.join(ept::NAME);
        if tiles.is_file() {
            // It stands for the files below.
            self.scans.push((tiles, 0));
            return Ok(());
        }
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
            let is_link = entry.file_type().map_err(failed)?.is_symlink();
            match std::fs::metadata(&path) {
                Ok(about) if about.is_dir() => self.folder(path, is_link)?,
                Ok(about) if about.is_file() => self.file(path, about.len())?,
                // A pipe or a device.
                Ok(_) => {}
                Err(e) if is_link && e.kind() == ErrorKind::NotFound => {
                    self.leave_out(path, "a link to nothing".into());
                }
                Err(e) => self.leave_out(path, format!("it cannot be opened: {e}")),
            }
        }
        Ok(())
    }

    fn folder(&mut self, path: PathBuf, is_link: bool) -> Result<()> {
        if is_tileset(&path) {
            self.leave_out(path, "levels of detail".into());
            return Ok(());
        }
        match (is_scratch(&path), is_link) {
            (true, _) => {}
            (false, true) => self.links.push_back(path),
            (false, false) => self.walk(&path)?,
        }
        Ok(())
    }

    fn file(&mut self, path: PathBuf, bytes: u64) -> Result<()> {
        match judge(&path)? {
            Judged::Scan => self.scans.push((path, bytes)),
            Judged::Short(lines) => self.short.push((path, lines, bytes)),
            Judged::LeftOut(why) => self.leave_out(path, why),
            Judged::Other => {}
        }
        Ok(())
    }

    /// Takes short lists for scans unless they stand alone beside scans.
    fn sort_out(&mut self) {
        let (alone, scans): (Vec<Short>, Vec<Short>) = std::mem::take(&mut self.short)
            .into_iter()
            .partition(|short| stands_alone(short, &self.scans));
        for (path, lines, _) in alone {
            self.leave_out(path, format!("{lines} lines, too short for a scan"));
        }
        self.scans
            .extend(scans.into_iter().map(|(path, _, bytes)| (path, bytes)));
        // In the order of names in each folder, whatever they are.
        self.scans.sort();
        self.left_out.sort_by(|a, b| a.path.cmp(&b.path));
    }
}
