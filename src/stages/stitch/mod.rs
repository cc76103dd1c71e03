//! From triples to an oriented manifold (paper, section 3.5).
//!
//! The mesh is decided block by block: first every vertex flags what it refuses of T3, then the
//! rest is oriented, then T12 triangles are inserted, inside blocks first and across them after.
//! See the semantics in `ARCHITECTURE.md`.

mod base;
mod crossing;
mod interior;
mod tests_of_paper;

pub use tests_of_paper::normal;

use crate::error::Result;
use crate::spill::Sections;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::surface::orient::orient;
use crate::stages::triples::Triples;
use crate::workspace::Workspace;
use serde::Serialize;
use std::sync::Mutex;
use tests_of_paper::Refusal;

/// The mesh after manifold extraction; triangles by ascending ids, orientable, not yet oriented.
#[derive(Debug)]
pub struct Stitched {
    /// Interior triangles by block, `[i, j, k]`.
    pub interior: Sections<3>,
    /// Triangles to add, `[block, i, j, k]`, for each block they touch: all crossing ones, and
    /// interior ones inserted late.
    pub added: Sections<4>,
    /// Triangles to take out of `interior`, `[block, i, j, k]`.
    pub removed: Sections<4>,
}

/// Counts of the base.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct BaseStats {
    /// T3 triangles flagged at non-manifold edges and vertices by excess.
    pub flagged: u64,
    /// T3 triangles removed because they close a Möbius band.
    pub mobius: u64,
    /// Triangles of the base.
    pub triangles: u64,
}

/// What became of the candidates.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct InsertStats {
    /// Inserted.
    pub accepted: u64,
    /// Test I: not properly connected to the mesh.
    pub unconnected: u64,
    /// Test II: an edge with two triangles.
    pub full_edge: u64,
    /// Test III: a vertex by excess.
    pub excess: u64,
    /// Geometric test: normals too different.
    pub angle: u64,
    /// Test IV: would close a Möbius band.
    pub orientation: u64,
    /// Of the accepted, those taken out again because blocks joined components differently.
    pub joints_removed: u64,
}

impl InsertStats {
    fn refuse(&mut self, refusal: Refusal) {
        match refusal {
            Refusal::Unconnected => self.unconnected += 1,
            Refusal::FullEdge => self.full_edge += 1,
            Refusal::Excess => self.excess += 1,
            Refusal::Angle => self.angle += 1,
        }
    }
}

/// Counts that several blocks add to.
#[derive(Debug, Default)]
pub(crate) struct SharedStats(Mutex<InsertStats>);

impl SharedStats {
    fn add(&self, more: &InsertStats) {
        let mut all = self
            .0
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        all.accepted += more.accepted;
        all.unconnected += more.unconnected;
        all.full_edge += more.full_edge;
        all.excess += more.excess;
        all.angle += more.angle;
        all.orientation += more.orientation;
        all.joints_removed += more.joints_removed;
    }
}

/// Extracts the manifold.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn stitch(
    store: &PointStore,
    triples: Triples,
    blocks: Blocks,
    cos_max_angle: f64,
    workspace: &Workspace,
) -> Result<(Stitched, BaseStats, InsertStats)> {
    let triples = &triples;
    let flags = base::flag(triples, blocks, workspace)?;
    let around = |block| base::base_around(triples, &flags, block);
    let bytes = |block| base::block_bytes(triples, block);
    let mut base = orient("stitch.base", around, bytes, blocks, workspace)?;
    let mut counts = BaseStats {
        mobius: base.mobius,
        triangles: base.triangles,
        flagged: 0,
    };
    for block in 0..blocks.count() {
        let flagged = flags.get(block)?;
        counts.flagged += flagged.iter().filter(|r| blocks.of(r[1]) == r[0]).count() as u64;
    }
    let stats = SharedStats::default();
    let interior = interior::insert(
        store,
        triples,
        &flags,
        &base,
        blocks,
        cos_max_angle,
        &stats,
        workspace,
    )?;
    let crossing = crossing::insert(
        store,
        triples,
        &flags,
        &mut base,
        &interior,
        blocks,
        cos_max_angle,
        &stats,
        workspace,
    )?;
    let inserted = stats
        .0
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let stitched = Stitched {
        interior: interior.mesh,
        added: crossing.added,
        removed: crossing.removed,
    };
    Ok((stitched, counts, inserted))
}
