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

use crate::surface::evidence::Division;
use crate::surface::rows::{TriangleRow, TriangleTo};
use crate::triples::Triples;
use across::Across;
use base::Base;
use interior::Interior;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, Table, release};
use outcrop_disk::workspace::Workspace;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::located::Places;
use serde::{Deserialize, Serialize};

/// The manifold mesh; triangles by ascending ids, orientable but not yet oriented.
#[derive(Debug, Serialize, Deserialize)]
pub struct Stitched {
    /// Interior triangles by block.
    pub interior: Table<TriangleRow>,
    /// Additional triangles, for each block they touch: all crossing ones, and interior ones inserted late.
    pub added: Shuffle<TriangleTo>,
    /// Triangles to be removed from `interior`.
    pub removed: Shuffle<TriangleTo>,
}

release!(Stitched: interior, added, removed);

/// The parameters of the extraction.
#[derive(Debug, Clone, Copy)]
pub struct StitchOptions {
    /// Cosine of the largest angle between the normals of a T12 triangle and its neighbours.
    pub cos_max_angle: f64,
    /// The division for orientation by evidence; `None` orients in the order of triangles.
    pub weigh: Option<Division>,
    /// True if others need the files of the triples afterwards.
    pub keep_triples: bool,
}

/// Input and output of the insertion of candidates.
#[derive(Clone, Copy)]
struct Insertion<'a> {
    places: Places<'a>,
    base: &'a Base,
    interior: &'a Interior,
    blocks: Blocks,
    cos_max_angle: f64,
    workspace: &'a Workspace,
}

/// Extracts the manifold. Deletes the files of `triples` on the way, unless they are to be kept.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn stitch(
    places: Places<'_>,
    triples: Triples,
    blocks: Blocks,
    options: StitchOptions,
    workspace: &Workspace,
) -> Result<(Stitched, BaseStats, InsertStats)> {
    let (base, mut counts) = base::base(places, &triples, blocks, options, workspace)?;
    let interior = Interior::new(blocks.count());
    // The pass across blocks is short, and starts from the beginning when the run is resumed.
    let (stitched, inserted, cut) = workspace.once("insert", |unit| {
        let insertion = Insertion {
            places,
            base: &base,
            interior: &interior,
            blocks,
            cos_max_angle: options.cos_max_angle,
            workspace,
        };
        let across = Across::new(insertion)?;
        let inside = || across.insert_inside(insertion);
        let (mut inserted, cut) = workspace.part("insert", inside)?;
        let (stitched, more) = workspace.part("cross", || across.finish(unit))?;
        inserted.add(&more);
        Ok((stitched, inserted, cut))
    })?;
    counts.mobius += cut;
    counts.triangles -= cut;
    base.release(workspace)?;
    if !options.keep_triples {
        triples.visiting.release(workspace)?;
    }
    interior.release(workspace)?;
    Ok((stitched, counts, inserted))
}
