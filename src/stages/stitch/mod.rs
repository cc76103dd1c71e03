//! From triples to an oriented manifold (paper, section 3.5).
//!
//! The mesh is decided block by block: first every vertex flags what it refuses of T3, then the
//! rest is oriented, then T12 triangles are inserted, inside blocks first and across them after.
//! Sections 6 and 7 of `docs/method.md` define it.

mod base;
mod context;
mod crossing;
mod fans;
mod home;
mod interior;
mod mail;
mod tests_of_paper;

use crate::error::Result;
use crate::spill::Sections;
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::surface::evidence::Division;
use crate::stages::triples::Triples;
use crate::workspace::Workspace;
use crate::workspace::persist::persist;
use base::Base;
use crossing::Pass;
use interior::Interior;
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
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

/// How the manifold is extracted.
#[derive(Debug, Clone, Copy)]
pub struct StitchOptions {
    /// Cosine of the largest angle between the normals of a T12 triangle and its neighbours.
    pub cos_max_angle: f64,
    /// Orient by evidence, divided like this, instead of in the order of triangles.
    pub weigh: Option<Division>,
}

/// Counts of the base.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct BaseStats {
    /// T3 triangles flagged at non-manifold edges and vertices by excess.
    pub flagged: u64,
    /// T3 triangles left out because their points are on a line in the file, or a side is too long for the
    /// surface.
    pub unfit: u64,
    /// T3 triangles removed so that the rest can be oriented: they close a Möbius band.
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
    /// Not tried: its points are on a line in the file, or a side is too long for the surface.
    pub unfit: u64,
    /// Of the accepted, those taken out again because blocks joined components differently.
    pub joints_removed: u64,
    /// Triangles of the base that were cut; counted with those of the base.
    #[serde(skip)]
    cut: u64,
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

impl InsertStats {
    fn add(&mut self, more: &InsertStats) {
        self.accepted += more.accepted;
        self.unconnected += more.unconnected;
        self.full_edge += more.full_edge;
        self.excess += more.excess;
        self.angle += more.angle;
        self.orientation += more.orientation;
        self.unfit += more.unfit;
        self.joints_removed += more.joints_removed;
        self.cut += more.cut;
    }
}

persist!(Stitched {
    interior,
    added,
    removed
});
persist!(BaseStats {
    flagged,
    unfit,
    mobius,
    triangles
});
persist!(InsertStats {
    accepted,
    unconnected,
    full_edge,
    excess,
    angle,
    orientation,
    unfit,
    joints_removed,
    cut
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
    // The pass across blocks is short, and begins again when the run is resumed.
    let (crossing, inserted) = workspace.once("insert", || {
        let mut stats = InsertStats {
            unfit: base.flat_candidates,
            ..InsertStats::default()
        };
        let angle = options.cos_max_angle;
        let mut pass = Pass::new(&base, &interior, blocks, angle, workspace)?;
        let (pass_now, all) = (&mut pass, &mut stats);
        workspace.part("insert", || {
            insert(places, pass_now, &base, &interior, blocks, all, workspace)
        })?;
        workspace.part("cross", || {
            pass.advance(|_| true, None)?;
            let (crossing, more) = pass.finish()?;
            stats.add(&more);
            Ok((crossing, stats))
        })
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

/// Inserts inside all blocks, in the order in which the pass across them needs them; whoever has
/// finished a block takes the pass as far as it goes by then.
fn insert(
    places: Places<'_>,
    pass: &mut Pass<'_>,
    base: &Base,
    interior: &Interior,
    blocks: Blocks,
    stats: &mut InsertStats,
    workspace: &Workspace,
) -> Result<()> {
    let order = pass.order();
    let bytes = |unit: usize| interior::block_bytes(base, order[unit] as usize);
    // A turn of the pass takes only what the blocks at work cannot need.
    let most = (0..order.len()).map(bytes).max().unwrap_or(0);
    let spare = workspace.memory.available();
    let spare = spare.saturating_sub(most * workspace.threads as u64);
    let done: Vec<AtomicBool> = order.iter().map(|_| AtomicBool::new(false)).collect();
    let ready = |block: u32| done[block as usize].load(Ordering::Acquire);
    let angle = pass.cos_max_angle();
    let pass = Mutex::new(pass);
    let work = |unit: usize| {
        let block = order[unit] as usize;
        let counts = interior::insert(places, base, interior, blocks, block, angle)?;
        done[block].store(true, Ordering::Release);
        workspace.advance(1);
        // Or someone else is at it.
        if let Ok(mut pass) = pass.try_lock() {
            pass.advance(ready, Some(spare))?;
        }
        Ok(counts)
    };
    workspace.units("stitch: block", order.len(), bytes, work, |unit, counts| {
        done[order[unit] as usize].store(true, Ordering::Release);
        stats.add(&counts);
        Ok(())
    })
}
