//! Division of the free memory.

use super::star;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;

/// Largest block that a bucket collects before it is written, in bytes.
const LARGEST_BLOCK: u64 = 256 << 10;

/// Smallest such block, except for very small ranges.
const SMALLEST_BLOCK: u64 = 512;

/// log2 of the vertices of a range in which only rims of pieces are examined.
const RIMS: u32 = 18;

/// Largest number of ranges.
const MOST_RANGES: u64 = 1 << 16;

/// Bytes of an empty range in five kinds of buckets and in the table of positions.
const PER_RANGE: u64 = 5 * 48 + 24;

/// Bytes of a vertex while its range is in memory, without triangles and position: union–find (8), number of
/// triangles and place of the first (8).
const PER_VERTEX: u64 = 16;

/// Bytes of a position.
const POSITION: u64 = 24;

/// Bytes of a triangle at one of its corners.
const PER_CORNER: u64 = 8;

/// Sizes of all large buffers.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    /// Number of vertices of the mesh; every valid id is below.
    pub(super) vertices: u32,
    /// Vertex `v` belongs to range `v >> shift`.
    pub(super) shift: u32,
    /// Number of ranges.
    pub(super) ranges: usize,
    /// True if all positions stay in memory.
    pub(super) all_positions: bool,
    /// Number of corners held at a time.
    pub(super) corners: usize,
    /// Bytes of a block in the buckets of triangles, of contractions, of triangles without all positions,
    /// and of single positions.
    pub(super) blocks: [u64; 4],
    /// Larger stars, in triangles, are examined one at a time.
    pub(super) large_star: usize,
}

impl Plan {
    /// The plan for a mesh in `free` bytes; `range` is the requested number of vertices per range.
    pub(super) fn new(vertices: u64, faces: u64, free: u64, range: Option<u32>) -> Self {
        let all = vertices * POSITION;
        let all_positions = range.is_none() && all <= free / 4;
        let rest = if all_positions { free - all } else { free };
        // An eighth for the buckets of triangles, a sixteenth each for triangles without all positions and
        // for single positions, a thirty-second for each of two contractions, half for the range; the rest
        // for large stars. Single positions take the place of those that are all in memory.
        let (quotas, quota) = ([rest / 8, rest / 32, rest / 16, rest / 16], rest / 2);
        let fixed = PER_VERTEX + if all_positions { 0 } else { POSITION };
        // A quarter more corners than the mean, for ranges above the mean.
        let degree = (3 * u128::from(faces)).div_ceil(u128::from(vertices.max(1)));
        let each = u128::from(fixed) + degree * u128::from(PER_CORNER) * 5 / 4;
        let fitting = (u128::from(quota) / each).clamp(1, 1 << 31) as u64;
        let whole = vertices.max(1).next_power_of_two();
        let mut shift = fitting.min(whole).ilog2();
        match range {
            Some(range) => shift = range.max(1).ilog2(),
            // One block of every range must fit its quota.
            None => {
                while (vertices >> shift) * SMALLEST_BLOCK > quotas[1] && shift < 31 {
                    shift += 1;
                }
            }
        }
        while vertices >> shift > MOST_RANGES {
            shift += 1;
        }
        let ranges = (vertices.div_ceil(1 << shift)).max(1);
        let corners = quota.saturating_sub(fixed << shift).max(1 << 20) / PER_CORNER;
        Self {
            // The reader refuses larger numbers.
            vertices: u32::try_from(vertices).unwrap_or(u32::MAX),
            shift,
            ranges: ranges as usize,
            all_positions,
            corners: corners as usize,
            blocks: quotas.map(|quota| (quota / ranges).min(LARGEST_BLOCK)),
            large_star: 4096,
        }
    }

    /// The plan for the sweep over what several pieces share, for a mesh that is read by pieces: smaller
    /// ranges, which stay near the processor. None if memory is too small for them.
    pub(super) fn of_rims(
        vertices: u64,
        faces: u64,
        free: u64,
        range: Option<u32>,
    ) -> Option<Self> {
        let shift = |range: u32| range.max(1).ilog2();
        let fits = |shift: &u32| (vertices >> shift) * SMALLEST_BLOCK <= free / 32;
        let shift = range.map(shift).or_else(|| (RIMS..31).find(fits))?;
        let length = (1u64 << shift).min(vertices);
        let held = (PER_VERTEX + POSITION) * length;
        (held <= free / 4).then(|| Self::new(vertices, faces, free, Some(1 << shift)))
    }

    /// Number of vertices of a range that is not the last.
    pub(super) fn range_length(&self) -> usize {
        1 << self.shift
    }

    /// First vertex and number of vertices of range `k`.
    pub(super) fn range(&self, k: usize) -> (u32, usize) {
        let first = k << self.shift;
        let end = (first + self.range_length()).min(self.vertices as usize);
        (first as u32, end.saturating_sub(first))
    }

    /// The range of a vertex.
    pub(super) fn range_of(&self, vertex: u32) -> usize {
        (vertex >> self.shift) as usize
    }

    /// Number of positions in memory.
    pub(super) fn held_positions(&self) -> usize {
        let all = self.vertices as usize;
        if self.all_positions {
            all
        } else {
            self.range_length().min(all)
        }
    }

    /// Reserves the planned memory.
    pub(super) fn reserve(&self, workspace: &Workspace) -> Result<Vec<Reservation>> {
        let [triangles, contraction, area, places] = self.blocks.map(|b| b * self.ranges as u64);
        let held = self.held_positions() as u64;
        let range = self.range_length().min(self.vertices as usize) as u64;
        // The bytes of a block and its rows.
        let blocks = 2 * self.blocks.iter().sum::<u64>() + (1 << 20);
        let tables = self.ranges as u64 * PER_RANGE;
        let stars = star::scratch_bytes(self.large_star) * workspace.threads as u64;
        let corners = self.corners as u64 * PER_CORNER;
        let parts = [
            ("verify: buckets of triangles", triangles),
            ("verify: buckets of edges", 2 * contraction),
            ("verify: triangles between ranges", area),
            ("verify: places of vertices", places),
            ("verify: positions", held * POSITION),
            ("verify: vertices of one range", range * PER_VERTEX),
            ("verify: corners of one range", corners),
            ("verify: blocks and stars at hand", blocks + tables + stars),
        ];
        let reserve = |(name, bytes)| workspace.reserve(name, bytes);
        parts.into_iter().map(reserve).collect()
    }
}
