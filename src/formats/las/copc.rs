//! COPC: the boxes of chunks, from the hierarchy of an octree. Chunks whose box is outside a region are not
//! decoded.
//!
//! The chunk table says what chunks there are; the hierarchy only adds boxes to some of them. So a hierarchy
//! that is damaged, or that lacks nodes, can make more to be decoded, and never less points to be found.

use super::super::input::{Input, u32_at, u64_at};
use super::super::reads::{Means, Reads};
use super::Header;
use super::table::Chunk;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::boxes::BoxTree;
use outcrop_points::crop::Nearby;
use std::collections::BTreeSet;

/// Bytes of the header of a variable-length record, and of the COPC info record.
const RECORD_HEAD: u64 = 54;
const INFO: usize = 160;

/// Bytes of an entry of the hierarchy.
const ENTRY: usize = 32;

/// Bytes of a page that are read at a time: no buffer has the size that a file claims.
const PIECE: u64 = 1 << 20;

/// Deepest level of an octree: the numbers of its nodes are 32-bit integers.
const DEEPEST: i32 = 30;

/// A chunk that the hierarchy knows.
#[derive(Debug)]
struct Node {
    /// Offset of the chunk.
    at: u64,
    /// Its size in bytes, and its points.
    bytes: u32,
    points: u32,
    /// Its cube.
    bounds: [[f64; 3]; 2],
}

/// The cube of the octree.
struct Cube {
    low: [f64; 3],
    side: f64,
}

/// The hierarchy, and the memory reservation for it.
#[derive(Debug)]
pub(super) struct Hierarchy {
    /// Ascending by offset.
    nodes: Vec<Node>,
    _memory: Reservation,
}

/// Bytes of memory for an entry: its node, its place in the tree, and that in a selection.
const MEMORY: u64 = size_of::<Node>() as u64 + BoxTree::<f64>::BYTES + 8;

/// Content that cannot be: damage, as found and where.
type Damage = String;

impl Hierarchy {
    /// Reads the hierarchy; `None` if the file is no COPC.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Memory`]; inside, the reason why it cannot be used.
    pub(super) fn read(
        input: &Input,
        header: &Header,
        means: Means<'_>,
    ) -> Result<Option<Result<Self, Damage>>> {
        let at = u64::from(header.raw.header_size);
        let mut record = [0; RECORD_HEAD as usize + INFO];
        if at + record.len() as u64 > header.data {
            return Ok(None);
        }
        input.read_exact_at(at, &mut record, "first variable-length record")?;
        // The first record of a COPC file, user "copc" and number 1.
        if !record[2..].starts_with(b"copc\0") || record[18..20] != [1, 0] {
            return Ok(None);
        }
        let info = &record[RECORD_HEAD as usize..];
        let number = |n: usize| f64::from_bits(u64_at(info, 8 * n));
        let half = number(3);
        let cube = Cube {
            low: [0, 1, 2].map(|axis| number(axis) - half),
            side: 2.0 * half,
        };
        if !(half > 0.0 && cube.low.iter().all(|c| c.is_finite()) && cube.side.is_finite()) {
            return Ok(Some(Err(format!("a cube of half size {half}"))));
        }
        let root = (u64_at(info, 40), u64_at(info, 48));
        Self::pages(input, &cube, root, means).map(Some)
    }

    /// Reads all pages, from the root on.
    fn pages(
        input: &Input,
        cube: &Cube,
        root: (u64, u64),
        means: Means<'_>,
    ) -> Result<Result<Self, Damage>> {
        let mut memory = means.reserve("COPC hierarchy", PIECE)?;
        let (mut nodes, mut seen) = (Vec::new(), BTreeSet::new());
        let (mut entries, mut pages) = (0u64, vec![root]);
        let mut piece = Vec::new();
        while let Some((at, bytes)) = pages.pop() {
            let end = at.checked_add(bytes).filter(|end| *end <= input.bytes);
            let end = match end {
                Some(end) if bytes % ENTRY as u64 == 0 && seen.insert(at) => end,
                _ => return Ok(Err(format!("a page of {bytes} bytes at byte {at}"))),
            };
            // Pages are not read twice, so all together they are no larger than the file.
            if entries * ENTRY as u64 + bytes > input.bytes {
                let entries = entries + bytes / ENTRY as u64;
                return Ok(Err(format!("{entries} entries")));
            }
            let mut at = at;
            while at < end {
                means.cancel.check()?;
                let bytes = PIECE.min(end - at);
                entries += bytes / ENTRY as u64;
                // What is kept, and what the part may add to it.
                let kept = (nodes.len() + pages.len() + seen.len()) as u64;
                let more = PIECE + (kept + bytes / ENTRY as u64) * (MEMORY + 16);
                if more > memory.bytes() {
                    drop(memory);
                    memory = means.reserve("COPC hierarchy", 2 * more)?;
                }
                piece.resize(bytes as usize, 0);
                input.read_exact_at(at, &mut piece, "page of the COPC hierarchy")?;
                if let Err(damage) = cube.sort(&piece, &mut nodes, &mut pages) {
                    return Ok(Err(damage));
                }
                at += bytes;
            }
        }
        nodes.sort_unstable_by_key(|node| node.at);
        Ok(Ok(Self {
            nodes,
            _memory: memory,
        }))
    }

