//! Formats, told apart by content.

use super::input::Input;
use super::text::dialect::{self, Dialect};
use crate::error::Result;
use crate::workspace::persist::{Persist, Saved};
use serde::Serialize;
use std::path::Path;

/// Format of an input file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// ASPRS LAS.
    Las,
    /// LAS compressed by laszip, COPC included.
    Laz,
    /// PLY with numbers as text.
    PlyAscii,
    /// PLY, little-endian binary.
    PlyBinaryLittleEndian,
    /// PLY, big-endian binary.
    PlyBinaryBigEndian,
    /// Lines of numbers: XYZ, TXT, CSV, PTS.
    Text,
}

impl Persist for Format {
    fn save(&self, out: &mut Vec<u8>) {
        (*self as u8).save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let formats = [
            Self::Las,
            Self::Laz,
            Self::PlyAscii,
            Self::PlyBinaryLittleEndian,
            Self::PlyBinaryBigEndian,
            Self::Text,
        ];
        let number = u8::load(from)?;
        let found = formats.into_iter().find(|f| *f as u8 == number);
        found.ok_or_else(|| from.wrong("a format"))
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Las => "LAS",
            Self::Laz => "LAZ",
            Self::PlyAscii => "PLY (ascii)",
            Self::PlyBinaryLittleEndian => "PLY (binary, little-endian)",
            Self::PlyBinaryBigEndian => "PLY (binary, big-endian)",
            Self::Text => "text",
        })
    }
}

/// What error messages say about the formats that are read.
pub(super) const READABLE: &str = "LAS, LAZ, PLY or text (XYZ, CSV, PTS)";

/// Bytes at the start of a file that decide its format.
const HEAD: usize = 64 << 10;

/// The same for a file with a very long first line, or many lines without a point.
const LONG_HEAD: usize = 1 << 20;

/// A file's family of formats, with what was learnt on the way.
pub(super) enum Family {
    Las,
    Ply,
    Text(Dialect),
    /// Known by name, but not read.
    Foreign(&'static str),
    /// Not a point cloud; why.
    Unknown(String),
}

/// Tells the family of a file from its first bytes.
pub(super) fn family(path: &Path, head: &[u8], whole: bool) -> Family {
    if head.is_empty() {
        return Family::Unknown("an empty file".into());
    }
    if head.starts_with(b"LASF") {
        return Family::Las;
    }
    if has_extension(path, &["las", "laz"]) {
        return Family::Unknown(format!("{}, no signature \"LASF\"", first_bytes(head)));
    }
    if is_ply(head) {
        return Family::Ply;
    }
    if head.strip_prefix(b"\xef\xbb\xbf").is_some_and(is_ply) {
        return Family::Unknown("PLY behind a byte order mark".into());
    }
    if head.starts_with(b"ASTM-E57") {
        return Family::Foreign("E57");
    }
    if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        return Family::Unknown("UTF-16 text".into());
    }
    if dialect::is_pcd(head) {
        return Family::Foreign("PCD");
    }
    if head.contains(&0) {
        return Family::Unknown(format!("{}, binary data", first_bytes(head)));
    }
    if let Some(name) = dialect::foreign(head) {
        return Family::Foreign(name);
    }
    match dialect::guess(head, whole) {
        Ok(dialect) => Family::Text(dialect),
        Err(why) => Family::Unknown(why),
    }
}

fn is_ply(head: &[u8]) -> bool {
    head.strip_prefix(b"ply").is_some_and(|rest| {
        let line = rest.split(|b| matches!(b, b'\n' | b'\r')).next();
        rest.len() > line.map_or(0, <[u8]>::len)
            && line.is_some_and(|l| l.iter().all(u8::is_ascii_whitespace))
    })
}

fn first_bytes(head: &[u8]) -> String {
    format!(
        "the first bytes \"{}\"",
        head[..head.len().min(8)].escape_ascii()
    )
}

/// True if the name ends, in any case, with one of the extensions.
pub(super) fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

/// The family of an open file.
pub(super) fn family_of(input: &Input) -> Result<Family> {
    let head = input.head(HEAD)?;
    let whole = |head: &[u8]| head.len() as u64 == input.bytes;
    match family(&input.path, &head, whole(&head)) {
        // A long first line, or many lines of comments.
        Family::Unknown(_) if !whole(&head) && !head.contains(&0) => {
            let head = input.head(LONG_HEAD)?;
            Ok(family(&input.path, &head, whole(&head)))
        }
        found => Ok(found),
    }
}

/// The error for a file of a family that is not read.
pub(super) fn refuse(input: &Input, family: &Family) -> crate::Error {
    match family {
        Family::Foreign(name) => input.error(
            "format",
            format!("{name}, which is not read"),
            format!("{READABLE}; convert it first"),
        ),
        Family::Unknown(why) => input.error("format", why.clone(), READABLE),
        Family::Las | Family::Ply | Family::Text(_) => input.error("format", "nothing", READABLE),
    }
}
