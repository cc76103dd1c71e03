//! The parts of a mesh file: of the whole surface, by block; of a square of a cut one, by piece.

use super::MeshStats;
use super::corners::Corners;
use super::faces::Faces;
use super::normals::{Normals, Sources};
use super::number::Numbering;
use crate::cut::{Face, Normal, Pieces, Tile};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Table};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_mesh::repair::{FilledTriangle, Surface};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Ids, Triangle};
use outcrop_stages::order::PointStore;

/// The parts of a mesh. In the file the vertices of all parts come first, then the copies of pinched vertices
/// of all parts, then their triangles.
pub trait Parts: Sync {
    /// Number of parts.
    fn count(&self) -> usize;

    /// Counts of the mesh.
    fn stats(&self) -> MeshStats;

    /// Numbers in the file of a part's first vertex, first copy and first triangle.
    fn firsts(&self, part: usize) -> [u64; 3];

    /// Most points and triangles in memory for a part.
    fn sizes(&self, workspace: &Workspace, part: usize) -> [u64; 2];

    /// Ids of the points that are the part's vertices, ascending; or of its copies, likewise.
    fn vertices(&self, unit: &Unit<'_>, part: usize, copies: bool) -> Result<Vec<Id>>;

    /// Bytes of memory for the normals of a part of these sizes.
    fn normals_estimate(points: u64, triangles: u64) -> u64;

    /// The normals of these vertices.
    fn normals(
        &self,
        unit: &Unit<'_>,
        part: usize,
        copies: bool,
        ids: &[Id],
    ) -> Result<Vec<[f32; 3]>>;

    /// The normals of a part's vertices, then of its copies, from scratch.
    fn stored_normals(&self, unit: &Unit<'_>, part: usize) -> Result<Vec<Normal>>;

    /// The part's triangles.
    fn faces(&self, unit: &Unit<'_>, part: usize) -> Result<Loaded<'_>>;
}

/// The triangles of a part.
pub enum Loaded<'a> {
    /// Of a block, with its ids.
    Block(Faces<'a>, Ids),
    /// Of a piece.
    Piece(Vec<Face>),
}

impl Loaded<'_> {
    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Block(faces, _) => faces.bytes(),
            Self::Piece(faces) => bytes_of(faces),
        }
    }

    /// Passes on all triangles: the numbers of their vertices in the file, and their ids.
    pub fn for_each(&self, mut put: impl FnMut([u32; 3], Triangle)) {
        match self {
            Self::Block(faces, _) => faces.for_each(put),
            Self::Piece(faces) => faces.iter().for_each(|f| put(f.corners, f.ids)),
        }
    }

    /// The positions of the corners.
    pub fn corners(&self, store: &PointStore) -> Result<Corners> {
        match self {
            Self::Block(faces, ids) => Corners::load(store, *ids, faces.ids()),
            Self::Piece(faces) => {
                Corners::load(store, Ids::default(), faces.iter().map(|f| &f.ids))
            }
        }
    }
}

/// The parts of the whole surface: blocks.
pub struct Whole<'a> {
    /// Positions.
    pub store: &'a PointStore,
    /// Triangles, except those that fill holes.
    pub surface: Surface<'a>,
    /// Triangles that fill holes.
    pub filled: Inbox<FilledTriangle>,
    /// Vertices that may have copies.
    pub pinches: &'a Table<Id>,
    /// Numbers of vertices and triangles.
    pub numbering: Numbering,
    /// Normals by block, if [they were made](super::stored::make).
    pub normals: Table<Normal>,
    /// Division into blocks.
    pub blocks: Blocks,
}

/// Normals of vertices, and of copies of vertices.
type Both = (Vec<[f32; 3]>, Vec<[f32; 3]>);

