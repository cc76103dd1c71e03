//! The points of a patch by cells of a grid, so that those near a place are found without looking at all.

use outcrop_geom::vector::{Box3, V3};
use std::ops::Range;

/// Most cells along an axis: half radii of a patch, and some more.
const MOST: f64 = 48.0;

/// Numbers of points by cell.
#[derive(Debug, Default)]
pub(super) struct Grid {
    min: V3,
    /// Cells in a unit of length.
    steps: f64,
    /// Cells along each axis.
    cells: [usize; 3],
    /// For each cell the place of its first point in `numbers`; and the end.
    starts: Vec<u32>,
    numbers: Vec<u32>,
    /// The cell of each point.
    places: Vec<u32>,
}

impl Grid {
    /// Divides points into cells of about this side.
    pub fn set(&mut self, points: impl ExactSizeIterator<Item = V3> + Clone, side: f64) {
        let count = points.len();
        let mut bounds = Box3::EMPTY;
        for position in points.clone() {
            let ends = bounds.min.iter_mut().zip(&mut bounds.max);
            for ((min, max), at) in ends.zip(position) {
                (*min, *max) = (min.min(at), max.max(at));
            }
        }
        let span = |axis: usize| (bounds.max[axis] - bounds.min[axis]).max(0.0);
        let longest = (0..3).fold(0.0, |most: f64, axis| most.max(span(axis)));
        self.min = bounds.min;
        self.steps = side.max(longest / MOST).recip();
        // The cast maps NaN to 0.
        self.cells = [0, 1, 2].map(|axis| (span(axis) * self.steps) as usize + 1);
        let all = self.cells.iter().product::<usize>();
        self.starts.clear();
        self.starts.resize(all + 1, 0);
        let mut places = std::mem::take(&mut self.places);
        let place = |position: V3| {
            let [x, y, z] = [0, 1, 2].map(|axis| self.cell(axis, position[axis]));
            (z * self.cells[1] + y) * self.cells[0] + x
        };
        places.clear();
        places.extend(points.map(|position| place(position) as u32));
        for place in &places {
            self.starts[*place as usize + 1] += 1;
        }
        for cell in 0..all {
            self.starts[cell + 1] += self.starts[cell];
        }
        self.numbers.clear();
        self.numbers.resize(count, 0);
        for (number, place) in places.iter().enumerate().rev() {
            // The ends of the cells, one by one, become their starts.
            let at = &mut self.starts[*place as usize + 1];
            *at -= 1;
            self.numbers[*at as usize] = number as u32;
        }
        self.places = places;
        self.starts.rotate_left(1);
        if let Some(end) = self.starts.last_mut() {
            *end = count as u32;
        }
    }

    fn cell(&self, axis: usize, at: f64) -> usize {
        let cell = ((at - self.min[axis]) * self.steps) as usize;
        cell.min(self.cells[axis] - 1)
    }

    /// The numbers of all points, cell by cell.
    pub fn numbers(&self) -> impl Iterator<Item = usize> {
        self.numbers.iter().map(|number| *number as usize)
    }

    /// Calls `each` with runs of places in [`Grid::numbers`]: the points of all cells that meet a box, of which some are
    /// outside of it.
    #[inline]
    pub fn near(&self, around: &Box3, mut each: impl FnMut(Range<usize>)) {
        let mut ranges = [0..0, 0..0, 0..0];
        for (axis, range) in ranges.iter_mut().enumerate() {
            if self.cells[axis] == 0 || around.max[axis] < self.min[axis] {
                return;
            }
            *range = self.cell(axis, around.min[axis])..self.cell(axis, around.max[axis]) + 1;
        }
        let [x, y, z] = ranges;
        for z in z {
            for y in y.clone() {
                let row = (z * self.cells[1] + y) * self.cells[0];
                let [start, end] = [x.start, x.end].map(|cell| self.starts[row + cell] as usize);
                if start < end {
                    each(start..end);
                }
            }
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        4 * (self.starts.capacity() + self.numbers.capacity() + self.places.capacity()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn all_points_of_a_box_are_found(
            positions in prop::collection::vec(prop::array::uniform3(-9.0f64..9.0), 0..200),
            flat: bool,
            side in 0.1f64..30.0,
            at in prop::array::uniform3(-12.0f64..12.0),
            size in prop::array::uniform3(0.0f64..9.0),
        ) {
            let points: Vec<V3> = positions.iter().map(|&[x, y, z]| {
                [x, y, if flat { 1.0 } else { z }]
            }).collect();
            let mut grid = Grid::default();
            grid.set(points.iter().copied(), side);
            let max = [0, 1, 2].map(|axis| at[axis] + size[axis]);
            let around = Box3 { min: at, max };
            let inside = |number: &usize| {
                let p = points[*number];
                (0..3).all(|axis| at[axis] <= p[axis] && p[axis] <= max[axis])
            };
            let numbers: Vec<usize> = grid.numbers().collect();
            let mut found = Vec::new();
            grid.near(&around, |run| found.extend(numbers[run].iter().copied().filter(inside)));
            found.sort_unstable();
            let all: Vec<usize> = (0..points.len()).filter(inside).collect();
            prop_assert_eq!(found, all);
        }
    }
}
