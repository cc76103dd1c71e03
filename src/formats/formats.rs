//! The list of input formats, and the detection of a file's format.

use super::e57::E57;
use super::ept::Ept;
use super::foreign;
use super::input::Input;
use super::las::Las;
use super::off::Off;
use super::pcd::Pcd;
use super::ply::Ply;
use super::point_format::{Head, PointFile, PointFormat, Refusal, has_extension};
use super::ptx::Ptx;
use super::text::Text;
use outcrop_disk::error::{Remedy, Result, Setting};
use outcrop_points::Layout;
use std::path::Path;

/// All formats, in the order in which they are tested. Text is last: its error explains why no format fits.
pub(super) const FORMATS: [&dyn PointFormat; 8] = [&Las, &Ept, &E57, &Ply, &Pcd, &Ptx, &Off, &Text];

/// Bytes at the start of a file that are used for detection.
const HEAD: usize = 64 << 10;

/// The same, for a file with a very long first line, or with many lines before the first point.
pub(super) const LONG_HEAD: usize = 1 << 20;

/// The columns that are expected of a text whose own cannot be told, for the error.
const COLUMNS: &str = "columns called x, y and z";

/// An example of their names.
const NAMES: &str = "x,y,z,r,g,b,-";

/// Names of all formats, for messages.
pub(super) fn readable() -> String {
    let names = FORMATS.map(PointFormat::names);
    let (last, first) = names.split_last().unwrap_or((&"", &[]));
    format!("{} or {last}", first.join(", "))
}

fn ask(head: &Head) -> Result<&'static dyn PointFormat, Refusal> {
    if head.bytes.is_empty() {
        return Err(Refusal::Unknown("an empty file".into()));
    }
    if let Some(known) = foreign::stand_in(&head.bytes) {
        return Err(Refusal::Instead(known.what, known.advice));
    }
    for format in FORMATS {
        if format.recognize(head)? {
            return Ok(format);
        }
    }
    Err(Refusal::Unknown(head.shown()))
}

/// The format of a file, and the bytes used for detection.
pub(super) fn find(
    input: &Input,
    layout: &Layout,
) -> Result<(Head, Result<&'static dyn PointFormat, Refusal>)> {
    let head = Head::read(input, layout, HEAD)?;
    match ask(&head) {
        // A long first line, or many lines of comments.
        Err(Refusal::Unknown(_)) if !head.whole && !head.bytes.contains(&0) => {
            let head = Head::read(input, layout, LONG_HEAD)?;
            let found = ask(&head);
            Ok((head, found))
        }
        found => Ok((head, found)),
    }
}

/// Detects the format of a file and reads its header.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] if it is no point cloud that can be read; [`outcrop_disk::error::Error::Io`].
pub(super) fn open(input: &Input, layout: &Layout) -> Result<Box<dyn PointFile>> {
    let (head, found) = find(input, layout)?;
    let (found, advice) = match found {
        Ok(format) => return format.open(input, &head),
        Err(Refusal::Foreign(name)) => (format!("{name}, which is not read"), "convert it first"),
        Err(Refusal::Instead(what, advice)) => (what.to_owned(), advice),
        Err(Refusal::Columns(found)) => {
            let columns = Setting::Value("columns", NAMES.to_owned());
            let remedy = Remedy::Give(columns, "names such columns in order");
            return Err(input.error("columns", found, COLUMNS).with(remedy));
        }
        Err(Refusal::Unknown(why)) => match foreign::known(&head) {
            Some(known) => (format!("{}, which is not read", known.what), known.advice),
            None => (why, ""),
        },
    };
    let advice = match advice {
        "" => String::new(),
        advice => format!("; {advice}"),
    };
    Err(input.error("format", found, readable() + &advice))
}

/// True if a member of an archive is a point cloud, as in a folder.
pub(super) fn is_cloud(name: &Path, bytes: &[u8], whole: bool) -> bool {
    let head = Head {
        path: name.to_path_buf(),
        bytes: bytes.to_vec(),
        whole,
        layout: Layout::default(),
    };
    let named = |format: &dyn PointFormat| has_extension(name, format.extensions());
    match ask(&head) {
        Ok(format) => format.has_signature() || named(format),
        // What cannot be told is told when it is read.
        Err(Refusal::Columns(_)) => FORMATS.into_iter().any(named),
        Err(_) => false,
    }
}
