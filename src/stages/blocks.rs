//! Blocks: the fixed id ranges by which the mesh is computed.

use crate::ids::{Block, Id, Ids, Triangle, Width};
use serde::{Deserialize, Serialize};

/// Division of the ids `0..points` into blocks of `size`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Blocks {
    points: Width,
    size: u32,
}

impl Blocks {
    /// Divides `points` points into blocks of `size` ids.
    #[must_use]
    pub fn new(points: usize, size: u32) -> Self {
        Self {
            points: points as Width,
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
    pub fn of(&self, id: Id) -> Block {
        Block::new(id.get() / self.size)
    }

    /// The ids of a block.
    #[must_use]
    pub fn ids(&self, block: usize) -> Ids {
        let start = block as Width * self.size;
        Ids::of(start..start.saturating_add(self.size).min(self.points))
    }

    /// True if not all three vertices are in one block.
    #[must_use]
    pub fn crossing(&self, [i, j, k]: Triangle) -> bool {
        self.of(i) != self.of(j) || self.of(i) != self.of(k)
    }

    /// The blocks that contain vertices of ascending `ids`, without the block of the first vertex.
    pub fn visited(&self, [i, j, k]: Triangle) -> impl Iterator<Item = Block> + use<> {
        let (a, b, c) = (self.of(i), self.of(j), self.of(k));
        [(b != a).then_some(b), (c != b).then_some(c)]
            .into_iter()
            .flatten()
    }
}