    /// What is read of a file of which these points are wanted.
    pub(super) fn reads(&self, input: &Input, slack: f64, wanted: &Nearby<'_>) -> Reads {
        let near = wanted.meeting(&self.boxes(slack)).into_iter();
        let none = Reads {
            bytes_of_all: input.size,
            parts: Some(0),
            ..Reads::default()
        };
        let mut reads = near
            .map(|n| &self.nodes[n])
            .fold(none, |reads, node| Reads {
                bytes: reads.bytes + u64::from(node.bytes),
                points: reads.points + u64::from(node.points),
                parts: reads.parts.map(|parts| parts + 1),
                ..reads
            });
        reads.bytes = reads.bytes.min(input.size);
        reads
    }

    /// The cubes of all nodes, wider by so much.
    fn boxes(&self, slack: f64) -> Vec<[[f64; 3]; 2]> {
        let wide = |[low, high]: [[f64; 3]; 2]| [low.map(|c| c - slack), high.map(|c| c + slack)];
        self.nodes.iter().map(|node| wide(node.bounds)).collect()
    }

    /// For each chunk, whether it may have a wanted point; and its cube if the hierarchy has one.
    pub(super) fn select(
        &self,
        chunks: &[Chunk],
        slack: f64,
        wanted: &Nearby<'_>,
    ) -> Vec<(bool, Option<[[f64; 3]; 2]>)> {
        let boxes = self.boxes(slack);
        let mut meets = vec![false; boxes.len()];
        for node in wanted.meeting(&boxes) {
            meets[node] = true;
        }
        let of = |chunk: &Chunk| {
            let found = self.nodes.binary_search_by_key(&chunk.at, |node| node.at);
            match found {
                Ok(node) => (meets[node], Some(boxes[node])),
                Err(_) => (true, None),
            }
        };
        chunks.iter().map(of).collect()
    }
}

impl Cube {
    /// Adds the entries of a part of a page to nodes, and to pages that are to be read.
    fn sort(
        &self,
        part: &[u8],
        nodes: &mut Vec<Node>,
        pages: &mut Vec<(u64, u64)>,
    ) -> Result<(), Damage> {
        for entry in part.chunks_exact(ENTRY) {
            let key = [0, 4, 8, 12].map(|at| u32_at(entry, at).cast_signed());
            let (at, bytes) = (u64_at(entry, 16), u32_at(entry, 24).cast_signed());
            let points = u32_at(entry, 28).cast_signed();
            let Some(bounds) = self.of(key) else {
                return Err(format!("a node with the key {key:?}"));
            };
            match (points, u32::try_from(bytes)) {
                (-1, Ok(bytes)) => pages.push((at, bytes.into())),
                (1.., Ok(bytes)) => nodes.push(Node {
                    at,
                    bytes,
                    points: points.cast_unsigned(),
                    bounds,
                }),
                (0, _) => {}
                _ => return Err(format!("{points} points in {bytes} bytes")),
            }
        }
        Ok(())
    }

    /// The cube of a node; `None` for a key that no node can have.
    fn of(&self, [level, x, y, z]: [i32; 4]) -> Option<[[f64; 3]; 2]> {
        if !(0..=DEEPEST).contains(&level) {
            return None;
        }
        let most = 1 << level;
        let key = [x, y, z];
        if !key.iter().all(|k| (0..most).contains(k)) {
            return None;
        }
        let side = self.side / f64::from(most);
        let low = [0, 1, 2].map(|axis| self.low[axis] + f64::from(key[axis]) * side);
        Some([low, low.map(|c| c + side)])
    }
}
