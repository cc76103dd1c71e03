//! From triples to an oriented manifold (paper, section 3.5).
//!
//! The mesh is computed block by block:
//! 1. `base`: every vertex flags the T3 triangles that are not manifold at it; the others are oriented.
//! 2. `interior`: T12 candidates are inserted inside each block.
//! 3. `across`: T12 candidates between blocks are inserted, and tentative merges are confirmed or reverted.
//!
//! Both insertions use `insertion`, with the tests of `admissibility`. They are defined in sections 6 and 7
//! of `docs/method.md`.

mod across;
mod admissibility;
mod base;
mod components;
mod deferred;
mod insertion;
mod interior;
mod stats;
mod surroundings;

pub use stats::{BaseStats, InsertStats};

use crate::error::Result;
use crate::spill::Table;
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::surface::evidence::Division;
use crate::stages::surface::rows::{TriangleRow, TriangleTo};
use crate::stages::triples::Triples;
use crate::workspace::Workspace;
use crate::workspace::persist::persist;
use across::Across;
use interior::Interior;

/// The manifold mesh; triangles by ascending ids, orientable but not yet oriented.
#[derive(Debug)]
pub struct Stitched {
    /// Interior triangles by block.
    pub interior: Table<TriangleRow>,
    /// Additional triangles, for each block they touch: all crossing ones, and interior ones inserted late.
    pub added: Table<TriangleTo>,
    /// Triangles to be removed from `interior`.
    pub removed: Table<TriangleTo>,
}

/// The parameters of the extraction.
#[derive(Debug, Clone, Copy)]
pub struct StitchOptions {
    /// Cosine of the largest angle between the normals of a T12 triangle and its neighbours.
    pub cos_max_angle: f64,
    /// The division for orientation by evidence; `None` orients in the order of triangles.
    pub weigh: Option<Division>,
}

persist!(Stitched {
    interior,
    added,
    removed
});

/// Extracts the manifold.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn stitch(
    places: Places<'_>,
    triples: Triples,
    blocks: Blocks,
    options: StitchOptions,
    workspace: &Workspace,
) -> Result<(Stitched, BaseStats, InsertStats)> {
    let (base, mut counts) = base::base(places, triples, blocks, options.weigh, workspace)?;
    let interior = Interior::create(workspace, blocks.count())?;
    let cos = options.cos_max_angle;
    // The pass across blocks is short, and starts from the beginning when the run is resumed.
    let (crossing, inserted) = workspace.once("insert", || {
        let across = Across::new(&base, &interior, blocks, cos, workspace)?;
        let inside =
            || interior::insert_all(places, &base, &interior, blocks, cos, &across, workspace);
        let mut inserted = workspace.part("insert", inside)?;
        let (crossing, more) = workspace.part("cross", || across.finish())?;
        inserted.add(&more);
        Ok((crossing, inserted))
    })?;
    counts.mobius += inserted.cut;
    counts.triangles -= inserted.cut;
    let stitched = Stitched {
        interior: interior.mesh,
        added: crossing.added,
        removed: crossing.removed,
    };
    Ok((stitched, counts, inserted))
}
