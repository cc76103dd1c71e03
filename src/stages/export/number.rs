//! Numbers for the mesh's vertices and triangles.

use super::{MeshStats, Splits, block_bytes, triangles_around};
use crate::error::{Error, Result};
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::repair::Repaired;
use crate::stages::surface::star::{EDGES, Link, Star, has, sorted};
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use std::sync::Mutex;

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// Which points are vertices, and where everything goes in the file; an eighth of a byte a point.
#[derive(Debug)]
pub struct Numbering {
    /// A bit for each point, 64 a word, block by block.
    used: Vec<u64>,
    /// Vertices before each word.
    rank: Vec<u32>,
    blocks: Blocks,
    words_per_block: usize,
    firsts: Vec<Firsts>,
    /// `[id]` of each copy, by block.
    pub copies: Sections<1>,
    /// `[block of the triangle, i, j, k, vertex, block of the vertex, copy]`.
    pub splits: Splits,
    /// Totals.
    pub stats: MeshStats,
    _held: Reservation,
}

/// Counts of a block, later the sums over the blocks before it.
#[derive(Debug, Clone, Copy, Default)]
struct Firsts {
    used: u64,
    copies: u64,
    faces: u64,
}

impl Numbering {
    fn word(&self, v: u32) -> (usize, u32) {
        let block = self.blocks.of(v) as usize;
        let local = v - self.blocks.ids(block).start;
        (
            block * self.words_per_block + local as usize / 64,
            local % 64,
        )
    }

    /// True if a point is a vertex.
    pub fn used(&self, v: u32) -> bool {
        let (word, bit) = self.word(v);
        self.used[word] >> bit & 1 == 1
    }

    /// The number of a point that is a vertex.
    pub fn vertex(&self, v: u32) -> u32 {
        let (word, bit) = self.word(v);
        self.rank[word] + (self.used[word] & ((1 << bit) - 1)).count_ones()
    }

    /// Number of the first vertex of a block.
    pub fn first_used(&self, block: usize) -> u64 {
        self.firsts[block].used
    }

    /// Number of the first copy of a vertex of a block.
    pub fn first_copy(&self, block: usize) -> u64 {
        self.stats.points_used + self.firsts[block].copies
    }

    /// Number of the first triangle whose smallest vertex is in a block.
    pub fn first_face(&self, block: usize) -> u64 {
        self.firsts[block].faces
    }
}

/// What a block contributes.
struct BlockNumbers {
    used: Vec<u64>,
    copies: Vec<[u32; 1]>,
    splits: Vec<[u32; 7]>,
    faces: u64,
    boundary: u64,
}

/// Numbers everything.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`], [`Error::TooManyPoints`].
pub fn number(repaired: &Repaired, blocks: Blocks, workspace: &Workspace) -> Result<Numbering> {
    let count = blocks.count();
    let words_per_block = blocks.ids(0).len().div_ceil(64);
    let words = count * words_per_block;
    let held = workspace.reserve("export: numbers", (words * 12 + count * 24) as u64)?;
    let _exchange_held = workspace.reserve("exchange", EXCHANGE_BUFFER)?;
    let exchange = Exchange::<7>::new(workspace, "export.splits", EXCHANGE_BUFFER);
    let copies = Sections::create(workspace, "export.copies", count)?;
    let shared = Mutex::new((vec![0u64; words], vec![Firsts::default(); count], 0u64));
    let bytes = |block| block_bytes(repaired, blocks, block);
    workspace.for_each_unit("export: block", count, bytes, |block| {
        let numbers = number_block(repaired, blocks, block)?;
        exchange.send(&numbers.splits)?;
        copies.put(block, &numbers.copies)?;
        let mut shared = shared
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let start = block * words_per_block;
        shared.0[start..start + numbers.used.len()].copy_from_slice(&numbers.used);
        shared.1[block] = Firsts {
            used: numbers.used.iter().map(|w| u64::from(w.count_ones())).sum(),
            copies: numbers.copies.len() as u64,
            faces: numbers.faces,
        };
        shared.2 += numbers.boundary;
        drop(shared);
        workspace.observer.advance(1);
        Ok(())
    })?;
    let splits = exchange.deliver(workspace, count)?;
    let (used, mut firsts, boundary_edges) = shared
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut total = Firsts::default();
    for block in &mut firsts {
        let own = *block;
        *block = total;
        total.used += own.used;
        total.copies += own.copies;
        total.faces += own.faces;
    }
    let vertices = total.used + total.copies;
    let limit = u64::from(u32::MAX) - 1;
    if vertices > limit {
        return Err(Error::TooManyPoints {
            found: vertices,
            limit,
        });
    }
    let rank = used
        .iter()
        .scan(0u32, |before, w| {
            let rank = *before;
            *before += w.count_ones();
            Some(rank)
        })
        .collect();
    let stats = MeshStats {
        vertices,
        points_used: total.used,
        pinched_copies: total.copies,
        triangles: total.faces,
        boundary_edges,
    };
    Ok(Numbering {
        used,
        rank,
        blocks,
        words_per_block,
        firsts,
        copies,
        splits,
        stats,
        _held: held,
    })
}

fn number_block(repaired: &Repaired, blocks: Blocks, block: usize) -> Result<BlockNumbers> {
    let ids = blocks.ids(block);
    let triangles = triangles_around(repaired, block)?;
    let star = Star::of(ids.clone(), &triangles);
    let mut numbers = BlockNumbers {
        used: vec![0; ids.len().div_ceil(64)],
        copies: Vec::new(),
        splits: Vec::new(),
        faces: triangles
            .iter()
            .filter(|t| blocks.of(t[0]) == block as u32)
            .count() as u64,
        boundary: 0,
    };
    let mut link = Link::default();
    for v in ids.clone() {
        let at = star.at(v);
        if at.is_empty() {
            continue;
        }
        let local = (v - ids.start) as usize;
        numbers.used[local / 64] |= 1 << (local % 64);
        // Triangles are in ascending order, so fans are numbered by their smallest triangles.
        link.set(v, at.iter().map(|&n| triangles[n as usize]));
        let first = numbers.copies.len();
        for (index, &n) in at.iter().enumerate() {
            let fan = link.group(index);
            if fan > 0 {
                let t = sorted(triangles[n as usize]);
                let copy = (first + fan - 1) as u32;
                numbers
                    .splits
                    .push([blocks.of(t[0]), t[0], t[1], t[2], v, block as u32, copy]);
            }
        }
        for _ in 1..link.groups() {
            numbers.copies.push([v]);
        }
    }
    for (number, t) in triangles.iter().enumerate() {
        let t = sorted(*t);
        for (a, b, ..) in EDGES {
            let single = |&n: &u32| n as usize == number || !has(triangles[n as usize], t[b]);
            if ids.contains(&t[a]) && star.at(t[a]).iter().all(single) {
                numbers.boundary += 1;
            }
        }
    }
    Ok(numbers)
}
