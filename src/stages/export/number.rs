//! Numbering of the mesh's vertices and triangles in the file.

use super::MeshStats;
use crate::error::{Error, Result};
use crate::spill::{Id, Shuffle, Table, row};
use crate::stages::blocks::Blocks;
use crate::stages::repair::{FilledTriangle, Repaired};
use crate::stages::surface::star::{Link, Star, Triangle, sorted};
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;

const SHUFFLE_BUFFER: u64 = 8 << 20;

/// The points that are vertices, and the numbers of all vertices and triangles in the file. With the bits of
/// `used` it takes a fifth of a byte for each point.
#[derive(Debug)]
pub struct Numbering<'a> {
    /// One bit for each point, 64 in a word.
    used: &'a [u64],
    /// The number of vertices before each word.
    rank: Vec<u32>,
    firsts: Vec<Firsts>,
    /// The points of the copies, by block.
    pub copies: Table<Id>,
    /// The corners that use copies, by block of the triangle.
    pub splits: Table<Split>,
    /// Counts of the mesh.
    pub stats: MeshStats,
    _held: Reservation,
}

row! {
    /// A corner of a triangle that uses a copy of its pinched vertex.
    pub struct Split {
        /// Block of the triangle.
        to: u32,
        /// Ids of the triangle, ascending.
        triangle: [u32; 3],
        /// The pinched vertex.
        vertex: u32,
        /// The block of this vertex.
        block: u32,
        /// Number of the copy within that block.
        copy: u32,
    }
    packed Above Above Above Above Above Above Above
}

/// Counts of a block; later the sums over all blocks before it.
#[derive(Debug, Clone, Copy, Default)]
struct Firsts {
    copies: u64,
    faces: u64,
}

crate::workspace::persist::persist!(Firsts { copies, faces });

impl Numbering<'_> {
    /// True if a point is a vertex.
    pub fn used(&self, v: u32) -> bool {
        self.used[v as usize / 64] >> (v % 64) & 1 == 1
    }

    /// The number of a point if it is a vertex, else that of the next point that is one.
    pub fn vertex(&self, v: u32) -> u32 {
        let below = self.used[v as usize / 64] & ((1 << (v % 64)) - 1);
        self.rank[v as usize / 64] + below.count_ones()
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
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`], [`Error::TooManyPoints`].
pub fn number<'a>(
    repaired: &'a Repaired,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<Numbering<'a>> {
    let count = blocks.count();
    let input = &repaired.numbering;
    let words = input.used.len();
    let held = workspace.reserve("export: numbers", (words * 4 + count * 16) as u64)?;
    let (mut firsts, copies, splits): (Vec<Firsts>, _, _) =
        workspace.once("number", || split(repaired, blocks, workspace))?;
    let mut total = Firsts::default();
    for block in &mut firsts {
        let own = *block;
        *block = total;
        total.copies += own.copies;
        total.faces += own.faces;
    }
    let points_used = input.used.iter().map(|w| u64::from(w.count_ones())).sum();
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
    for word in &input.used {
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
        used: &input.used,
        rank,
        firsts,
        copies,
        splits,
        stats,
        _held: held,
    })
}

/// Counts the vertices and triangles of each block, copies its pinched vertices, and lists the corners that
/// use copies.
fn split(
    repaired: &Repaired,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(Vec<Firsts>, Table<Id>, Table<Split>)> {
    let input = &repaired.numbering;
    let shuffle = Shuffle::new(workspace, "export.splits", SHUFFLE_BUFFER)?;
    let copies = Table::create(workspace, "export.copies", blocks.count())?;
    let mut firsts = Vec::with_capacity(blocks.count());
    for block in 0..blocks.count() {
        workspace.check_cancel()?;
        let records = input.pinched.rows(block) + repaired.filled.rows(block);
        let pinches = input.pinches.get(block)?;
        let size = blocks.ids(block).len() * 8 * usize::from(!pinches.is_empty());
        let _held = workspace.reserve("export: block", (120 * records + size) as u64)?;
        let filled = repaired.filled.get(block)?;
        let own = |f: &&FilledTriangle| blocks.of(f.triangle[0]) == f.to;
        let faces = u64::from(input.faces[block]) + filled.iter().filter(own).count() as u64;
        let mut again = Vec::new();
        if !pinches.is_empty() {
            let mut triangles: Vec<Triangle> = input
                .pinched
                .get(block)?
                .into_iter()
                .map(|t| t.corners)
                .collect();
            triangles.extend(filled.iter().map(|f| f.triangle));
            triangles.sort_unstable_by_key(|t| sorted(*t));
            again = split_block(&pinches, &triangles, blocks, block, &shuffle)?;
        }
        firsts.push(Firsts {
            copies: again.len() as u64,
            faces,
        });
        copies.put(block, &again)?;
        workspace.observer.advance(1);
    }
    Ok((firsts, copies, shuffle.deliver(workspace, blocks.count())?))
}

/// Copies the pinched vertices of a block, and sends the corners that use the copies to the blocks of their
/// triangles.
fn split_block(
    pinches: &[Id],
    triangles: &[[u32; 3]],
    blocks: Blocks,
    block: usize,
    shuffle: &Shuffle<Split>,
) -> Result<Vec<Id>> {
    let star = Star::of(blocks.ids(block), triangles);
    let mut link = Link::default();
    let mut copies = Vec::new();
    let mut splits = Vec::new();
    for &Id { id: v } in pinches {
        let at = star.at(v);
        // Triangles ascend, so fans are numbered by their smallest triangles.
        link.set(v, at.iter().map(|&n| triangles[n as usize]));
        for (index, &n) in at.iter().enumerate() {
            if let Some(fan) = link.group(index).checked_sub(1) {
                let t = sorted(triangles[n as usize]);
                let copy = (copies.len() + fan) as u32;
                splits.push(Split {
                    to: blocks.of(t[0]),
                    triangle: t,
                    vertex: v,
                    block: block as u32,
                    copy,
                });
            }
        }
        copies.extend((1..link.groups()).map(|_| Id { id: v }));
    }
    shuffle.send(&splits)?;
    Ok(copies)
}
