//! The report of a run: the content of `--report`.

mod close;
mod simplify;

use crate::deliver::Uploaded;
use crate::params::Params;
pub use close::CloseReport;
pub use histogram::{Bin, Histogram};
pub use outcrop_disk::workspace::course::Sample;
use outcrop_draw::histogram;
#[cfg(feature = "pages")]
pub use outcrop_draw::picture::Picture;
#[cfg(feature = "levels")]
pub use outcrop_levels::TilesReport;
pub use outcrop_mesh::repair::RepairStats;
pub use outcrop_mesh::stitch::{BaseStats, InsertStats};
pub use outcrop_mesh::triples::TripleStats;
pub use outcrop_mesh_files::cut::CutStats;
pub use outcrop_mesh_files::export::{CoordinateType, MeshStats};
#[cfg(feature = "pages")]
pub use outcrop_pictures::mesh::Drawn;
pub use outcrop_points::{Attribute, IngestStats};
pub use outcrop_stages::cells::{CellStats, DiskStats};
pub use outcrop_stages::normals::NormalStats;
pub use outcrop_stages::outliers::OutlierStats;
pub use outcrop_stages::smooth::RelaxStats;
pub use outcrop_stages::thin::ThinStats;
use serde::Serialize;
#[cfg(feature = "levels")]
pub use simplify::Crossings;
pub use simplify::SimplifyReport;
use std::collections::BTreeMap;

/// The levels of detail of a build that makes none.
#[cfg(not(feature = "levels"))]
#[derive(Debug, Clone, Serialize, serde::Deserialize)]
pub enum TilesReport {}

#[cfg(not(feature = "levels"))]
impl TilesReport {
    pub(crate) fn told(&self, _: impl Fn(&outcrop_disk::error::Setting) -> String) -> String {
        match *self {}
    }
}

#[cfg(not(feature = "levels"))]
impl std::fmt::Display for TilesReport {
    fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {}
    }
}

/// All counts and measurements of a run. Keys are stable; new ones may be added.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// Version of the method: meshes of equal points and parameters are equal if it is.
    pub method_version: u32,
    /// Geometric parameters.
    pub parameters: Params,
    /// Memory budget in bytes.
    pub memory_budget: u64,
    /// Worker threads.
    pub threads: usize,
    /// Points and files read.
    pub input: IngestStats,
    /// Columns that the mesh keeps.
    pub attributes: Vec<Attribute>,
    /// Positions of the scanners whose side is out, in the input's unit.
    pub scanners: Vec<[f64; 3]>,
    /// The normals that points bring, if they are used.
    pub normals: Option<NormalsReport>,
    /// Points with the position of another one, dropped.
    pub duplicates_folded: u64,
    /// Thinning, if requested.
    pub thin: ThinStats,
    /// Outliers, if they were dropped.
    pub outliers: OutlierStats,
    /// Points from which the surface is made.
    pub points: u64,
    /// The lattice of the positions.
    pub lattice: LatticeReport,
    /// Disk radius in the input's unit; absent if it follows the local density.
    pub radius: Option<f64>,
    /// Counts of the noisy points; none with `--method paper` unless they are to move.
    pub relax: Option<RelaxStats>,
    /// Cells.
    pub cells: CellStats,
    /// Triples by count.
    pub triples: TripleStats,
    /// The base of T3 triangles.
    pub base: BaseStats,
    /// T12 candidates: accepted, and rejected by each test.
    pub insertion: InsertStats,
    /// Bridges, components and holes.
    pub repair: RepairStats,
    /// Holes left open: too long, outlines of the surface, or without a clean triangulation.
    pub holes_left: u64,
    /// The cut, if the mesh was cropped or divided.
    pub cut: CutStats,
    /// The mesh.
    pub mesh: MeshStats,
    /// The closing of the mesh, if it was closed; then `mesh` counts what it had before.
    pub closed: Option<CloseReport>,
    /// Levels of detail, if they were made.
    pub tiles: Option<TilesReport>,
    /// The mesh with fewer triangles, if it was asked for; `mesh` is then the one of which it was made.
    pub simplified: Option<SimplifyReport>,
    /// What was sent to a store, if the output is behind a URL.
    pub uploaded: Option<Uploaded>,
    /// Type of the coordinates in the file.
    pub coordinates: CoordinateType,
    /// The position of the cloud that is the origin of the mesh's coordinates; none if that is the same as the
    /// cloud's.
    pub origin: Option<[f64; 3]>,
    /// Peak resident memory of the process in bytes.
    pub peak_resident_bytes: u64,
    /// Mapped files in resident memory, in bytes: the program's code and its libraries.
    pub resident_file_bytes: u64,
    /// Peak of the memory in use by name in bytes, with that of the program.
    pub peak_held_bytes: u64,
    /// The memory in use at that peak.
    pub held_at_peak: BTreeMap<&'static str, u64>,
    /// Peak of the memory reserved by name in bytes, an upper bound of the usage.
    pub peak_reserved_bytes: u64,
    /// The reservations at that peak.
    pub reserved_at_peak: BTreeMap<&'static str, u64>,
    /// Disk space estimated from the headers of the inputs; none if there is no such estimate.
    pub estimated_first: Option<DiskEstimate>,
    /// Estimated peak of the scratch space after the points were read and relaxed, in bytes.
    pub estimated_scratch_bytes: u64,
    /// Estimated size of the mesh at that time, in bytes.
    pub estimated_output_bytes: u64,
    /// Peak of the scratch space in bytes.
    pub peak_scratch_bytes: u64,
    /// Seconds in all.
    pub seconds: f64,
    /// Seconds and bytes of each stage, in order.
    pub stages: Vec<StageReport>,
    /// Warnings for the user, one line each.
    pub warnings: Vec<String>,
    /// Distributions, and the course of the run, if pictures were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub details: Option<Details>,
    /// The pictures, if they were asked for.
    #[cfg(feature = "pages")]
    #[serde(skip)]
    pub pictures: Vec<Picture>,
}

