//! Numbering of the mesh's vertices and triangles in the file.

use super::MeshStats;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Inbox, Shuffle, Table, release, row};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_mesh::repair::{FilledTriangle, NumberingInput, Vertices};
use outcrop_mesh::surface::star::{Link, Star, Triangle, sorted};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, Id};
use serde::{Deserialize, Serialize};

/// The points that are vertices, and the numbers of all vertices and triangles in the file. With the bits of
/// `vertices` it takes a fifth of a byte for each point.
#[derive(Debug)]
pub struct Numbering {
    vertices: Vertices,
    /// The number of vertices before each word of their bits.
    rank: Vec<u32>,
    firsts: Vec<Firsts>,
    /// The points of the copies, by block.
    pub copies: Table<Id>,
    /// The corners that use copies, by block of the triangle.
    pub splits: Inbox<Split>,
    /// The file of `splits`.
    sent: Shuffle<Split>,
    /// Counts of the mesh.
    pub stats: MeshStats,
    _held: Reservation,
}

release!(Numbering: copies, sent);

row! {
    /// A corner of a triangle that uses a copy of its pinched vertex.
    pub struct Split {
        /// Block of the triangle.
        to: Block,
        /// Ids of the triangle, ascending.
        triangle: Triangle,
        /// The pinched vertex.
        vertex: Id,
        /// The block of this vertex.
        block: Block,
        /// Number of the copy within that block.
        copy: u32,
    }
    packed Above Above Above Above Above Above Above
}

/// Counts of a block; later the sums over all blocks before it.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Firsts {
    copies: u64,
    faces: u64,
}

impl Numbering {
    /// True if a point is a vertex.
    pub fn used(&self, v: Id) -> bool {
        let v = v.index();
        self.vertices.used[v / 64] >> (v % 64) & 1 == 1
    }

    /// The number of a point if it is a vertex, else that of the next point that is one.
    pub fn vertex(&self, v: Id) -> u32 {
        let v = v.index();
        let below = self.vertices.used[v / 64] & ((1 << (v % 64)) - 1);
        self.rank[v / 64] + below.count_ones()
    }

    /// Number of the first copy in a block.
    pub fn first_copy(&self, block: usize) -> u64 {
        self.stats.points_used + self.firsts[block].copies
    }

    /// Number of the first triangle whose smallest vertex is in a block.
    pub fn first_face(&self, block: usize) -> u64 {
        self.firsts[block].faces
    }
}

/// Numbers all vertices and triangles.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`], [`Error::TooManyPoints`].
pub fn number(
    input: &NumberingInput,
    filled: &Inbox<FilledTriangle>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<Numbering> {
    let count = blocks.count();
    let bits = input.open(workspace)?;
    let words = bits.used.len();
    let held = workspace.reserve("export: numbers", (words * 4 + count * 16) as u64)?;
    let (mut firsts, copies, sent): (Vec<Firsts>, _, Shuffle<Split>) =
        workspace.once("number", |unit| split(unit, input, filled, blocks))?;
    let mut total = Firsts::default();
    for block in &mut firsts {
        let own = *block;
        *block = total;
        total.copies += own.copies;
        total.faces += own.faces;
    }
    let points_used = bits.used.iter().map(|w| u64::from(w.count_ones())).sum();
    let vertices = points_used + total.copies;
    let limit = u64::from(u32::MAX) - 1;
    if vertices > limit {
        return Err(Error::TooManyPoints {
            found: vertices,
            limit,
        });
    }
    let mut before = 0;
    let mut rank = Vec::with_capacity(words);
    for word in &bits.used {
        rank.push(before);
        before += word.count_ones();
    }
    let stats = MeshStats {
        vertices,
        points_used,
        pinched_copies: total.copies,
        triangles: total.faces,
        boundary_edges: input.boundary_edges,
    };
    Ok(Numbering {
        vertices: bits,
        rank,
        firsts,
        copies,
        splits: sent.open(workspace, count)?,
        sent,
        stats,
        _held: held,
    })
}

/// Counts the vertices and triangles of each block, copies its pinched vertices, and lists the corners that
/// use copies.
fn split(
    unit: &Unit<'_>,
    input: &NumberingInput,
    filled: &Inbox<FilledTriangle>,
    blocks: Blocks,
) -> Result<(Vec<Firsts>, Table<Id>, Shuffle<Split>)> {
    let shuffle = Shuffle::new("export.splits");
    let copies = Table::new("export.copies", blocks.count());
    let mut firsts = Vec::with_capacity(blocks.count());
    for block in 0..blocks.count() {
        unit.check_cancel()?;
        let records = input.pinched.rows(unit, block)? + filled.rows(block);
        let pinches = input.pinches.get(unit, block)?;
        let size = blocks.ids(block).len() * 8 * usize::from(!pinches.is_empty());
        let _held = unit.reserve("export: block", (120 * records + size) as u64)?;
        let filled = filled.get(unit, block)?;
        let own = |f: &&FilledTriangle| blocks.of(f.triangle[0]) == f.to;
        let faces = u64::from(input.faces[block]) + filled.iter().filter(own).count() as u64;
        let mut again = Vec::new();
        if !pinches.is_empty() {
            let mut triangles: Vec<Triangle> = bytemuck::cast_vec(input.pinched.get(unit, block)?);
            triangles.extend(filled.iter().map(|f| f.triangle));
            triangles.sort_unstable_by_key(|t| sorted(*t));
            let (copied, splits) = split_block(&pinches, &triangles, blocks, block);
            shuffle.send(unit, block, splits)?;
            again = copied;
        }
        firsts.push(Firsts {
            copies: again.len() as u64,
            faces,
        });
        copies.put(unit, block, &again)?;
        unit.advance(1);
    }
    Ok((firsts, copies, shuffle))
}

/// Copies the pinched vertices of a block; returns the copies, and the corners that use them.
pub fn split_block(
    pinches: &[Id],
    triangles: &[Triangle],
    blocks: Blocks,
    block: usize,
) -> (Vec<Id>, Vec<Split>) {
    let star = Star::of(blocks.ids(block), triangles);
    let mut link = Link::default();
    let mut copies = Vec::new();
    let mut splits = Vec::new();
    for &v in pinches {
        let at = star.at(v);
        // Triangles ascend, so fans are numbered by their smallest triangles.
        link.set(v, at.iter().map(|&n| triangles[n.index()]));
        for (index, &n) in at.iter().enumerate() {
            if let Some(fan) = link.group(index).checked_sub(1) {
                let t = sorted(triangles[n.index()]);
                let copy = (copies.len() + fan) as u32;
                splits.push(Split {
                    to: blocks.of(t[0]),
                    triangle: t,
                    vertex: v,
                    block: Block::at(block),
                    copy,
                });
            }
        }
        copies.extend((1..link.groups()).map(|_| v));
    }
    (copies, splits)
}
