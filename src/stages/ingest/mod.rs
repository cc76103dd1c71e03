//! Reads the input formats and converts points to lattice positions.
//!
//! [`ingest`] decodes every input once into a [`Spool`]: one scratch file with all points in their native
//! precision, and exact statistics of each file. [`Spool::choose_lattice`] then finds a common lattice, and
//! [`Spool::for_each`] streams the points as positions on it.
//!
//! Formats are detected by content: LAS 1.0 to 1.4 with point formats 0 to 10, LAZ (COPC included), E57,
//! PLY, PCD, PTX, OFF, and text with one point in a line; any of them may be compressed with gzip or Zstandard. Each
//! format is a module that implements `PointFormat`, and an entry of the list in `formats.rs`.

mod agree;
mod belong;
mod carry;
mod classes;
mod columns;
mod comments;
mod contain;
mod coordinate;
mod crop;
mod crs;
mod directions;
mod e57;
mod expand;
mod far;
mod folder;
mod format;
mod formats;
mod frames;
mod given;
mod input;
mod kind;
mod las;
mod lattice;
mod layout;
mod lines;
mod map;
mod middle;
mod native;
mod normals;
mod number;
mod off;
mod pcd;
mod ply;
mod point_format;
mod prj;
mod probe;
mod ptx;
mod ranks;
mod scalar;
mod source;
mod spool;
mod stats;
mod stream;
mod systems;
mod taken;
mod text;
mod units;
mod wkt;

pub use carry::{Attribute, Carried};
pub use classes::Classes;
pub use columns::{Attributes, Column};
pub use crop::Crop;
pub use crs::{Crs, CrsSource};
pub use directions::{NORMAL_BYTES, direction};
pub use expand::expand;
pub use format::Format;
pub use given::GivenCrs;
pub use kind::CrsKind;
pub use layout::{Layout, TextColumns};
pub use prj::{of_prj, prj_of};
pub use probe::{Probe, probe, probe_as};
pub use stats::{FileStats, IngestStats, LeftOut};
pub use stream::{READ_BUFFERS, VALUE_BUFFERS};
pub use systems::Mixed;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::workspace::Workspace;
use columns::{SCANNER, Wanted, row_bytes};
use crop::Nearby;
use frames::{Frame, values_of};
use input::Input;
use native::Native;
use outcrop_ply::Scalar;
use point_format::{Claims, PointFile};
use serde::{Deserialize, Serialize};
use source::Source;
use spool::SourceWriter;
use std::path::PathBuf;
use systems::Systems;
use taken::Taken;

/// Precision that suffices for writing the coordinates of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CoordinateType {
    /// Single precision: all inputs have it, or it moves no point by a tenth of a step or more.
    F32,
    /// Double precision.
    F64,
}

/// The points that are read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Selection {
    /// Those of these classes.
    pub classes: Classes,
    /// Those in this region; `None` for all.
    pub crop: Option<Crop>,
    /// Columns of the points.
    pub attributes: Attributes,
    /// True if the scanners of the points are read, from files that give their positions.
    pub scanners: bool,
    /// True if the normals of the points are read, from files that have any.
    pub normals: bool,
    /// How text files are read.
    pub layout: Layout,
    /// The reference system, whatever files say; `None` for theirs.
    pub crs: Option<GivenCrs>,
}

/// All points of the inputs in one scratch file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Spool {
    name: String,
    frames: Vec<Frame>,
    /// The frames of values, if columns are wanted: one for each of `frames`, without points for sources that have
    /// none of the columns.
    values: Vec<Frame>,
    sources: Vec<Source>,
    stats: IngestStats,
    /// The well-known text of the reference system, at most 1 MiB.
    wkt: Option<String>,
}

/// Decodes all inputs, which may be files and folders, into a spool.
///
/// Progress is reported to the observer; the caller begins and ends the stage. Memory is reserved for each
/// unit of work, a few MiB for each thread.
///
/// # Errors
/// [`crate::Error::Input`] for a file that is not what it claims to be; [`crate::Error::Io`],
/// [`crate::Error::Disk`], [`crate::Error::Memory`], [`crate::Error::Cancelled`].
pub fn ingest(inputs: &[PathBuf], workspace: &Workspace) -> Result<Spool> {
    ingest_selected(inputs, &Selection::default(), workspace)
}

/// As [`ingest`], but reads only points of the wanted classes.
///
/// # Errors
/// See [`ingest`].
pub fn ingest_classes(
    inputs: &[PathBuf],
    classes: &Classes,
    workspace: &Workspace,
) -> Result<Spool> {
    let selection = Selection {
        classes: classes.clone(),
        ..Selection::default()
    };
    ingest_selected(inputs, &selection, workspace)
}

