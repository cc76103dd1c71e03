//! Inputs behind URLs that stand for several files.

use super::super::formats::FORMATS;
use super::super::point_format::has_extension;
use super::super::remote::{below as files_below, is_remote};
use outcrop_disk::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Extensions of lists.
const LISTS: [&str; 3] = ["txt", "lst", "list"];

/// Most bytes of a list: a hundred thousand names and more.
const LONGEST: u64 = 64 << 20;

/// Bytes of a text in which the first name of a list stands.
const HEAD: u64 = 16 << 10;

/// The scans below a prefix of a store, with their sizes; none if the path names one file. Files are told by their
/// names: to look into each would be a request for each.
pub(super) fn below(prefix: &Path) -> Result<Option<Vec<(PathBuf, u64)>>> {
    let hidden = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.as_encoded_bytes().starts_with(b".")
    };
    let named = |path: &Path| FORMATS.iter().any(|f| has_extension(path, f.extensions()));
    files_below(prefix, |path| named(path) && !hidden(path))
}

/// The inputs in a local list, one on each line; none for a file that is no list. Empty lines and lines that begin
/// with `#` are passed over. Local files may be among them: their names count from the folder of the list.
pub(super) fn listed(path: &Path) -> Result<Option<Vec<PathBuf>>> {
    let named = path.extension().and_then(|e| e.to_str());
    let named = named.is_some_and(|e| LISTS.iter().any(|list| e.eq_ignore_ascii_case(list)));
    if is_remote(path) || !named || !path.is_file() {
        return Ok(None);
    }
    let failed = |e| Error::io(path, "read", e);
    let file = File::open(path).map_err(failed)?;
    let mut head = Vec::new();
    (&file).take(HEAD).read_to_end(&mut head).map_err(failed)?;
    if !names(&String::from_utf8_lossy(&head))
        .next()
        .is_some_and(is_url)
    {
        return Ok(None);
    }
    let mut text = head;
    (&file)
        .take(LONGEST)
        .read_to_end(&mut text)
        .map_err(failed)?;
    let text = String::from_utf8_lossy(&text);
    if text.len() as u64 > LONGEST {
        let found = format!("more than {LONGEST} bytes");
        return Err(Error::input(path, "list of URLs", found, "a shorter list"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let place = |line: &str| match is_url(line) {
        true => PathBuf::from(line),
        false => folder.join(line),
    };
    Ok(Some(names(&text).map(place).collect()))
}

/// The lines that name an input.
fn names(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines.filter(|line| !line.is_empty() && !line.starts_with('#'))
}

fn is_url(line: &str) -> bool {
    is_remote(Path::new(line))
}
