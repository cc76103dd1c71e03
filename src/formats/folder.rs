//! What of a folder is a scan. Folders have other files beside scans: meshes, control points, matrices, notes. They
//! are left out by name, unless they are named themselves.

use super::formats::{FORMATS, LONG_HEAD, find, is_cloud};
use super::input::Input;
use super::point_format::{Head, PointFormat, Refusal, has_extension};
use outcrop_disk::error::{Error, Result};
use outcrop_ply::Header;
use outcrop_points::Layout;
use std::path::{Path, PathBuf};

/// Endings of files that an editor or an unfinished copy left.
const BACKUPS: [&str; 10] = [
    "bak",
    "backup",
    "old",
    "orig",
    "tmp",
    "temp",
    "part",
    "partial",
    "crdownload",
    "swp",
];

/// Extensions of meshes in formats that are not read.
const MESHES: [&str; 4] = ["obj", "stl", "glb", "gltf"];

/// Extensions of text that is often no scan.
const ANY_TEXT: [&str; 3] = ["txt", "csv", "asc"];

/// Words in the names of short lists that are no scans.
const SHORT_LISTS: [&str; 22] = [
    "calib",
    "calibration",
    "camera",
    "cameras",
    "checkpoint",
    "checkpoints",
    "control",
    "extrinsics",
    "gcp",
    "gcps",
    "intrinsics",
    "marker",
    "markers",
    "matrix",
    "notes",
    "readme",
    "station",
    "stations",
    "target",
    "targets",
    "transform",
    "transformation",
];

/// Words in the names of lists of any length that are no scans.
const LISTS: [&str; 6] = ["imu", "pose", "poses", "traj", "trajectory", "trajectories"];

/// A text with fewer lines is a short list.
const FEW: usize = 100;

/// A short list with the extension of a scan is one, unless another file has so many times its bytes.
const MANY: u64 = 10;

/// The verdict on a file in a folder.
pub(super) enum Judged {
    /// A scan.
    Scan,
    /// A short list of numbers: with so many lines.
    Short(usize),
    /// It could be taken for a scan, and is none for this reason.
    LeftOut(String),
    /// Something else.
    Other,
}

fn left_out(why: &str) -> Result<Judged> {
    Ok(Judged::LeftOut(why.to_owned()))
}

/// True for the folder of a run, whose files are of this program.
pub(super) fn is_scratch(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with(".outcrop-scratch")
}

/// True for a folder with levels of detail.
pub(super) fn is_tileset(folder: &Path) -> bool {
    folder.join("tileset.json").is_file()
}

/// Judges a file in a folder.
pub(super) fn judge(path: &Path) -> Result<Judged> {
    let named = |format: &dyn PointFormat| has_extension(path, format.extensions());
    let backup = is_backup(path);
    if has_extension(path, &MESHES) {
        return left_out("a mesh");
    }
    let signed = FORMATS.into_iter().any(|f| f.has_signature() && named(f));
    let input = match Input::open_head(path, &is_cloud, LONG_HEAD) {
        // A damaged archive of something else is skipped.
        Err(Error::Input { .. }) if !FORMATS.into_iter().any(named) => return Ok(Judged::Other),
        Err(Error::Input { .. }) => return Ok(Judged::Scan),
        opened => opened?,
    };
    let (head, found) = find(&input, &Layout::default())?;
    if is_mesh(&head) {
        return left_out("a mesh with faces");
    }
    let recognised = found.as_ref().is_ok_and(|format| format.has_signature());
    if backup {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let inner = match name.strip_suffix('~') {
            Some(inner) => PathBuf::from(inner),
            None => path.with_extension(""),
        };
        let cloud = FORMATS
            .into_iter()
            .any(|f| has_extension(&inner, f.extensions()));
        return match recognised || cloud {
            true => left_out("a backup or an unfinished copy, by its name"),
            false => Ok(Judged::Other),
        };
    }
    // A file named like a point cloud but with other content is an error; it is not skipped.
    if recognised || signed {
        return Ok(Judged::Scan);
    }
    match found {
        Ok(format) if named(format) => Ok(of_text(path, &head)),
        // A scan, whose columns the caller may tell; or no scan, as any text.
        Err(Refusal::Columns(_)) if FORMATS.into_iter().any(named) => Ok(of_text(path, &head)),
        Err(Refusal::Foreign("OBJ" | "STL")) => left_out("a mesh"),
        // A point cloud of an unsupported format must not be skipped silently.
        Err(Refusal::Foreign(_) | Refusal::Instead(..)) => Ok(Judged::Scan),
        Err(Refusal::Unknown(_)) if FORMATS.into_iter().any(named) => left_out("no list of points"),
        _ => Ok(Judged::Other),
    }
}

