//! Blocks: the fixed id ranges by which the mesh is computed.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Division of the ids `0..points` into blocks of `size`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blocks {
    points: u32,
    size: u32,
}

impl Blocks {
    /// Divides `points` points into blocks of `size` ids.
    #[must_use]
    pub fn new(points: usize, size: u32) -> Self {
        Self {
            points: points as u32,
            size: size.max(1),
        }
    }

    /// Number of points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points as usize
    }

    /// Number of blocks.
    #[must_use]
    pub fn count(&self) -> usize {
        self.points.div_ceil(self.size) as usize
    }

    /// The block of an id.
    #[must_use]
    pub fn of(&self, id: u32) -> u32 {
        id / self.size
    }

    /// The ids of a block.
    #[must_use]
    pub fn ids(&self, block: usize) -> Range<u32> {
        let start = block as u32 * self.size;
        start..start.saturating_add(self.size).min(self.points)
    }

    /// True if not all three vertices are in one block.
    #[must_use]
    pub fn crossing(&self, [i, j, k]: [u32; 3]) -> bool {
        self.of(i) != self.of(j) || self.of(i) != self.of(k)
    }

    /// The blocks that contain vertices of ascending `ids`, without the block of the first vertex.
    pub fn visited(&self, [i, j, k]: [u32; 3]) -> impl Iterator<Item = u32> + use<> {
        let (a, b, c) = (self.of(i), self.of(j), self.of(k));
        [(b != a).then_some(b), (c != b).then_some(c)]
            .into_iter()
            .flatten()
    }
}
