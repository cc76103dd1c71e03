//! The parts of a mesh file: of the whole surface, by block; of a square of a cut one, by piece.

use super::MeshStats;
use super::faces::Faces;
use super::number::Numbering;
use crate::error::Result;
use crate::spill::Inbox;
use crate::stages::blocks::Blocks;
use crate::stages::cut::{Pieces, Tile};
use crate::stages::repair::{FilledTriangle, Surface};
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};

/// The parts of a mesh. In the file the vertices of all parts come first, then the copies of pinched vertices
/// of all parts, then their triangles.
pub trait Parts: Sync {
    /// Number of parts.
    fn count(&self) -> usize;

    /// Counts of the mesh.
    fn stats(&self) -> MeshStats;

    /// Numbers in the file of a part's first vertex, first copy and first triangle.
    fn firsts(&self, part: usize) -> [u64; 3];

    /// Bytes of memory for reading a part.
    fn memory(&self, workspace: &Workspace, part: usize) -> u64;

    /// Ids of the points that are the part's vertices, ascending; or of its copies.
    fn vertices(&self, unit: &Unit<'_>, part: usize, copies: bool) -> Result<Vec<u32>>;

    /// Passes the part's triangles to `put`, by the numbers of their vertices in the file.
    fn triangles(&self, unit: &Unit<'_>, part: usize, put: impl FnMut([u32; 3])) -> Result<()>;
}

/// The parts of the whole surface: blocks.
pub struct Whole<'a> {
    pub surface: Surface<'a>,
    pub filled: Inbox<FilledTriangle>,
    pub numbering: Numbering,
    pub blocks: Blocks,
}

impl Parts for Whole<'_> {
    fn count(&self) -> usize {
        self.blocks.count()
    }

    fn stats(&self) -> MeshStats {
        self.numbering.stats
    }

    fn firsts(&self, block: usize) -> [u64; 3] {
        let numbering = &self.numbering;
        let first = numbering.vertex(self.blocks.ids(block).start);
        [
            first.into(),
            numbering.first_copy(block),
            numbering.first_face(block),
        ]
    }

    fn memory(&self, workspace: &Workspace, block: usize) -> u64 {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        60 * records as u64 + self.blocks.ids(block).len() as u64 * 60 + (1 << 20)
    }

    fn vertices(&self, unit: &Unit<'_>, block: usize, copies: bool) -> Result<Vec<u32>> {
        let numbering = &self.numbering;
        if copies {
            let copies = numbering.copies.get(unit, block)?;
            return Ok(copies.iter().map(|c| c.id).collect());
        }
        let ids = self.blocks.ids(block);
        Ok(ids.filter(|v| numbering.used(*v)).collect())
    }

    fn triangles(&self, unit: &Unit<'_>, block: usize, put: impl FnMut([u32; 3])) -> Result<()> {
        let ids = self.blocks.ids(block);
        let faces = Faces::load(
            unit,
            block,
            &self.surface,
            &self.filled,
            &self.numbering,
            ids,
        )?;
        let _held = unit.hold(faces.bytes());
        faces.for_each(put);
        Ok(())
    }
}

/// The parts of a square: pieces.
#[derive(Clone, Copy)]
pub struct OfTile<'a> {
    pub pieces: &'a Pieces,
    pub tile: &'a Tile,
}

impl Parts for OfTile<'_> {
    fn count(&self) -> usize {
        self.tile.pieces.len()
    }

    fn stats(&self) -> MeshStats {
        let tile = self.tile;
        MeshStats {
            vertices: tile.points_used + tile.copies,
            points_used: tile.points_used,
            pinched_copies: tile.copies,
            triangles: tile.triangles,
            boundary_edges: tile.boundary_edges,
        }
    }

    fn firsts(&self, part: usize) -> [u64; 3] {
        self.pieces.firsts(self.tile.pieces.start + part)
    }

    fn memory(&self, _: &Workspace, part: usize) -> u64 {
        let [vertices, copies, faces] = self.pieces.counts(self.tile.pieces.start + part);
        60 * (u64::from(vertices) + u64::from(copies) + u64::from(faces)) + (1 << 20)
    }

    fn vertices(&self, unit: &Unit<'_>, part: usize, copies: bool) -> Result<Vec<u32>> {
        let piece = self.tile.pieces.start + part;
        Ok(bytemuck::cast_vec(self.pieces.ids(unit, piece, copies)?))
    }

    fn triangles(&self, unit: &Unit<'_>, part: usize, put: impl FnMut([u32; 3])) -> Result<()> {
        let faces = self.pieces.faces(unit, self.tile.pieces.start + part)?;
        let _held = unit.hold(bytes_of(&faces));
        faces.iter().map(|face| face.corners).for_each(put);
        Ok(())
    }
}
