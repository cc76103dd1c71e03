//! Post-processing (paper, section 3.6): bridges, small components, facing, holes.
//!
//! Everything here looks only at triangles and positions, block by block; how the triangles were
//! chosen is not its business.

mod bridges;
mod facing;
mod fill;
mod holes;
mod loops;

use crate::error::Result;
use crate::spill::layouts::TRIANGLE;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::stitch::Stitched;
use crate::stages::surface::orient::orient;
use crate::stages::surface::star::Triangle;
use crate::workspace::Workspace;
use serde::Serialize;

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// A triangle as it runs, beginning with its smallest vertex.
pub type OrientedTriangle = [u32; 3];

/// A triangle as it runs from any vertex, beginning with its smallest.
#[must_use]
pub fn from_smallest([a, b, c]: [u32; 3]) -> OrientedTriangle {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The finished surface: for each block all triangles that touch it, as they run.
#[derive(Debug)]
pub struct Repaired {
    /// `[i, a, b, component]`, ascending by sorted ids.
    pub around: Sections<4>,
    /// Triangles that fill holes, `[block, i, a, b]`.
    pub filled: Sections<4>,
}

/// What repair should do.
#[derive(Debug, Clone, Copy)]
pub struct RepairOptions {
    /// Do anything at all; otherwise only orient.
    pub repair: bool,
    /// Remove components with fewer triangles.
    pub min_component: u64,
    /// Fill holes of up to this many edges.
    pub max_hole_edges: usize,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct RepairStats {
    /// Bridge triangles removed.
    pub bridges_removed: u64,
    /// Edge-connected components before small ones are removed.
    pub components_found: u64,
    /// Components with too few triangles, removed.
    pub components_removed: u64,
    /// Triangles in them.
    pub component_triangles_removed: u64,
    /// Boundary loops before filling.
    pub holes_found: u64,
    /// Holes filled.
    pub holes_filled: u64,
    /// Boundary loops left alone because they are an outline of the surface.
    pub holes_outline: u64,
    /// Boundary loops left alone because they are too long.
    pub holes_too_long: u64,
    /// Holes that could not be triangulated cleanly.
    pub holes_not_filled: u64,
    /// Triangles added to fill holes.
    pub hole_triangles: u64,
}

/// All triangles that touch each block, by ascending ids, after stitching.
fn gather(stitched: &Stitched, blocks: Blocks, workspace: &Workspace) -> Result<Sections<3>> {
    let around = Sections::with_layout(workspace, "repair.around", blocks.count(), TRIANGLE)?;
    let bytes =
        |b| 60 * (stitched.interior.records(b) + stitched.added.records(b)) as u64 + (1 << 20);
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let mut triangles: Vec<Triangle> = stitched.interior.get(block)?;
        let removed = stitched.removed.get(block)?;
        if !removed.is_empty() {
            let removed: rustc_hash::FxHashSet<Triangle> =
                removed.iter().map(|r| [r[1], r[2], r[3]]).collect();
            triangles.retain(|t| !removed.contains(t));
        }
        triangles.extend(
            stitched
                .added
                .get(block)?
                .iter()
                .map(|r| [r[1], r[2], r[3]]),
        );
        triangles.sort_unstable();
        around.put(block, &triangles)
    })?;
    Ok(around)
}

/// Repairs and orients the surface.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn repair(
    store: &PointStore,
    stitched: Stitched,
    blocks: Blocks,
    options: RepairOptions,
    workspace: &Workspace,
) -> Result<(Repaired, RepairStats)> {
    let mut stats = RepairStats::default();
    let gathered = gather(&stitched, blocks, workspace)?;
    drop(stitched);
    let bytes = |b: usize| {
        150 * gathered.records(b) as u64
            + u64::from(blocks.ids(b).end - blocks.ids(b).start) * 32
            + (1 << 20)
    };
    let removed = if options.repair {
        let removed = bridges::find(&gathered, bytes, blocks, workspace)?;
        stats.bridges_removed = own_records(&removed, blocks)?;
        Some(removed)
    } else {
        None
    };
    let current = |block: usize| -> Result<Vec<Triangle>> {
        let mut triangles = gathered.get(block)?;
        if let Some(removed) = &removed {
            let removed = removed.get(block)?;
            triangles.retain(|t| {
                removed
                    .binary_search(&[block as u32, t[0], t[1], t[2]])
                    .is_err()
            });
        }
        Ok(triangles)
    };
    let surface = orient("repair.surface", current, bytes, blocks, workspace)?;
    let least = if options.repair {
        options.min_component
    } else {
        0
    };
    let around = facing::face(store, &surface, least, blocks, &mut stats, workspace)?;
    drop(surface);
    drop(gathered);
    let filled = if options.repair && options.max_hole_edges >= 3 {
        holes::fill(
            store,
            &around,
            options.max_hole_edges,
            blocks,
            &mut stats,
            workspace,
        )?
    } else {
        Exchange::<4>::new(workspace, "repair.filled", 64).deliver(workspace, blocks.count())?
    };
    Ok((Repaired { around, filled }, stats))
}

/// Number of different triangles among records `[block, i, j, k]`.
fn own_records(records: &Sections<4>, blocks: Blocks) -> Result<u64> {
    let mut count = 0;
    for block in 0..blocks.count() {
        let mine = |r: &&[u32; 4]| blocks.of(r[1].min(r[2]).min(r[3])) == r[0];
        count += records.get(block)?.iter().filter(mine).count() as u64;
    }
    Ok(count)
}
