//! The points of a tile in columns.

use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::kernels::BLOCK;
use crate::workspace::memory::bytes_of;
use std::ops::Range;

/// Points in columns, with a block more than there are points: a whole block can be read anywhere.
#[derive(Debug)]
pub(super) struct Points {
    columns: [Vec<i32>; 3],
    len: usize,
}

impl Points {
    /// None yet, with room for `count`.
    pub fn with_capacity(count: usize) -> Self {
        Self {
            columns: [0; 3].map(|_| vec![0; count + BLOCK]),
            len: 0,
        }
    }

    /// Adds points.
    pub fn extend(&mut self, points: &[Point]) {
        let end = self.len + points.len();
        for (axis, column) in self.columns.iter_mut().enumerate() {
            column.resize(column.len().max(end + BLOCK), 0);
            for (to, point) in column[self.len..end].iter_mut().zip(points) {
                *to = point[axis];
            }
        }
        self.len = end;
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn get(&self, index: usize) -> Point {
        [0, 1, 2].map(|axis: usize| self.columns[axis][index])
    }

    /// The smallest box around some of them.
    pub fn bounds(&self, range: Range<usize>) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for (axis, column) in self.columns.iter().enumerate() {
            let column = &column[range.clone()];
            let (min, max) = (&mut bounds.min[axis], &mut bounds.max[axis]);
            *min = column.iter().fold(*min, |a, b| a.min(*b));
            *max = column.iter().fold(*max, |a, b| a.max(*b));
        }
        bounds
    }

    /// Their coordinates.
    #[inline(always)]
    pub fn coordinates(&self) -> [&[i32]; 3] {
        self.columns.each_ref().map(|column| &column[..self.len])
    }

    /// The coordinates of a block of points, some of which may be none.
    #[inline(always)]
    pub fn block(&self, start: usize) -> Option<[&[i32; BLOCK]; 3]> {
        let [x, y, z] = &self.columns;
        Some([
            x.get(start..)?.first_chunk()?,
            y.get(start..)?.first_chunk()?,
            z.get(start..)?.first_chunk()?,
        ])
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> u64 {
        self.columns.iter().map(bytes_of).sum()
    }
}
