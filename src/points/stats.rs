//! Statistics of the input: counts and extents of each file and in total.

use super::colors::Depth;
use super::coordinate::Coordinate;
use super::crs::Crs;
use super::format::Format;
use super::native::Native;
use super::remote::Fetched;
use super::systems::Mixed;
use serde::{Deserialize, Serialize, Serializer};
use std::path::{Path, PathBuf};

/// Counts of one run over all input files.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct IngestStats {
    /// Points in the files.
    pub read: u64,
    /// Points written to the spool.
    pub kept: u64,
    /// Points left out because a coordinate is infinite or NaN.
    pub dropped_non_finite: u64,
    /// Points left out because they are flagged as withheld.
    pub withheld: u64,
    /// Records of scans that the scanner marked as no point, since nothing came back.
    pub invalid: u64,
    /// Points left out because their class is not wanted.
    pub dropped_by_class: u64,
    /// Points left out because they are not in the region, nor within the margin around it.
    pub dropped_by_crop: u64,
    /// Points not read because their files or chunks lie outside, by header or chunk table.
    pub skipped_by_crop: u64,
    /// Points left out because they are far from all others, and the lattice is finer without them.
    pub dropped_far: u64,
    /// One of these.
    pub far_example: Option<[f64; 3]>,
    /// The reference system; none if no file gives one, or if files give different ones.
    pub crs: Option<Crs>,
    /// Two files that give different ones.
    #[serde(skip)]
    pub mixed: Option<Mixed>,
    /// The counts of each file, in the order given.
    pub files: Vec<FileStats>,
    /// Files in folders that were left out, since they are no scans.
    pub left_out: Vec<LeftOut>,
    /// Warnings for the user, one line each.
    pub warnings: Vec<String>,
}

/// Writes a path as text; bytes that are not UTF-8 are replaced.
fn as_text<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// A file in a folder that is not read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The file, or a folder with all in it.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Why.
    pub why: String,
}

/// Counts and extents of one input file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FileStats {
    /// The file.
    #[serde(serialize_with = "as_text")]
    pub path: PathBuf,
    /// Its format, detected by content.
    pub format: Format,
    /// Its size in bytes.
    pub bytes: u64,
    /// What was asked of the server, if it is on one.
    pub fetched: Option<Fetched>,
    /// Names of its columns beside the coordinates.
    pub columns: Vec<String>,
    /// Of text: which of its columns are read as what.
    pub taken: Option<String>,
    /// True if the file does not say so plainly.
    pub guessed: bool,
    /// The scale of its colours, if it has any and the scale is known.
    pub colors: Option<Depth>,
    /// Number of points given in the header; `None` for text.
    pub claimed: Option<u64>,
    /// Points in the file.
    pub points: u64,
    /// Points kept.
    pub kept: u64,
    /// Points left out because a coordinate is infinite or NaN.
    pub dropped_non_finite: u64,
    /// Points left out because they are flagged as withheld.
    pub withheld: u64,
    /// Records of scans that the scanner marked as no point, since nothing came back.
    pub invalid: u64,
    /// Points left out because their class is not wanted.
    pub dropped_by_class: u64,
    /// Points left out because they are not in the region, nor within the margin around it.
    pub dropped_by_crop: u64,
    /// Points not read because they are in chunks that lie outside, or the whole file does.
    pub skipped_by_crop: u64,
    /// Points left out because they are far from all others.
    pub dropped_far: u64,
    /// Lowest coordinates of the kept points, in the file's unit; `None` without points.
    pub min: Option<[f64; 3]>,
    /// Highest coordinates of the kept points, in the file's unit; `None` without points.
    pub max: Option<[f64; 3]>,
    /// The positions of the scanners given in the file, in its unit.
    pub scanners: Vec<[f64; 3]>,
    /// The reference system that it gives, or a `.prj` file beside it.
    pub crs: Option<Crs>,
}

