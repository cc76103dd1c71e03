//! Pieces: what each square has in each block, and where it is in the file of the square.

use super::divide::{Divided, Part};
use super::grid::Square;
use super::{Face, FarCorner, Normal};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Table, release};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_mesh::surface::star::sorted;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, Id, Triangle};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Most squares: each is a file.
const MOST_SQUARES: usize = 100_000;

/// The part of a square in a block.
#[derive(Debug, Clone)]
struct Piece {
    part: Part,
    block: Block,
    /// First numbers of its vertices, copies and triangles in the file of the square.
    firsts: [u64; 3],
}

/// A square: a mesh.
#[derive(Debug, Clone)]
pub struct Tile {
    /// The square.
    pub square: Square,
    /// Its pieces, by number.
    pub pieces: Range<usize>,
    /// Number of vertices, without further copies of pinched ones.
    pub points_used: u64,
    /// Further copies of pinched vertices.
    pub copies: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Edges with exactly one triangle.
    pub boundary_edges: u64,
    /// Lowest and highest lattice coordinates of the vertices.
    pub bounds: [Point; 2],
}

/// All pieces, ascending by square, then by block.
#[derive(Debug)]
pub struct Pieces {
    pieces: Vec<Piece>,
    tiles: Vec<Tile>,
    stored: StoredPieces,
    _held: Reservation,
}

/// The cut surface: what squares have in blocks, and the records of each piece.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StoredPieces {
    /// By block, ascending by square.
    parts: Table<Part>,
    vertices: Table<Id>,
    copies: Table<Id>,
    faces: Table<Face>,
    normals: Table<Normal>,
}

release!(StoredPieces: parts, vertices, copies, faces, normals);

/// Bytes of memory for a piece.
const PIECE: u64 = (size_of::<Piece>() + size_of::<Tile>()) as u64;

impl StoredPieces {
    /// The parts that the blocks wrote, and no pieces yet.
    pub(super) fn of(parts: Table<Part>, pieces: usize) -> Self {
        Self {
            parts,
            vertices: Table::new("cut.vertices", pieces),
            copies: Table::new("cut.copies", pieces),
            faces: Table::new("cut.faces", pieces),
            normals: Table::new("cut.normals", pieces),
        }
    }

    /// Number of pieces.
    #[must_use]
    pub fn count(&self) -> usize {
        self.vertices.count()
    }

    /// Opens the pieces.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::Memory`]; [`Error::Parameter`] if there are too many squares;
    /// [`Error::TooManyPoints`] if a mesh has more vertices than 32 bits can number.
    pub fn open(&self, workspace: &Workspace) -> Result<Pieces> {
        let held = workspace.reserve("cut: pieces", self.vertices.count() as u64 * PIECE)?;
        let mut pieces = Vec::with_capacity(self.vertices.count());
        let (unit, mut parts) = (workspace.unit(), Vec::new());
        for block in 0..self.parts.count() {
            self.parts.get_into(&unit, block, &mut parts)?;
            pieces.extend(parts.iter().map(|part| Piece {
                part: *part,
                block: Block::at(block),
                firsts: [0; 3],
            }));
        }
        pieces.sort_unstable_by_key(|p| (p.part.square, p.block));
        let mut tiles = Vec::new();
        for pieces in pieces.chunk_by_mut(|a, b| a.part.square == b.part.square) {
            let start = tiles.last().map_or(0, |tile: &Tile| tile.pieces.end);
            tiles.push(Tile::of(pieces, start)?);
        }
        if tiles.len() > MOST_SQUARES {
            return Err(Error::Parameter {
                name: "split",
                found: format!("a side that gives {} squares", tiles.len()),
                expected: format!("one that gives at most {MOST_SQUARES} meshes"),
            });
        }
        Ok(Pieces {
            pieces,
            tiles,
            stored: self.clone(),
            _held: held,
        })
    }
}

