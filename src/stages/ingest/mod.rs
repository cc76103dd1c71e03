//! Reads the input formats and converts points to lattice positions.
//!
//! [`ingest`] decodes every input once into a [`Spool`]: one scratch file with all points in their native
//! precision, and exact statistics of each file. [`Spool::choose_lattice`] then finds a common lattice, and
//! [`Spool::for_each`] streams the points as positions on it.
//!
//! Formats are detected by content: LAS 1.0 to 1.4 with point formats 0 to 10, LAZ (COPC included), PLY, and
//! text with one point in a line; any of them may be compressed with gzip or Zstandard. Each format is a module that implements `PointFormat`, and an entry of the
//! list in `formats.rs`.

mod belong;
mod classes;
mod contain;
mod crop;
mod crs;
mod expand;
mod format;
mod formats;
mod input;
mod las;
mod lattice;
mod map;
mod number;
mod ply;
mod point_format;
mod probe;
mod source;
mod spool;
mod stats;
mod stream;
mod text;

pub use classes::Classes;
pub use crop::Crop;
pub use expand::expand;
pub use format::Format;
pub use probe::{Probe, probe};
pub use stats::{FileStats, IngestStats};
pub use stream::READ_BUFFERS;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::workspace::Workspace;
use crop::Wanted;
use input::Input;
use point_format::{Claims, PointFile};
use serde::{Deserialize, Serialize};
use source::{Native, Source};
use spool::{Frame, SourceWriter};
use std::path::PathBuf;

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
}

/// All points of the inputs in one scratch file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Spool {
    name: String,
    frames: Vec<Frame>,
    sources: Vec<Source>,
    stats: IngestStats,
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
        crop: None,
    };
    ingest_selected(inputs, &selection, workspace)
}

/// As [`ingest`], but reads only selected points.
///
/// # Errors
/// See [`ingest`].
pub fn ingest_selected(
    inputs: &[PathBuf],
    selection: &Selection,
    workspace: &Workspace,
) -> Result<Spool> {
    let name = format!("ingest-{}.spool", workspace.number());
    let spool = read_all(inputs, selection, &name, workspace);
    if spool.is_err() && !workspace.is_resumable() {
        workspace.files.release(&name)?;
    }
    spool
}

/// Decodes all inputs into the spool `name`.
fn read_all(
    inputs: &[PathBuf],
    selection: &Selection,
    name: &str,
    workspace: &Workspace,
) -> Result<Spool> {
    let Selection { classes, crop } = selection;
    let wanted = crop.as_ref().map(|crop| Wanted::of(crop, workspace));
    let wanted = wanted.transpose()?;
    let (mut section, mut frames) = (0, Vec::new());
    let mut sources = Vec::new();
    let mut systems = Vec::new();
    let mut stats = IngestStats::default();
    let mut shared = false;
    for path in expand(inputs)? {
        workspace.check_cancel()?;
        let opened = Opened::new(Input::open(&path, workspace)?)?;
        let number = sources.len() as u32;
        let target = SourceWriter::new(workspace, name, section, number, classes)?
            .within(wanted.as_ref(), opened.claims.native);
        let outside =
            |wanted: &Wanted<'_>| opened.file.lies_outside(&opened.input, wanted, workspace);
        let mut warnings = if let Some(bounds) = wanted.as_ref().and_then(outside) {
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
        let source = Source {
            native: opened.claims.native,
            stats: target.stats(),
            text: opened.claims.text,
        };
        let shown = |w: String| format!("{}: {w}", path.display());
        stats.warnings.extend(warnings.into_iter().map(shown));
        stats.add(&opened, &source);
        systems.push(opened.file.crs(&opened.input));
        sources.push(source);
        let (next, more) = target.end();
        section = next;
        frames.extend(more);
    }
    if shared {
        return Err(Error::Shared);
    }
    if let Some(crop) = crop.as_ref().filter(|_| stats.kept == 0) {
        crop.check_met(&sources)?;
    }
    stats
        .warnings
        .extend(belong::warnings(&stats.files, &systems));
    Ok(Spool {
        name: name.to_owned(),
        frames,
        sources,
        stats,
    })
}

/// An input file with its header.
struct Opened {
    input: Input,
    file: Box<dyn PointFile>,
    claims: Claims,
}

impl Opened {
    fn new(input: Input) -> Result<Self> {
        let file = formats::open(&input)?;
        let claims = file.claims(&input);
        Ok(Self {
            input,
            file,
            claims,
        })
    }
}

impl IngestStats {
    fn add(&mut self, opened: &Opened, source: &Source) {
        let stats = &source.stats;
        self.read += stats.read;
        self.kept += stats.kept;
        self.dropped_non_finite += stats.dropped;
        self.withheld += stats.withheld;
        self.dropped_by_class += stats.unwanted;
        self.dropped_by_crop += stats.outside;
        self.skipped_by_crop += stats.skipped;
        let bounds = source.bounds();
        self.files.push(FileStats {
            path: opened.input.path.clone(),
            format: opened.claims.format,
            bytes: opened.input.size,
            claimed: opened.claims.points,
            points: stats.read,
            kept: stats.kept,
            dropped_non_finite: stats.dropped,
            withheld: stats.withheld,
            dropped_by_class: stats.unwanted,
            dropped_by_crop: stats.outside,
            skipped_by_crop: stats.skipped,
            min: bounds.map(|b| b[0]),
            max: bounds.map(|b| b[1]),
        });
    }
}

impl Spool {
    /// Counts and extents of the input.
    #[must_use]
    pub fn stats(&self) -> &IngestStats {
        &self.stats
    }

    /// Deletes the scratch file.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        workspace.files.release(&self.name)
    }

    /// Approximate bytes of the points in the spool.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let bytes = |source: &Source| source.stats.kept * source.native.point_bytes() as u64;
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