/// Exact statistics of one source, in its native form; merging is commutative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SourceStats {
    /// Points in the file.
    pub read: u64,
    /// Points in the spool.
    pub kept: u64,
    /// Points left out because a coordinate is infinite or NaN.
    pub dropped: u64,
    /// Points left out because they are flagged as withheld.
    pub withheld: u64,
    /// Records that the scanner marked as no point.
    pub invalid: u64,
    /// Points left out because of their class.
    pub unwanted: u64,
    /// Points left out because of their position.
    pub outside: u64,
    /// Points not decoded because of their position, by the header or the chunk table.
    pub skipped: u64,
    /// Lowest coordinates, also of points left out because of their position.
    pub min: [f64; 3],
    /// Highest coordinates, likewise.
    pub max: [f64; 3],
    /// Lowest and highest coordinates of the kept points.
    pub own: [[f64; 3]; 2],
    /// All coordinates are multiples of 2 to the power of this; `i32::MAX` if all are zero.
    pub exponent: i32,
    /// Largest number of decimals in text, or [`NOT_FIXED`](super::number::NOT_FIXED).
    pub decimals: u32,
    /// Sum of the point counts given in count lines of a text file.
    pub claimed: u64,
    /// What lines of a PTX file have, as bits.
    pub kinds: u8,
}

/// The extent of no point.
const NOWHERE: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

impl Default for SourceStats {
    fn default() -> Self {
        Self {
            read: 0,
            kept: 0,
            dropped: 0,
            withheld: 0,
            invalid: 0,
            unwanted: 0,
            outside: 0,
            skipped: 0,
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            own: NOWHERE,
            exponent: i32::MAX,
            decimals: 0,
            claimed: 0,
            kinds: 0,
        }
    }
}

impl SourceStats {
    /// The same counts without points.
    pub(super) fn emptied(&self) -> Self {
        let Self {
            min,
            max,
            own,
            exponent,
            kept,
            ..
        } = Self::default();
        Self {
            min,
            max,
            own,
            exponent,
            kept,
            ..*self
        }
    }

    /// Takes a kept point with these native coordinates.
    pub(super) fn take(&mut self, point: [f64; 3], native: Native) {
        self.kept += 1;
        for (axis, value) in point.into_iter().enumerate() {
            let exponent = match native {
                Native::Las { .. } => 0,
                Native::F32 | Native::F64 => value.exponent(),
            };
            self.reach(axis, value, exponent);
            self.own[0][axis] = self.own[0][axis].min(value);
            self.own[1][axis] = self.own[1][axis].max(value);
        }
    }

    /// Extends the range of an axis by a coordinate that is a multiple of two to the power of `exponent`.
    #[inline]
    pub(super) fn reach(&mut self, axis: usize, value: f64, exponent: i32) {
        self.min[axis] = self.min[axis].min(value);
        self.max[axis] = self.max[axis].max(value);
        self.exponent = self.exponent.min(exponent);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.read += other.read;
        self.kept += other.kept;
        self.dropped += other.dropped;
        self.withheld += other.withheld;
        self.invalid += other.invalid;
        self.unwanted += other.unwanted;
        self.outside += other.outside;
        self.skipped += other.skipped;
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
            self.own[0][axis] = self.own[0][axis].min(other.own[0][axis]);
            self.own[1][axis] = self.own[1][axis].max(other.own[1][axis]);
        }
        self.exponent = self.exponent.min(other.exponent);
        self.decimals = self.decimals.max(other.decimals);
        self.claimed = self.claimed.saturating_add(other.claimed);
        self.kinds |= other.kinds;
    }

    /// Extends the range of coordinates by a point.
    #[inline]
    pub(super) fn reach_point<T: Coordinate>(&mut self, point: [T; 3]) {
        for (axis, coordinate) in point.into_iter().enumerate() {
            self.reach(axis, coordinate.into(), coordinate.exponent());
        }
    }

    /// True if a point has a place on the lattice, even if it is left out because of its position: so the
    /// lattice of a part of a cloud is that of the whole.
    pub(super) fn any(&self) -> bool {
        self.kept + self.outside + self.skipped > 0
    }
}