/// True for a name that an editor or an unfinished copy gives.
fn is_backup(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with('~') || has_extension(path, &BACKUPS)
}

/// True for PLY and OFF with faces.
fn is_mesh(head: &Head) -> bool {
    if head.bytes.starts_with(b"ply") {
        let header = Header::read(&mut &head.bytes[..]);
        return header.is_ok_and(|header| header.holds_faces());
    }
    let text = String::from_utf8_lossy(&head.bytes[..head.bytes.len().min(1 << 12)]);
    let lines = text
        .lines()
        .map(|line| line.split('#').next().unwrap_or_default());
    let mut words = lines.flat_map(str::split_whitespace);
    let is_off = words.next().is_some_and(|word| word.ends_with("OFF"));
    is_off
        && words
            .nth(1)
            .and_then(|faces| faces.parse().ok())
            .is_some_and(|n: u64| n > 0)
}

/// Judges a text that reads as points.
fn of_text(path: &Path, head: &Head) -> Judged {
    let stem = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = stem.to_ascii_lowercase();
    let words: Vec<&str> = stem.split(|c: char| !c.is_ascii_alphabetic()).collect();
    let has = |list: &[&str]| {
        words
            .iter()
            .copied()
            .find(|word| list.contains(word))
            .map(str::to_owned)
    };
    if let Some(word) = has(&LISTS) {
        return Judged::LeftOut(format!("no scan, by \"{word}\" in its name"));
    }
    let text = String::from_utf8_lossy(&head.bytes);
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let count = lines.clone().take(FEW).count();
    if !head.whole {
        return Judged::Scan;
    }
    if let Some(word) = has(&SHORT_LISTS) {
        return Judged::LeftOut(format!("no scan, by \"{word}\" in its name"));
    }
    match count < FEW {
        true if is_matrix(&lines.collect::<Vec<_>>()) => Judged::LeftOut("a matrix".into()),
        true => Judged::Short(count),
        false => Judged::Scan,
    }
}

/// True for four rows of four numbers of which the last is `0 0 0 1`.
fn is_matrix(lines: &[&str]) -> bool {
    let numbers = |line: &str| -> Option<Vec<f64>> {
        let words = line.split([' ', '\t', ',', ';']);
        words
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().ok())
            .collect()
    };
    let rows: Vec<Vec<f64>> = lines.iter().map_while(|line| numbers(line)).collect();
    rows.len() == 4
        && lines.len() == 4
        && rows.iter().all(|row| row.len() == 4)
        && rows[3] == [0.0, 0.0, 0.0, 1.0]
}

/// A short list in a folder: the file, its lines, and its bytes.
pub(super) type Short = (PathBuf, usize, u64);

/// True if a short list is none of the scans of its folder: their names do not end alike, and they are larger.
pub(super) fn stands_alone((path, _, bytes): &Short, scans: &[(PathBuf, u64)]) -> bool {
    let ending = |path: &Path| path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let alike = scans.iter().any(|(scan, _)| ending(scan) == ending(path));
    let largest = scans.iter().map(|(_, bytes)| *bytes).max();
    let larger = largest.is_some_and(|largest| {
        has_extension(path, &ANY_TEXT) || largest >= MANY.saturating_mul(*bytes)
    });
    larger && !alike
}
