//! Post-processing (paper, section 3.6): bridges, small components, facing, holes; and flips of edges.
//!
//! Everything here looks only at triangles and positions, block by block; how the triangles were
//! chosen is not its business.

mod around;
mod bridges;
mod components;
mod facing;
mod fill;
mod flips;
mod holes;
mod loops;
mod mend;
mod parts;
mod patch;
mod rim;
mod rows;
mod surface;
#[cfg(test)]
mod tests;
mod zip;

pub use rim::Outline;
pub use surface::{Run, Surface};

use crate::error::Result;
use crate::spill::{Table, row};
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::stitch::Stitched;
use crate::workspace::Workspace;
use crate::workspace::persist::persist;
use mend::Mending;
use serde::Serialize;

const SHUFFLE_BUFFER: u64 = 8 << 20;

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

row! {
    /// A triangle as it runs, beginning with its smallest vertex.
    pub struct SurfaceTriangle {
        /// Ids.
        corners: OrientedTriangle,
    }
    packed Above Rising Left
}

row! {
    /// A triangle that fills a hole, for each block that it touches.
    pub struct FilledTriangle {
        /// Number of the block.
        to: u32,
        /// Ids as it runs, beginning with the smallest.
        triangle: OrientedTriangle,
    }
    packed Above Above Above Above
}

/// The finished surface.
#[derive(Debug)]
pub struct Repaired {
    /// The triangles of each block, but for those that fill holes.
    pub surface: Surface,
    /// Triangles that fill holes.
    pub filled: Table<FilledTriangle>,
    /// What the numbers of the mesh follow from.
    pub outline: Outline,
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
    /// Flip edges where the surface bends less for it.
    pub flip: bool,
    /// Close torn boundaries of any length as far as they are torn; do not fill openings.
    pub zip: bool,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct RepairStats {
    /// Edges flipped.
    pub edges_flipped: u64,
    /// Bridge triangles removed.
    pub bridges_removed: u64,
    /// Edge-connected components before small ones are removed.
    pub components_found: u64,
    /// Components with too few triangles, removed.
    pub components_removed: u64,
    /// Triangles in them.
    pub component_triangles_removed: u64,
    /// Boundary loops of three edges that were closed before holes are counted: T0 triangles, which
    /// belong to the surface whether holes are filled or not.
    pub gaps_closed: u64,
    /// Boundary loops before filling.
    pub holes_found: u64,
    /// Holes filled.
    pub holes_filled: u64,
    /// Boundary loops that are torn, open or wide, closed in part, which may be nowhere.
    pub holes_zipped: u64,
    /// Boundary loops left alone because they are an outline of the surface.
    pub holes_outline: u64,
    /// Boundary loops left alone because they are too long.
    pub holes_too_long: u64,
    /// Holes that could not be triangulated cleanly.
    pub holes_not_filled: u64,
    /// Triangles added to fill holes.
    pub hole_triangles: u64,
}

impl RepairOptions {
    /// The least triangles of a component that stays.
    fn least(&self) -> u64 {
        if self.repair { self.min_component } else { 0 }
    }

    /// How boundary loops are treated; `None` if they all stay as they are.
    fn filling<'a>(&self, places: Places<'a>) -> Option<Mending<'a>> {
        let filling = Mending {
            density: places.density,
            longest: self.max_hole_edges,
            zip: self.zip,
        };
        Some(filling).filter(|f| self.repair && (f.zip || f.longest >= 3))
    }
}

impl RepairStats {
    fn add(&mut self, more: &Self) {
        self.edges_flipped += more.edges_flipped;
        self.bridges_removed += more.bridges_removed;
        self.components_found += more.components_found;
        self.components_removed += more.components_removed;
        self.component_triangles_removed += more.component_triangles_removed;
        self.gaps_closed += more.gaps_closed;
        self.holes_found += more.holes_found;
        self.holes_filled += more.holes_filled;
        self.holes_zipped += more.holes_zipped;
        self.holes_outline += more.holes_outline;
        self.holes_too_long += more.holes_too_long;
        self.holes_not_filled += more.holes_not_filled;
        self.hole_triangles += more.hole_triangles;
    }
}

persist!(Repaired {
    surface,
    filled,
    outline
});
persist!(RepairStats {
    edges_flipped,
    bridges_removed,
    components_found,
    components_removed,
    component_triangles_removed,
    gaps_closed,
    holes_found,
    holes_filled,
    holes_zipped,
    holes_outline,
    holes_too_long,
    holes_not_filled,
    hole_triangles
});

/// Repairs and orients the surface.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn repair(
    places: Places<'_>,
    stitched: Stitched,
    blocks: Blocks,
    options: RepairOptions,
    workspace: &Workspace,
) -> Result<(Repaired, RepairStats)> {
    let (surface, mut stats) = workspace.once("surface", || {
        surface::build(places, stitched, blocks, options, workspace)
    })?;
    let limit = options.filling(places);
    let (filled, outline) = holes::fill(places, &surface, limit, blocks, &mut stats, workspace)?;
    let repaired = Repaired {
        surface,
        filled,
        outline,
    };
    Ok((repaired, stats))
}
