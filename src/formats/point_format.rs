//! The interface of input formats: detection and reading.

use super::input::Input;
use super::reads::{Means, Reads};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::compressed::plain_name;
use outcrop_points::Crs;
use outcrop_points::Format;
use outcrop_points::Layout;
use outcrop_points::colors::Depth;
use outcrop_points::columns::Column;
use outcrop_points::crop::Nearby;
use outcrop_points::native::Native;
use outcrop_points::spool::SourceWriter;
use std::path::{Path, PathBuf};

/// An input format; [`FORMATS`](super::formats::FORMATS) lists all of them.
pub(super) trait PointFormat: Sync {
    /// Names for messages that list the supported formats.
    fn names(&self) -> &'static str;

    /// File name extensions.
    fn extensions(&self) -> &'static [&'static str];

    /// True if content alone identifies the format. In folders, files with the content or the extension are
    /// then read; else only files with both.
    fn has_signature(&self) -> bool {
        true
    }

    /// True if a file is of this format; an error if it is certainly not of any supported format.
    fn recognize(&self, head: &Head) -> Result<bool, Refusal>;

    /// Reads the header of a file of this format.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] for an invalid header; [`outcrop_disk::error::Error::Io`].
    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>>;
}

/// The start of a file, used for detection.
pub(super) struct Head {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    /// True if this is the whole file.
    pub(super) whole: bool,
    /// What the caller says about text.
    pub(super) layout: Layout,
}

impl Head {
    pub(super) fn read(input: &Input, layout: &Layout, most: usize) -> Result<Self> {
        let bytes = input.head(most)?;
        Ok(Self {
            path: input.path.clone(),
            whole: bytes.len() as u64 == input.bytes,
            bytes,
            layout: layout.clone(),
        })
    }

    /// True if the file name has one of the extensions, in upper or lower case.
    pub(super) fn is_named(&self, extensions: &[&str]) -> bool {
        has_extension(&self.path, extensions)
    }

    /// The first bytes, for a message.
    pub(super) fn shown(&self) -> String {
        let first = &self.bytes[..self.bytes.len().min(8)];
        format!("the first bytes \"{}\"", first.escape_ascii())
    }
}

/// True if a path has one of the extensions, in upper or lower case, before that of a compression.
pub(super) fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let path = plain_name(path);
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

/// The reason why a file is not read.
#[derive(Debug, PartialEq)]
pub(super) enum Refusal {
    /// It is of an unsupported format with this name.
    Foreign(&'static str),
    /// It is a text of numbers whose columns cannot be told; what was found.
    Columns(String),
    /// It is this instead, with an advice.
    Instead(&'static str, &'static str),
    /// It is not a point cloud, for this reason.
    Unknown(String),
}

/// An input file with its header.
pub(super) trait PointFile {
    /// The values given in the header.
    fn claims(&self, input: &Input) -> Claims;

    /// The reference system given in the file.
    fn crs(&self, _input: &Input) -> Option<Crs> {
        None
    }

    /// The positions of the scanners, in the unit of the points; all of them when the points were read. A file
    /// that has any has a column [`SCANNER`](outcrop_points::columns::SCANNER) of `u16`.
    fn scanners(&self) -> Vec<[f64; 3]> {
        Vec::new()
    }

    /// False if columns, reference system and scanners are not known, since only the beginning of a compressed file is
    /// at hand.
    fn is_described(&self) -> bool {
        true
    }

    /// The scale of its colours, if the file says it.
    fn color_depth(&self) -> Option<Depth> {
        None
    }

    /// The columns of the file. A [`SourceWriter`] says which are wanted, by their numbers in this list. A file
    /// whose beginning does not tell gives all that there may be, until its points were read: then
    /// [`PointFile::found`] tells.
    fn columns(&self) -> Vec<Column> {
        Vec::new()
    }

    /// The columns that its points have, when they were read.
    fn found(&self) -> Vec<Column> {
        self.columns()
    }

    /// Which columns of a text are read as what, and true if the file does not say so plainly.
    fn taken(&self) -> Option<(&str, bool)> {
        None
    }

    /// The lowest and highest coordinates in the spool's type, if it is certain from the header and a few points
    /// that none of its points is wanted.
    fn lies_outside(
        &self,
        _input: &Input,
        _nearby: &Nearby<'_>,
        _workspace: &Workspace,
    ) -> Option<[[f64; 3]; 2]> {
        None
    }

    /// What a run reads of the file, which has all points if none is selected by `nearby`. Samples of points, by which
    /// a run checks what a header says, are not made.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`]; [`outcrop_disk::error::Error::Input`] for a hierarchy that a run
    /// refuses.
    fn reads(
        &self,
        input: &Input,
        _nearby: Option<&Nearby<'_>>,
        _means: Means<'_>,
    ) -> Result<Reads> {
        Ok(Reads::whole(input, self.claims(input).likely_points))
    }

    /// True if [`PointFile::read`] says itself which parts of the file it will read, with [`Input::expect`].
    fn says_what_it_reads(&self) -> bool {
        false
    }

    /// Reads all points, in units of at most a few MiB; returns warnings.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] where the file is damaged; errors of a [`SourceWriter`].
    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>>;
}

/// Values given in a file's header; none is verified.
#[derive(Debug, Clone)]
pub(super) struct Claims {
    pub(super) format: Format,
    /// The type of the points in the spool.
    pub(super) native: Native,
    /// True if the numbers come from text, so that a fixed number of decimals gives a lattice.
    pub(super) text: bool,
    /// True if points have a class.
    pub(super) classes: bool,
    /// Number of points.
    pub(super) points: Option<u64>,
    /// The number of points, limited by the file size; an estimate if the header gives none.
    pub(super) likely_points: u64,
    /// Version of the format.
    pub(super) version: Option<String>,
    /// Number of the point format, if the format has several.
    pub(super) point_format: Option<u8>,
    /// Smallest and largest coordinates.
    pub(super) bounds: Option<[[f64; 3]; 2]>,
}

impl Claims {
    /// Claims with only the number of points, each of which takes at least `least` bytes.
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