/// As [`ingest`], but reads only what is selected.
///
/// # Errors
/// See [`ingest`]; [`crate::Error::Parameter`] for columns that no file has.
pub fn ingest_selected(
    inputs: &[PathBuf],
    selection: &Selection,
    workspace: &Workspace,
) -> Result<Spool> {
    let expanded = expand::expanded(inputs)?;
    let paths = &expanded.files;
    check_columns(paths, selection)?;
    let name = format!("ingest-{}.spool", workspace.number());
    let spool = read_all(paths, selection, &name, workspace).map(|mut spool| {
        let said = expanded.warning();
        spool.stats.warnings.splice(0..0, said);
        spool.stats.left_out = expanded.left_out;
        spool
    });
    if spool.is_err() && !workspace.is_resumable() {
        workspace.files.release(&name)?;
        workspace.files.release(&values_of(&name))?;
    }
    spool
}

/// Refuses columns that are in none of the files.
fn check_columns(paths: &[PathBuf], selection: &Selection) -> Result<()> {
    let attributes = &selection.attributes;
    if !matches!(attributes, Attributes::List(_)) {
        return Ok(());
    }
    let mut present = Vec::new();
    for path in paths {
        let probe = probe_as(path, &selection.layout)?;
        if !probe.is_described {
            // Checked when all files were read.
            return Ok(());
        }
        present.extend(probe.columns);
    }
    attributes.check(&present)
}

/// Decodes all inputs into the spool `name`.
fn read_all(
    paths: &[PathBuf],
    selection: &Selection,
    name: &str,
    workspace: &Workspace,
) -> Result<Spool> {
    let classes = &selection.classes;
    let crop = selection.crop.as_ref();
    let nearby = crop.map(|crop| Nearby::of(crop, workspace));
    let nearby = nearby.transpose()?;
    let (mut section, mut frames, mut values) = (0, Vec::new(), Vec::new());
    let mut sources = Vec::new();
    let mut stats = IngestStats::default();
    let mut systems = Systems::default();
    let mut shared = false;
    let mut present = Vec::new();
    let mut taken = Taken::default();
    for path in paths {
        workspace.check_cancel()?;
        let opened = Opened::new(Input::open(path, workspace)?, &selection.layout)?;
        let number = sources.len() as u32;
        let scanners = selection.scanners && opened.has_scanners();
        let columns = opened.file.columns();
        let wanted = Wanted::of(&selection.attributes, &columns, scanners, selection.normals)?;
        let target = SourceWriter::new(workspace, name, section, number, classes, &wanted)?
            .within(nearby.as_ref(), opened.claims.native);
        let outside =
            |nearby: &Nearby<'_>| opened.file.lies_outside(&opened.input, nearby, workspace);
        let mut warnings = if let Some(bounds) = nearby.as_ref().and_then(outside) {
            target.skip(opened.claims.likely_points, bounds);
            Vec::new()
        } else {
            match opened.file.read(&opened.input, &target) {
                // Tasks read all files at the same time.
                Err(Error::Shared) => {
                    shared = true;
                    Vec::new()
                }
                other => other?,
            }
        };
        if *classes != Classes::All && !opened.claims.classes {
            warnings.push("its points have no class, all of them are kept".to_owned());
        }
        let found = opened.file.found();
        let columns = wanted.found(&found);
        present.extend(found);
        taken.add(&opened);
        let read = target.stats();
        let (next, more, more_values) = target.end();
        section = next;
        frames.extend(more);
        values.extend(more_values.frames);
        if selection.attributes != Attributes::None || selection.scanners || selection.normals {
            // Frames without values.
            values.resize(frames.len(), Frame::default());
        }
        let source = Source {
            native: opened.claims.native,
            stats: read,
            text: opened.claims.text,
            cut: false,
            columns,
            spans: more_values.spans,
        };
        let shown = |w: String| format!("{}: {w}", path.display());
        stats.warnings.extend(warnings.into_iter().map(shown));
        let (crs, unusable) = opened.crs();
        stats.warnings.extend(unusable);
        stats.add(&opened, &source, crs.as_ref().map(Crs::without_texts));
        if let Some(crs) = crs {
            systems.add(path, crs);
        }
        sources.push(source);
    }
    if shared {
        return Err(Error::Shared);
    }
    selection.attributes.check(&present)?;
    taken.check(&selection.layout)?;
    stats.warnings.extend(taken.warnings());
    if let Some(crop) = crop.filter(|_| stats.kept == 0) {
        crop.check_met(&sources)?;
    }
    let wkt = stats.compare(systems, selection.crs.as_ref());
    Ok(Spool {
        name: name.to_owned(),
        frames,
        values,
        sources,
        stats,
        wkt,
    })
}

/// An input file with its header.
struct Opened {
    input: Input,
    file: Box<dyn PointFile>,
    claims: Claims,
}

impl Opened {
    fn new(input: Input, layout: &Layout) -> Result<Self> {
        let file = formats::open(&input, layout)?;
        let claims = file.claims(&input);
        Ok(Self {
            input,
            file,
            claims,
        })
    }

    /// True if the file tells where the scanners were, and which of them saw a point.
    fn has_scanners(&self) -> bool {
        let columns = self.file.columns();
        let scanner = columns.iter().find(|c| c.name == SCANNER);
        scanner.is_some_and(|c| c.scalar == Scalar::U16) && !self.file.scanners().is_empty()
    }

