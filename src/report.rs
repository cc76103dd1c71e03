//! What happened in a run, for machines: the content of `--report`.

use crate::params::Params;
pub use crate::stages::cells::CellStats;
pub use crate::stages::export::{CoordinateType, MeshStats};
pub use crate::stages::ingest::IngestStats;
pub use crate::stages::outliers::OutlierStats;
pub use crate::stages::repair::RepairStats;
pub use crate::stages::smooth::RelaxStats;
pub use crate::stages::stitch::{BaseStats, InsertStats};
pub use crate::stages::thin::ThinStats;
pub use crate::stages::triples::TripleStats;
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything a run counts and measures. Keys are stable; new ones may be added.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// Geometric parameters.
    pub parameters: Params,
    /// Memory budget in bytes.
    pub memory_budget: u64,
    /// Worker threads.
    pub threads: usize,
    /// Points and files read.
    pub input: IngestStats,
    /// Points that share their position with another one and were folded into it.
    pub duplicates_folded: u64,
    /// Thinning, if asked for.
    pub thin: ThinStats,
    /// Outliers, if they were to be dropped.
    pub outliers: OutlierStats,
    /// Points left: what the surface is made from.
    pub points: u64,
    /// The lattice that positions are kept on.
    pub lattice: LatticeReport,
    /// Disk radius in the input's unit; absent if it follows the local density.
    pub radius: Option<f64>,
    /// What relaxing did; none with `--relax 0`.
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
    /// Holes left: too long, outlines of the surface, and not cleanly triangulable.
    pub holes_left: u64,
    /// The mesh.
    pub mesh: MeshStats,
    /// Type of the coordinates in the file.
    pub coordinates: CoordinateType,
    /// Peak resident memory of the process in bytes.
    pub peak_resident_bytes: u64,
    /// Pages of mapped files among the resident memory: the program's code and its libraries.
    pub resident_file_bytes: u64,
    /// Peak of the memory held by name in bytes, the program's own among it.
    pub peak_held_bytes: u64,
    /// What it consisted of.
    pub held_at_peak: BTreeMap<&'static str, u64>,
    /// Peak of the memory reserved by name in bytes: what might have been taken at most.
    pub peak_reserved_bytes: u64,
    /// What it consisted of.
    pub reserved_at_peak: BTreeMap<&'static str, u64>,
    /// Disk space as the headers of the inputs let expect; none if one cannot be read by itself.
    pub estimated_first: Option<DiskEstimate>,
    /// Peak of the scratch space as estimated when the points were read and relaxed, in bytes.
    pub estimated_scratch_bytes: u64,
    /// Size of the mesh as estimated then.
    pub estimated_output_bytes: u64,
    /// Peak of the scratch space in bytes.
    pub peak_scratch_bytes: u64,
    /// Seconds in all.
    pub seconds: f64,
    /// Seconds and bytes of each stage, in order.
    pub stages: Vec<StageReport>,
    /// What the user should know, one line each.
    pub warnings: Vec<String>,
}

/// Disk space that a run will take, about.
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

/// Time and bytes of one stage.
#[derive(Debug, Clone, Serialize)]
pub struct StageReport {
    /// Name of the stage.
    pub name: &'static str,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Bytes read from files.
    pub bytes_read: u64,
    /// Bytes written to files.
    pub bytes_written: u64,
    /// Peak of the scratch space while it was at work, in bytes.
    pub scratch_bytes: u64,
    /// Peak of the memory held while it was at work, in bytes.
    pub held_bytes: u64,
    /// What the stage did one after the other, if it says so.
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
