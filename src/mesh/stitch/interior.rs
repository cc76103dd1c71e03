//! T12 insertion inside blocks (paper, section 3.5, second part): candidates whose vertices are all in one
//! block. Blocks are independent.

mod work;

use super::Insertion;
use super::components::{Merge, Reference};
use super::insertion::{CandidateRow, insert_candidates};
use super::stats::InsertStats;
use crate::surface::rows::TriangleRow;
use crate::surface::star::Triangle;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, release, row};
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_stages::ids::Id;
use work::BlockWork;

row! {
    /// A triangle and its component.
    pub struct TriangleIn {
        /// Ids, ascending.
        triangle: Triangle,
        /// See [`BlockComponents::reference`].
        component: Reference,
    }
    packed Above Rising Rising Above
}

row! {
    /// A vertex and its position.
    pub struct VertexAt {
        /// The vertex.
        id: Id,
        /// Its position.
        position: Point,
    }
    packed Above Above Above Above
}

/// Output of the blocks, for the insertion across blocks.
#[derive(Debug)]
pub struct Interior {
    /// Interior triangles of the mesh, ascending, by block.
    pub mesh: Table<TriangleRow>,
    /// Tentative merges, in the order of insertion.
    pub merges: Table<Merge>,
    /// Interior triangles at context vertices.
    pub context: Table<TriangleIn>,
    /// Vertices of these triangles and of the crossing base, and the context vertices, ascending.
    pub vertices: Table<VertexAt>,
    /// Crossing candidates with their smallest vertex in the block, and interior ones that failed test I only
    /// and touch a crossing triple; ascending.
    pub ranked: Table<CandidateRow>,
}

release!(Interior: merges, context, vertices, ranked);

impl Interior {
    /// The tables for `count` blocks.
    pub fn new(count: usize) -> Self {
        Self {
            mesh: Table::new("stitch.mesh", count),
            merges: Table::new("stitch.merges", count),
            context: Table::new("stitch.context", count),
            vertices: Table::new("stitch.vertices", count),
            ranked: Table::new("stitch.ranked", count),
        }
    }
}

/// Upper estimate of the bytes for a block.
pub(super) fn block_bytes(insertion: Insertion<'_>, block: usize) -> u64 {
    let (base, workspace) = (insertion.base, insertion.workspace);
    let interior = base.surface.interior.expected_rows(workspace, block);
    let triangles = interior + base.surface.crossing.rows(block);
    let candidates = base.candidates.expected_rows(workspace, block)
        + base.crossing.expected_rows(workspace, block);
    let records = triangles + candidates + base.visiting.rows(block);
    180 * records as u64 + (4 << 20)
}

/// Inserts the interior candidates of a block; returns the counts, and how many triangles of the base were
/// cut.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub(super) fn insert(
    insertion: Insertion<'_>,
    block: usize,
    unit: &Unit<'_>,
) -> Result<(InsertStats, u64)> {
    let mut held = unit.hold(0);
    let mut work = BlockWork::load(insertion, block, &mut held, unit)?;
    let mut counts = InsertStats {
        unfit: work.flat,
        ..InsertStats::default()
    };
    let mut undecided = std::mem::take(&mut work.candidates);
    let angle = insertion.cos_max_angle;
    insert_candidates(&mut work, &mut undecided, angle, &mut counts);
    let _undecided = unit.hold(bytes_of(&undecided));
    let out = insertion.interior;
    work.write(out, block, &undecided, &mut counts, &mut held, unit)?;
    Ok((counts, work.cut))
}