    /// The reference system that the file gives, or else a `.prj` file beside it; a warning about that.
    fn crs(&self) -> (Option<Crs>, Option<String>) {
        let beside = prj::beside(&self.input);
        let Some(own) = self.file.crs(&self.input) else {
            return beside;
        };
        let other = beside.0.filter(|beside| beside.differs(&own));
        let warning = other.map(|beside| {
            format!(
                "{}: it gives {beside}, but {} itself gives {own}, which is taken",
                prj_of(&self.input.path).display(),
                self.input.path.display()
            )
        });
        (Some(own), warning)
    }
}

/// Checks that the headers of all files give one reference system. Files that cannot be read are passed over:
/// their error comes when they are read.
///
/// # Errors
/// [`Error::Input`] with two files whose systems are different.
pub fn check_systems(inputs: &[PathBuf]) -> Result<()> {
    let mut systems = Systems::default();
    for path in expand(inputs)? {
        let head = Input::open_head(&path, formats::LONG_HEAD);
        let opened = head.and_then(|input| Opened::new(input, &Layout::default()));
        if let Some(crs) = opened.ok().and_then(|opened| opened.crs().0) {
            systems.add(&path, crs);
        }
    }
    match systems.common() {
        Ok(_) => Ok(()),
        Err(mixed) => Err(mixed.refused()),
    }
}

impl IngestStats {
    fn add(&mut self, opened: &Opened, source: &Source, crs: Option<Crs>) {
        let stats = &source.stats;
        self.read += stats.read;
        self.kept += stats.kept;
        self.dropped_non_finite += stats.dropped;
        self.withheld += stats.withheld;
        self.invalid += stats.invalid;
        self.dropped_by_class += stats.unwanted;
        self.dropped_by_crop += stats.outside;
        self.skipped_by_crop += stats.skipped;
        let bounds = source.bounds();
        let taken = opened.file.taken();
        self.files.push(FileStats {
            path: opened.input.path.clone(),
            format: opened.claims.format,
            bytes: opened.input.size,
            columns: opened.file.found().into_iter().map(|c| c.name).collect(),
            taken: taken.map(|(taken, _)| taken.to_owned()),
            guessed: taken.is_some_and(|(_, guessed)| guessed),
            claimed: opened.claims.points,
            points: stats.read,
            kept: stats.kept,
            dropped_non_finite: stats.dropped,
            withheld: stats.withheld,
            invalid: stats.invalid,
            dropped_by_class: stats.unwanted,
            dropped_by_crop: stats.outside,
            skipped_by_crop: stats.skipped,
            dropped_far: 0,
            min: bounds.map(|b| b[0]),
            max: bounds.map(|b| b[1]),
            scanners: opened.file.scanners(),
            crs,
        });
    }
}

impl Spool {
    /// Counts and extents of the input.
    #[must_use]
    pub fn stats(&self) -> &IngestStats {
        &self.stats
    }

    /// The well-known text of the reference system, if it was given by one; at most 1 MiB.
    #[must_use]
    pub fn wkt(&self) -> Option<&str> {
        self.wkt.as_deref()
    }

    /// Deletes the scratch files.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        if self.has_values() {
            workspace.files.release(&values_of(&self.name))?;
        }
        workspace.files.release(&self.name)
    }

    /// Approximate bytes of the points in the spool.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let point = |source: &Source| source.native.point_bytes() + row_bytes(&source.columns);
        let bytes = |source: &Source| source.stats.kept * point(source) as u64;
        self.sources.iter().map(bytes).sum()
    }

    /// Number of points in the spool.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.stats.kept
    }

    /// Chooses one lattice for the whole cloud, with the same step along all axes, independent of the order
    /// of the files.
    ///
    /// For LAS scales and fixed decimals it has the largest common step, for floating-point values the
    /// largest power of two of which all are multiples. If the cloud would span 2^30 steps or more, the step
    /// is enlarged and `exact` is false. The step is then halved up to `refine` times, as long as the cloud
    /// fits.
    ///
    /// # Errors
    /// [`crate::Error::Degenerate`] if there are no points.
    pub fn choose_lattice(&self, refine: u32) -> Result<Lattice> {
        lattice::choose(&self.sources, &self.stats, refine)
    }

    /// The precision in which coordinates are to be written.
    #[must_use]
    pub fn source_precision(&self) -> CoordinateType {
        let kept = || self.sources.iter().filter(|s| s.stats.any());
        if kept().all(|s| s.native == Native::F32) {
            return CoordinateType::F32;
        }
        let Ok(lattice) = self.choose_lattice(0) else {
            return CoordinateType::F64;
        };
        let bounds = kept().filter_map(Source::whole_bounds);
        let largest = bounds
            .flat_map(|b| b.into_iter().flatten())
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        enough_for(lattice.step, largest)
    }
}

/// The precision needed for writing multiples of `step` up to `largest`.
pub(crate) fn enough_for(step: f64, largest: f64) -> CoordinateType {
    // Rounding to single precision moves a coordinate by at most 2^-24 of the largest power of two not above
    // it; for zero this is zero.
    let half_unit = largest.log2().floor().exp2() * 2f64.powi(-24);
    if half_unit < step / 10.0 {
        CoordinateType::F32
    } else {
        CoordinateType::F64
    }
}