impl Tile {
    /// The square with these pieces, of which the first has the number `start`; numbers their records.
    fn of(pieces: &mut [Piece], start: usize) -> Result<Self> {
        let mut tile = Self {
            square: pieces[0].part.square,
            pieces: start..start + pieces.len(),
            points_used: 0,
            copies: 0,
            triangles: 0,
            boundary_edges: 0,
            bounds: pieces[0].part.bounds,
        };
        for piece in pieces.iter_mut() {
            piece.firsts = [tile.points_used, tile.copies, tile.triangles];
            let [vertices, copies, faces] = piece.part.counts.map(u64::from);
            tile.points_used += vertices;
            tile.copies += copies;
            tile.triangles += faces;
            tile.boundary_edges += u64::from(piece.part.boundary_edges);
            let [low, high] = &mut tile.bounds;
            for axis in 0..3 {
                low[axis] = low[axis].min(piece.part.bounds[0][axis]);
                high[axis] = high[axis].max(piece.part.bounds[1][axis]);
            }
        }
        let (found, limit) = (tile.points_used + tile.copies, u64::from(u32::MAX) - 1);
        if found > limit {
            return Err(Error::TooManyPoints { found, limit });
        }
        // Copies come after all other vertices.
        let first = tile.points_used;
        pieces.iter_mut().for_each(|p| p.firsts[1] += first);
        Ok(tile)
    }
}

impl Pieces {
    /// The squares, ascending.
    #[must_use]
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Number of pieces.
    #[must_use]
    pub fn count(&self) -> usize {
        self.pieces.len()
    }

    /// First numbers of a piece's vertices, copies and triangles in the file of its square.
    #[must_use]
    pub fn firsts(&self, piece: usize) -> [u64; 3] {
        self.pieces[piece].firsts
    }

    /// Number of a piece's vertices, copies and triangles.
    #[must_use]
    pub fn counts(&self, piece: usize) -> [u32; 3] {
        self.pieces[piece].part.counts
    }

    /// The ids of a piece's vertices, ascending; or of its copies.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`].
    pub fn ids(&self, unit: &Unit<'_>, piece: usize, copies: bool) -> Result<Vec<Id>> {
        match copies {
            true => self.stored.copies.get(unit, piece),
            false => self.stored.vertices.get(unit, piece),
        }
    }

    /// The triangles of a piece.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`].
    pub fn faces(&self, unit: &Unit<'_>, piece: usize) -> Result<Vec<Face>> {
        self.stored.faces.get(unit, piece)
    }

    /// The normals of a piece's vertices, then of its copies, if they are wanted.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`].
    pub fn normals(&self, unit: &Unit<'_>, piece: usize) -> Result<Vec<Normal>> {
        self.stored.normals.get(unit, piece)
    }

    fn find(&self, square: Square, block: Block) -> Option<usize> {
        let key = |p: &Piece| (p.part.square, p.block);
        self.pieces.binary_search_by_key(&(square, block), key).ok()
    }

    /// Writes what all squares have in a block; `far` has the numbers of vertices in other blocks.
    pub(super) fn write(
        &self,
        unit: &Unit<'_>,
        divided: &Divided,
        far: &[FarCorner],
        blocks: Blocks,
    ) -> Result<()> {
        let block = Block::at(unit.number());
        for part in divided.squares() {
            let square = part.square();
            let number = |v: Id, number: u32| {
                let piece = &self.pieces[self.find(square, blocks.of(v))?];
                let first = piece.firsts[number as usize & 1];
                Some((first + u64::from(number >> 1)) as u32)
            };
            let mut faces = Vec::new();
            for (t, numbers) in divided.faces(part) {
                let mut corners = [0; 3];
                for ((to, v), own) in corners.iter_mut().zip(t).zip(numbers) {
                    let key = (sorted(t), v);
                    let at = || far.binary_search_by_key(&key, |f| (f.triangle, f.vertex));
                    let sent = || at().ok().map(|at| far[at].number);
                    let found = own.or_else(sent).and_then(|n| number(v, n));
                    *to = found.ok_or_else(|| missing(unit, t, v))?;
                }
                faces.push(Face { corners, ids: t });
            }
            let Some(piece) = self.find(square, block) else {
                continue;
            };
            self.stored.vertices.put(unit, piece, part.vertices())?;
            self.stored.copies.put(unit, piece, part.copies())?;
            self.stored.faces.put(unit, piece, &faces)?;
            let normals = part.normals();
            if !normals.is_empty() {
                self.stored.normals.put(unit, piece, &normals)?;
            }
        }
        Ok(())
    }
}

/// The error for a number that no block sent: possible only in scratch files that were changed.
fn missing(unit: &Unit<'_>, triangle: Triangle, vertex: Id) -> Error {
    let (vertex, triangle) = (vertex.get(), triangle.map(Id::get));
    Error::Corrupt {
        path: unit.path("cut.far"),
        offset: 0,
        found: format!("no number of vertex {vertex} of triangle {triangle:?}"),
        expected: "one from its block".into(),
    }
}
