//! The points of a tile in columns.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_paper::kernels::{BLOCK, Level, kernel};
use std::ops::Range;

/// Points in columns that are a block longer than the number of points, so that a whole block can be read
/// anywhere.
#[derive(Debug)]
pub(super) struct Points {
    /// The columns one after another, in one allocation.
    words: Vec<i32>,
    /// Length of a column.
    column: usize,
    len: usize,
}

impl Points {
    /// No points, with room for `count`.
    pub fn with_capacity(count: usize) -> Self {
        let column = count + BLOCK;
        Self {
            words: vec![0; 3 * column],
            column,
            len: 0,
        }
    }

    /// Appends the coordinates of `count` points, for which there must be room: `fill` writes them.
    pub fn extend(
        &mut self,
        count: usize,
        fill: impl FnOnce([&mut [i32]; 3]) -> Result<()>,
    ) -> Result<()> {
        let (x, others) = self.words.split_at_mut(self.column);
        let (y, z) = others.split_at_mut(self.column);
        let added = self.len..self.len + count;
        self.len = added.end;
        fill([x, y, z].map(|column| &mut column[added.clone()]))
    }

    #[inline(always)]
    fn columns(&self) -> [&[i32]; 3] {
        let (x, others) = self.words.split_at(self.column);
        let (y, z) = others.split_at(self.column);
        [x, y, z]
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn get(&self, index: usize) -> Point {
        let [x, y, z] = self.columns();
        [x[index], y[index], z[index]]
    }

    /// The bounding box of the points in `range`.
    pub fn bounds(&self, range: Range<usize>) -> Aabb {
        let [x, y, z] = self.columns();
        let columns = [&x[range.clone()], &y[range.clone()], &z[range]];
        let (min, max) = bounds(Level::best(), columns);
        Aabb { min, max }
    }

    /// The coordinates of a block of points; those after the last point are undefined.
    #[inline(always)]
    pub fn block(&self, start: usize) -> Option<[&[i32; BLOCK]; 3]> {
        let [x, y, z] = self.columns();
        Some([
            x.get(start..)?.first_chunk()?,
            y.get(start..)?.first_chunk()?,
            z.get(start..)?.first_chunk()?,
        ])
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.words)
    }
}

kernel! {
    /// The lowest and highest coordinates of columns; those of [`Aabb::EMPTY`] if there are none.
    fn bounds(columns: [&[i32]; 3]) -> (Point, Point) = bounds_body
}

#[inline(always)]
fn bounds_body(columns: [&[i32]; 3]) -> (Point, Point) {
    let Aabb { mut min, mut max } = Aabb::EMPTY;
    for (axis, column) in columns.into_iter().enumerate() {
        let (mut low, mut high) = (min[axis], max[axis]);
        for c in column {
            low = low.min(*c);
            high = high.max(*c);
        }
        (min[axis], max[axis]) = (low, high);
    }
    (min, max)
}
