//! Point clouds in bounded memory: all points in one scratch file, with what is known of them.
//!
//! A reader of files fills a [`Spool`] by [`spool::SourceWriter`]: all points in their native precision, and exact
//! statistics of each file. [`Spool::choose_lattice`] then finds a common lattice, and [`Spool::for_each`] streams the
//! points as positions on it. The readers are a crate on top of this one, `outcrop-formats`: what computes on points
//! knows no format and no server.

mod agree;
mod belong;
mod carry;
mod classes;
pub mod colors;
pub mod columns;
mod comments;
pub mod coordinate;
pub mod crop;
mod crs;
mod directions;
mod far;
mod format;
pub mod frames;
mod given;
pub mod kind;
mod lattice;
mod layout;
mod map;
mod middle;
pub mod native;
mod normals;
pub mod number;
mod precision;
mod prj;
mod ranks;
mod remote;
mod same;
pub mod source;
pub mod spool;
mod stats;
mod stream;
pub mod systems;
mod units;
pub mod wkt;

pub use carry::{Attribute, Carried};
pub use classes::Classes;
pub use colors::Depth;
pub use colors::depths_shown;
pub use columns::{Attributes, Column};
pub use crop::Crop;
pub use crs::{Crs, CrsSource};
pub use directions::{NORMAL_BYTES, direction};
pub use format::Format;
pub use given::GivenCrs;
pub use kind::CrsKind;
pub use layout::{Layout, TextColumns};
pub use precision::CoordinateType;
pub use precision::enough_for;
pub use prj::{of_prj, prj_of};
pub use remote::{Fetched, is_remote};
pub use stats::{FileStats, IngestStats, LeftOut, SourceStats};
pub use stream::{READ_BUFFERS, VALUE_BUFFERS};
pub use systems::Mixed;

use columns::row_bytes;
use frames::{Frame, values_of};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use serde::{Deserialize, Serialize};
use source::Source;
use std::path::PathBuf;

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

/// Reads what is selected of files and folders of clouds into a spool, as `outcrop_formats::ingest_selected` does: for
/// those that need points of files, and know no formats.
pub type Ingest = fn(&[PathBuf], &Selection, &Workspace) -> Result<Spool>;

impl Spool {
    /// The spool `name`, as it was written: its frames and those of values, of these sources.
    #[must_use]
    pub fn of(
        name: &str,
        (frames, values): (Vec<Frame>, Vec<Frame>),
        sources: Vec<Source>,
        stats: IngestStats,
        wkt: Option<String>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            frames,
            values,
            sources,
            stats,
            wkt,
        }
    }

    /// Counts and extents of the input.
    #[must_use]
    pub fn stats(&self) -> &IngestStats {
        &self.stats
    }

    /// The same, for what is known of the files beside their points.
    pub fn stats_mut(&mut self) -> &mut IngestStats {
        &mut self.stats
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