/// Distributions, and the course of a run.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Details {
    /// Lengths of all edges, in the input's unit.
    pub edges: Option<Histogram>,
    /// Numbers of edges of the boundary loops; loops that meet at a vertex count as one.
    pub loops: Option<Histogram>,
    /// True if there are too many boundary edges for their loops to be counted.
    pub many_loops: bool,
    /// Numbers of triangles of the components, without those that fill holes; none of a cut mesh.
    pub components: Option<Histogram>,
    /// Local spacings of the points, by patch, in the input's unit.
    pub spacings: Option<Histogram>,
    /// Memory and disk over this attempt; nothing if tasks shared the run.
    pub course: Vec<Sample>,
    /// When stages of this attempt began.
    pub begun: Vec<PartReport>,
}

/// Estimated disk space of a run, in bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct DiskEstimate {
    /// Peak of the scratch files.
    pub scratch: u64,
    /// The mesh.
    pub output: u64,
    /// Peak of both together.
    pub together: u64,
}

/// The lattice, for the report.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LatticeReport {
    /// Length of a step in the input's unit.
    pub step: f64,
    /// True if every input position is on the lattice without rounding.
    pub exact: bool,
}

/// The normals that points bring, for the report.
#[derive(Debug, Clone, Default, Serialize)]
pub struct NormalsReport {
    /// The normals.
    #[serde(flatten)]
    pub input: NormalStats,
    /// The disks.
    #[serde(flatten)]
    pub disks: DiskStats,
}

/// Time and bytes of one stage.
#[derive(Debug, Clone, Serialize)]
pub struct StageReport {
    /// Name of the stage.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Processor time of all threads, in seconds.
    pub cpu_seconds: f64,
    /// Seconds that more threads would not have made shorter, if in all others every thread worked: `(threads × seconds −
    /// cpu_seconds) / (threads − 1)`.
    pub serial_seconds: f64,
    /// Bytes read from files.
    pub bytes_read: u64,
    /// Bytes written to files.
    pub bytes_written: u64,
    /// Peak of the scratch space during the stage, in bytes.
    pub scratch_bytes: u64,
    /// Peak of the memory in use during the stage, in bytes.
    pub held_bytes: u64,
    /// The sequential parts of the stage, if it measures them.
    pub parts: Vec<PartReport>,
}

/// Time of a part of a stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartReport {
    /// Name of the part.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
}
