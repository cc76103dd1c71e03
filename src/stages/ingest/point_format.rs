//! How a format of point clouds is recognised and read.

use super::crs::Crs;
use super::format::Format;
use super::input::Input;
use super::source::Native;
use super::spool::SourceWriter;
use crate::error::Result;
use std::path::{Path, PathBuf};

/// A format of point clouds; [`FORMATS`](super::formats::FORMATS) lists all of them.
pub(super) trait PointFormat: Sync {
    /// The names in messages that say which formats are read.
    fn names(&self) -> &'static str;

    /// The formats that its files are said to have.
    fn formats(&self) -> &'static [Format];

    /// Extensions of its files.
    fn extensions(&self) -> &'static [&'static str];

    /// True if content alone tells the format. In a folder, files are then taken that have the content
    /// or the extension; otherwise those that have both.
    fn has_signature(&self) -> bool {
        true
    }

    /// Whether a file is of this format; an error if it is of none.
    fn recognize(&self, head: &Head) -> Result<bool, Refusal>;

    /// Reads the header of a file that was recognised.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a header that is wrong; [`crate::Error::Io`].
    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>>;
}

/// The start of a file, by which its format is told.
pub(super) struct Head {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    /// The file has no more bytes.
    pub(super) whole: bool,
}

impl Head {
    pub(super) fn read(input: &Input, most: usize) -> Result<Self> {
        let bytes = input.head(most)?;
        Ok(Self {
            path: input.path.clone(),
            whole: bytes.len() as u64 == input.bytes,
            bytes,
        })
    }

    /// True if the file's name ends, in any case, with one of the extensions.
    pub(super) fn is_named(&self, extensions: &[&str]) -> bool {
        has_extension(&self.path, extensions)
    }

    /// The first bytes, for a message.
    pub(super) fn shown(&self) -> String {
        let first = &self.bytes[..self.bytes.len().min(8)];
        format!("the first bytes \"{}\"", first.escape_ascii())
    }
}

/// True if a name ends, in any case, with one of the extensions.
pub(super) fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

/// Why a file is not read.
#[derive(Debug, PartialEq)]
pub(super) enum Refusal {
    /// It is of a format that is not read, of this name.
    Foreign(&'static str),
    /// It is no point cloud; why.
    Unknown(String),
}

/// A file whose header was read.
pub(super) trait PointFile {
    /// What the header says.
    fn claims(&self, input: &Input) -> Claims;

    /// The reference system that the file names.
    fn crs(&self, _input: &Input) -> Option<Crs> {
        None
    }

    /// Reads all points, in units of at most some MiB; returns what the user should know.
    ///
    /// # Errors
    /// [`crate::Error::Input`] where the file is damaged; those of a [`SourceWriter`].
    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>>;
}

/// What the header of a file says; nothing of it is checked against the points.
#[derive(Debug, Clone)]
pub(super) struct Claims {
    pub(super) format: Format,
    /// How the spool holds the points.
    pub(super) native: Native,
    /// The numbers come from text, so a fixed number of decimals is a lattice.
    pub(super) text: bool,
    /// Points have a class.
    pub(super) classes: bool,
    /// Number of points.
    pub(super) points: Option<u64>,
    /// The same as far as the file is large enough for them; a guess if nothing is claimed.
    pub(super) likely_points: u64,
    /// Version of the format.
    pub(super) version: Option<String>,
    /// Number of the layout of a point, where there are several.
    pub(super) point_format: Option<u8>,
    /// Smallest and largest coordinates.
    pub(super) bounds: Option<[[f64; 3]; 2]>,
}

impl Claims {
    /// Those of a header that says no more than the number of points; each takes `least` bytes or more.
    pub(super) fn new(
        input: &Input,
        format: Format,
        native: Native,
        points: u64,
        least: u64,
    ) -> Self {
        Self {
            format,
            native,
            text: false,
            classes: false,
            points: Some(points),
            likely_points: points.min(input.bytes / least.max(1)),
            version: None,
            point_format: None,
            bounds: None,
        }
    }
}
