//! Post-processing (paper, section 3.6): bridges, small components, orientation of components, holes.
//!
//! It works block by block and uses only triangles and positions, not the way in which the triangles were
//! found.

mod around;
mod boundary;
mod bridges;
mod components;
mod ear_clipping;
mod facing;
mod fill;
mod holes;
mod loops;
mod parts;
mod patch;
mod rim;
mod rows;
mod surface;
#[cfg(test)]
mod tests;

pub use rim::{NumberingInput, Vertices};
pub use surface::{ComponentRun, StoredSurface, Surface};

use crate::stitch::Stitched;
use boundary::LoopRules;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, release, row};
use outcrop_disk::workspace::Workspace;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, Triangle};
use outcrop_stages::located::Places;
use serde::{Deserialize, Serialize};

/// An oriented triangle, starting with its smallest vertex.
pub type OrientedTriangle = Triangle;

/// Rotates an oriented triangle so that it starts with its smallest vertex.
#[must_use]
pub fn from_smallest([a, b, c]: Triangle) -> OrientedTriangle {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// All different items, ascending.
fn ascending<T: Ord>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = items.into_iter().collect();
    all.sort_unstable();
    all.dedup();
    all
}

row! {
    /// An oriented triangle, starting with its smallest vertex.
    pub struct SurfaceTriangle {
        /// Ids.
        corners: OrientedTriangle,
    }
    packed Above Rising Left
}

row! {
    /// An oriented triangle that fills a hole, once for each block that it touches.
    pub struct FilledTriangle {
        /// Number of the block.
        to: Block,
        /// Ids in the triangle's orientation, starting with the smallest.
        triangle: OrientedTriangle,
    }
    packed Above Above Above Above
}

/// The finished surface.
#[derive(Debug, Serialize, Deserialize)]
pub struct Repaired {
    /// The triangles of each block, except those that fill holes.
    pub surface: StoredSurface,
    /// Triangles that fill holes.
    pub filled: Shuffle<FilledTriangle>,
    /// The input for numbering vertices and triangles.
    pub numbering: NumberingInput,
}

release!(Repaired: surface, filled, numbering);

/// The parameters of repair.
#[derive(Debug, Clone, Copy)]
pub struct RepairOptions {
    /// False: only orient the components.
    pub repair: bool,
    /// Components with fewer triangles are removed.
    pub min_component: u64,
    /// The same for components that are noisy.
    pub min_noisy_component: u64,
    /// Holes of up to this many edges are filled.
    pub max_hole_edges: usize,
    /// Close torn boundaries of any length by ear clipping, and do not fill openings.
    pub clip_ears: bool,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct RepairStats {
    /// Bridge triangles removed.
    pub bridges_removed: u64,
    /// Edge-connected components before the removal of small ones.
    pub components_found: u64,
    /// Components removed because they have too few triangles.
    pub components_removed: u64,
    /// Triangles of these components.
    pub component_triangles_removed: u64,
    /// Gaps closed: boundary loops of three edges. They are T0 triangles, which belong to the surface and are
    /// closed even if holes are not filled, and are not counted as holes.
    pub gaps_closed: u64,
    /// Boundary loops before filling.
    pub holes_found: u64,
    /// Holes filled.
    pub holes_filled: u64,
    /// Boundary loops of torn, open or wide parts that were processed by ear clipping, with or without
    /// effect.
    pub holes_clipped: u64,
    /// Boundary loops left open because they are outlines of the surface.
    pub holes_outline: u64,
    /// Boundary loops left open because they are too long.
    pub holes_too_long: u64,
    /// Holes left open because no valid triangulation was found.
    pub holes_not_filled: u64,
    /// Triangles added to fill holes.
    pub hole_triangles: u64,
}

impl RepairOptions {
    /// The smallest number of triangles of a component that is kept, and of one that is noisy.
    fn least(&self) -> [u64; 2] {
        match self.repair {
            true => [self.min_component, self.min_noisy_component],
            false => [0, 0],
        }
    }

    /// The rules for boundary loops; `None` if all stay open.
    fn filling<'a>(&self, places: Places<'a>) -> Option<LoopRules<'a>> {
        let filling = LoopRules {
            density: places.density,
            longest: self.max_hole_edges,
            clip_ears: self.clip_ears,
        };
        Some(filling).filter(|f| self.repair && (f.clip_ears || f.longest >= 3))
    }
}

adds!(
    RepairStats: bridges_removed, components_found, components_removed, component_triangles_removed,
    gaps_closed, holes_found, holes_filled, holes_clipped, holes_outline, holes_too_long, holes_not_filled,
    hole_triangles
);

/// Repairs and orients the surface. Deletes the files of `stitched` on the way: nobody else has them.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn repair(
    places: Places<'_>,
    stitched: Stitched,
    blocks: Blocks,
    options: RepairOptions,
    workspace: &Workspace,
) -> Result<(Repaired, RepairStats)> {
    let (surface, mut stats) = surface::build(places, &stitched, blocks, options, workspace)?;
    let limit = options.filling(places);
    let (filled, numbering) = holes::fill(places, &surface, limit, blocks, &mut stats, workspace)?;
    let repaired = Repaired {
        surface,
        filled,
        numbering,
    };
    Ok((repaired, stats))
}