impl Whole<'_> {
    /// The normals of these vertices of a block, and of all its copies.
    pub fn both_normals(&self, unit: &Unit<'_>, block: usize, ids: &[Id]) -> Result<Both> {
        let sources = Sources {
            store: self.store,
            surface: &self.surface,
            filled: &self.filled,
            pinches: self.pinches,
            blocks: self.blocks,
        };
        let normals = Normals::of(unit, &sources, block)?;
        let _held = unit.hold(normals.bytes());
        let block = self.blocks.ids(block);
        let own = |v: &Id| normals.points[block.place(*v)];
        Ok((ids.iter().map(own).collect(), normals.copies))
    }
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
        let copy = numbering.first_copy(block);
        [first.into(), copy, numbering.first_face(block)]
    }

    fn sizes(&self, workspace: &Workspace, block: usize) -> [u64; 2] {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        [self.blocks.ids(block).len() as u64, records as u64]
    }

    fn vertices(&self, unit: &Unit<'_>, block: usize, copies: bool) -> Result<Vec<Id>> {
        if copies {
            return self.numbering.copies.get(unit, block);
        }
        let ids = self.blocks.ids(block);
        Ok(ids.iter().filter(|v| self.numbering.used(*v)).collect())
    }

    fn normals_estimate(points: u64, triangles: u64) -> u64 {
        Normals::estimate(points, triangles)
    }

    fn normals(
        &self,
        unit: &Unit<'_>,
        block: usize,
        copies: bool,
        ids: &[Id],
    ) -> Result<Vec<[f32; 3]>> {
        let own = if copies { &[] } else { ids };
        let (own, of_copies) = self.both_normals(unit, block, own)?;
        Ok(if copies { of_copies } else { own })
    }

    fn stored_normals(&self, unit: &Unit<'_>, block: usize) -> Result<Vec<Normal>> {
        self.normals.get(unit, block)
    }

    fn faces(&self, unit: &Unit<'_>, block: usize) -> Result<Loaded<'_>> {
        let ids = self.blocks.ids(block);
        let numbering = &self.numbering;
        let (surface, filled) = (&self.surface, &self.filled);
        let faces = Faces::load(unit, block, surface, filled, numbering, ids)?;
        Ok(Loaded::Block(faces, ids))
    }
}

/// The parts of a square: pieces.
#[derive(Clone, Copy)]
pub struct OfTile<'a> {
    /// All pieces.
    pub pieces: &'a Pieces,
    /// The square.
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

    fn sizes(&self, _: &Workspace, part: usize) -> [u64; 2] {
        let counts = self.pieces.counts(self.tile.pieces.start + part);
        let [vertices, copies, faces] = counts.map(u64::from);
        // A range of points is read if a fourth of it is wanted.
        [4 * (vertices + copies), faces]
    }

    fn vertices(&self, unit: &Unit<'_>, part: usize, copies: bool) -> Result<Vec<Id>> {
        let piece = self.tile.pieces.start + part;
        self.pieces.ids(unit, piece, copies)
    }

    fn normals_estimate(points: u64, _: u64) -> u64 {
        24 * points
    }

    fn normals(
        &self,
        unit: &Unit<'_>,
        part: usize,
        copies: bool,
        ids: &[Id],
    ) -> Result<Vec<[f32; 3]>> {
        let mut all = self.stored_normals(unit, part)?;
        let first = all.len().saturating_sub(ids.len());
        match copies {
            true => drop(all.drain(..first)),
            false => all.truncate(ids.len()),
        }
        all.resize(ids.len(), Default::default());
        Ok(all.into_iter().map(|normal| normal.direction).collect())
    }

    fn stored_normals(&self, unit: &Unit<'_>, part: usize) -> Result<Vec<Normal>> {
        self.pieces.normals(unit, self.tile.pieces.start + part)
    }

    fn faces(&self, unit: &Unit<'_>, part: usize) -> Result<Loaded<'_>> {
        let piece = self.tile.pieces.start + part;
        self.pieces.faces(unit, piece).map(Loaded::Piece)
    }
}
