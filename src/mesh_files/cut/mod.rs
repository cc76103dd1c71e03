//! Cuts the finished surface: triangles outside a region are left out, the others are divided into the squares
//! of a grid. Each square becomes a mesh of its own, with its own numbers of vertices.
//!
//! It comes after everything that looks at the surroundings of a triangle, so that a cut decides nothing but
//! what is in a file. A vertex can be pinched in one file and not in another, so copies are made for each.
//!
//! Work is done by block, twice: first each block counts what it has of each square, and tells other blocks the
//! numbers of its vertices in their triangles; then vertices and triangles are written by *piece*, which is what
//! a square has in a block.

mod divide;
mod grid;
mod pieces;

pub use grid::{Grid, Square};
pub use pieces::{Pieces, StoredPieces, Tile};

use divide::Divided;
use outcrop_disk::error::{Error, Remedy, Result};
use outcrop_disk::spill::{Inbox, Shuffle, Table, row};
use outcrop_disk::workspace::memory::{Reservation, bytes_of};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::lattice::Lattice;
use outcrop_geom::region::{Area, Region};
use outcrop_mesh::repair::{FilledTriangle, Repaired, Surface};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, Id, Triangle};
use outcrop_stages::order::PointStore;
use serde::{Deserialize, Serialize};

row! {
    /// The number of a vertex of a triangle, sent to the block of the triangle's smallest vertex.
    pub struct FarCorner {
        /// The block of the smallest vertex.
        to: Block,
        /// Ids of the triangle, ascending.
        triangle: Triangle,
        /// The vertex.
        vertex: Id,
        /// Its number in its piece, as in `Divided`.
        number: u32,
    }
    packed Above Above Rising Rising Above Above
}

row! {
    /// A triangle of a piece, by the numbers of its vertices in the file of the square.
    pub struct Face {
        /// Numbers in the triangle's orientation.
        corners: [u32; 3],
        /// Ids of the same vertices.
        ids: Triangle,
    }
    packed Above Left Left Above Left Left
}

row! {
    /// The normal of a vertex of a piece.
    pub struct Normal {
        /// Its direction in the whole surface, so that there is no seam.
        direction: [f32; 3],
    }
    unpacked
}

/// The part of the surface that is written, and its division.
#[derive(Debug, Clone, Copy)]
pub struct CutOptions<'a> {
    /// Triangles with a vertex outside are left out.
    pub region: Option<&'a Region>,
    /// Side of the squares, in the input's unit; `None` for one square with everything.
    pub side: Option<f64>,
    /// Vertices have normals.
    pub normals: bool,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct CutStats {
    /// Triangles left out because a vertex is outside the region.
    pub triangles_outside: u64,
    /// Squares with a triangle: the number of meshes.
    pub squares: u64,
}

/// The input of the blocks.
struct Source<'a> {
    store: &'a PointStore,
    surface: Surface<'a>,
    filled: Inbox<FilledTriangle>,
    blocks: Blocks,
    lattice: &'a Lattice,
    area: Option<Area<'a>>,
    grid: Option<Grid>,
    normals: bool,
    _held: Reservation,
}

impl Source<'_> {
    /// Bytes of memory for a block.
    fn memory(&self, workspace: &Workspace, block: usize) -> u64 {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        let each = if self.normals { 320 } else { 260 };
        each * records as u64 + self.blocks.ids(block).len() as u64 * 60 + (1 << 20)
    }
}

/// Cuts the surface; `store` has the positions of the file.
///
/// # Errors
/// [`Error::Io`], [`Error::Corrupt`], [`Error::Memory`], [`Error::Cancelled`]; [`Error::NoTriangles`] if none is
/// left; [`Error::Parameter`] if there are too many squares.
pub fn cut(
    store: &PointStore,
    repaired: &Repaired,
    blocks: Blocks,
    lattice: &Lattice,
    options: CutOptions<'_>,
    workspace: &Workspace,
) -> Result<(StoredPieces, CutStats)> {
    let CutOptions {
        region,
        side,
        normals,
    } = options;
    let outline = region.map_or(0, Region::area_bytes);
    let source = Source {
        store,
        surface: repaired.surface.open(workspace)?,
        filled: repaired.filled.open(workspace, blocks.count())?,
        blocks,
        lattice,
        _held: workspace.reserve("crop: outline", outline)?,
        area: region.map(Region::area),
        grid: side.map(|side| Grid::new(lattice, side)),
        normals,
    };
    let far = Shuffle::new("cut.far");
    let count = blocks.count();
    let parts = Table::new("cut.parts", count);
    let (mut outside, mut pieces) = (0, 0);
    let memory = |block| source.memory(workspace, block);
    let work = |unit: &Unit<'_>| {
        let divided = Divided::of(unit, &source)?;
        let _held = unit.hold(divided.bytes());
        far.send(unit, unit.number(), divided.far_corners(blocks))?;
        let rows = divided.parts();
        parts.put(unit, unit.number(), &rows)?;
        unit.advance(1);
        Ok((divided.outside, rows.len()))
    };
    workspace.units("cut: divide", count, memory, work, |_, (more, rows)| {
        outside += more;
        pieces += rows;
        Ok(())
    })?;
    let stored = StoredPieces::of(parts, pieces);
    let pieces = stored.open(workspace)?;
    let stats = CutStats {
        triangles_outside: outside,
        squares: pieces.tiles().len() as u64,
    };
    if stats.squares == 0 {
        return Err(nothing_left(region, outside));
    }
    let inbox = far.open(workspace, count)?;
    let work = |unit: &Unit<'_>| {
        let divided = Divided::of(unit, &source)?;
        let far = inbox.get(unit, unit.number())?;
        let _held = unit.hold(divided.bytes() + bytes_of(&far));
        pieces.write(unit, &divided, &far, blocks)?;
        unit.advance(1);
        Ok(())
    };
    workspace.units("cut: number", count, memory, work, |_, ()| Ok(()))?;
    far.release(workspace)?;
    Ok((stored, stats))
}

fn nothing_left(region: Option<&Region>, outside: u64) -> Error {
    match region {
        Some(region) => Error::no_triangles(format!(
            "all {outside} of the points around it have a corner outside {region}"
        ))
        .with(Remedy::Larger("crop")),
        None => Error::no_triangles("the cells agree on none"),
    }
}
