//! Reads the input formats and converts points to lattice positions.
//!
//! [`ingest`] decodes every input once into a [`Spool`]: one scratch file with all points in their native
//! precision, and exact statistics of each file. [`Spool::choose_lattice`] then finds a common lattice, and
//! [`Spool::for_each`] streams the points as positions on it.
//!
//! Formats are detected by content: LAS 1.0 to 1.4 with point formats 0 to 10, LAZ (COPC included), E57,
//! PLY, PCD, PTX, OFF, and text with one point in a line; any of them may be compressed with gzip or Zstandard, or
//! the only cloud of a ZIP archive. Each format is a module that implements `PointFormat`, and an entry of the list in
//! `formats.rs`.

mod agree;
mod belong;
mod carry;
mod classes;
mod colors;
mod columns;
mod comments;
mod contain;
mod coordinate;
mod crop;
mod crs;
mod directions;
mod e57;
mod ept;
mod expand;
mod far;
mod folder;
mod foreign;
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
mod precision;
mod prj;
mod probe;
mod ptx;
mod ranks;
mod reading;
mod reads;
mod remote;
mod same;
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
pub use colors::Depth;
pub use colors::depths_shown;
pub use columns::{Attributes, Column};
pub use contain::hide_caught_panics;
pub use crop::Crop;
pub use crs::{Crs, CrsSource};
pub use directions::{NORMAL_BYTES, direction};
pub use expand::expand;
pub use format::Format;
pub use given::GivenCrs;
pub use kind::CrsKind;
pub use layout::{Layout, TextColumns};
pub use precision::CoordinateType;
pub use precision::enough_for;
pub use prj::{of_prj, prj_of};
pub use probe::{Probe, probe, probe_as, probe_near};
pub use reads::Reads;
pub use remote::{Fetched, Version, is_remote, version};
pub use stats::{FileStats, IngestStats, LeftOut};
pub use stream::{READ_BUFFERS, VALUE_BUFFERS};
pub use systems::Mixed;

use columns::row_bytes;
use frames::{Frame, values_of};
use input::Input;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use reading::{Opened, read_all};
use serde::{Deserialize, Serialize};
use source::Source;
use std::path::PathBuf;
use systems::Systems;

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
    /// True if the colours are read whose scale only their numbers tell, for [`FileStats::colors`].
    pub depths: bool,
    /// The reference system, whatever files say; `None` for theirs.
    pub crs: Option<GivenCrs>,
}

/// All points of the inputs in one scratch file. Its last reader takes the spool itself, and deletes the file.
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
/// [`outcrop_disk::error::Error::Input`] for a file that is not what it claims to be; [`outcrop_disk::error::Error::Io`],
/// [`outcrop_disk::error::Error::Disk`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn ingest(inputs: &[PathBuf], workspace: &Workspace) -> Result<Spool> {
    ingest_selected(inputs, &Selection::default(), workspace)
}

/// As [`ingest`], but reads only what is selected.
///
/// # Errors
/// See [`ingest`]; [`outcrop_disk::error::Error::Parameter`] for columns that no file has.
pub fn ingest_selected(
    inputs: &[PathBuf],
    selection: &Selection,
    workspace: &Workspace,
) -> Result<Spool> {
    let expanded = expand::expanded(inputs)?;
    let paths = &expanded.files;
    check_columns(paths, selection)?;
    let name = format!("ingest-{}.spool", workspace.number());
    let mut stats = IngestStats::default();
    let spool = read_all(paths, selection, &name, &mut stats, workspace).map(|mut spool| {
        let said = expanded.warning();
        spool.stats.warnings.splice(0..0, said);
        spool.stats.left_out = expanded.left_out;
        spool
    });
    if let Err(Error::Input { .. } | Error::Parameter { .. }) = spool
        && !workspace.is_task()
    {
        // They may explain the error.
        let warnings = stats.warnings.iter();
        warnings.for_each(|w| workspace.observer.warn(w));
    }
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

/// Checks that the headers of all files give one reference system. Files that cannot be read are passed over:
/// their error comes when they are read.
///
/// # Errors
/// [`Error::Input`] with two files whose systems are different.
pub fn check_systems(inputs: &[PathBuf]) -> Result<()> {
    let mut systems = Systems::default();
    for path in expand(inputs)? {
        let head = Input::open_head(&path, &formats::is_cloud, formats::LONG_HEAD);
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
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn release(self, workspace: &Workspace) -> Result<()> {
        if self.has_values() {
            workspace.files.release(&values_of(&self.name))?;
        }
        workspace.files.release(&self.name)
    }

    /// The spool, if it is read again; or else its scratch files are deleted.
    ///
    /// # Errors
    /// See [`Spool::release`].
    pub fn kept_if(self, again: bool, workspace: &Workspace) -> Result<Option<Self>> {
        match again {
            true => Ok(Some(self)),
            false => self.release(workspace).map(|()| None),
        }
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
    /// [`outcrop_disk::error::Error::Degenerate`] if there are no points.
    pub fn choose_lattice(&self, refine: u32) -> Result<Lattice> {
        lattice::choose(&self.sources, &self.stats, refine)
    }
}
