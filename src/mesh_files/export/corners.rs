//! The positions of the corners of triangles at a block.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_stages::ids::{Id, Ids, Triangle};
use outcrop_stages::order::PointStore;

/// Positions of the points of a block, and of the points of other blocks that are corners of its triangles.
pub struct Corners {
    ids: Ids,
    own: Vec<Point>,
    /// Ids of the others, ascending.
    others: Vec<Id>,
    positions: Vec<Point>,
}

impl Corners {
    /// Bytes of memory for a block of `points` points that `triangles` triangles touch. Each of them has one or
    /// two corners in other blocks.
    pub fn estimate(points: u64, triangles: u64) -> u64 {
        12 * points + 32 * triangles + (64 << 10)
    }

    /// Reads the positions for `triangles`; the ids of the block are `ids`.
    pub fn load<'a>(
        store: &PointStore,
        ids: Ids,
        triangles: impl Iterator<Item = &'a Triangle> + Clone,
    ) -> Result<Self> {
        let others = triangles.flatten().filter(|v| !ids.contains(v));
        let mut list = Vec::with_capacity(others.clone().count());
        list.extend(others);
        list.sort_unstable();
        list.dedup();
        let mut positions = Vec::with_capacity(list.len());
        store.fetch(&list, &mut positions)?;
        Ok(Self {
            own: store.slice(ids.indices())?,
            ids,
            others: list,
            positions,
        })
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.own) + bytes_of(&self.others) + bytes_of(&self.positions)
    }

    /// The position of a corner.
    #[inline]
    pub fn at(&self, v: Id) -> Point {
        let own = self.own.get(self.ids.find(v));
        own.copied().unwrap_or_else(|| {
            // All corners of the triangles are in the list.
            let found = self.others.binary_search(&v);
            self.positions[found.unwrap_or_else(|next| next)]
        })
    }
}
