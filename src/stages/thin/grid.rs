//! The cells that points are thinned by.

use crate::geom::Point;
use crate::geom::lattice::Lattice;
use crate::spill::Record;
use crate::workspace::persist::persist;

/// Cubic cells of one side, with a corner at the zero point of the input's coordinates.
///
/// A cell's number along an axis grows with the coordinate, however it was rounded: so every
/// position is in one cell, and cells are boxes.
#[derive(Debug, Clone)]
pub struct Grid {
    lattice: Lattice,
    /// In the input's unit.
    side: f64,
    /// Along each axis the cell of the lattice's lowest coordinate.
    lowest: [f64; 3],
}

persist!(Grid {
    lattice,
    side,
    lowest
});

impl Grid {
    /// Cells of side `length` over the lattice; `None` if they are so small that no two points can
    /// be in one.
    #[must_use]
    pub fn new(lattice: &Lattice, length: f64) -> Option<Self> {
        let mut grid = Self {
            lattice: lattice.clone(),
            side: length,
            lowest: [0.0; 3],
        };
        grid.lowest = grid.along([0; 3]).map(|c| (c / length).floor());
        (length > lattice.step).then_some(grid)
    }

    #[cfg(test)]
    pub(super) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    #[cfg(test)]
    pub(super) fn side(&self) -> f64 {
        self.side
    }

    /// The coordinates in the input's unit.
    fn along(&self, position: Point) -> [f64; 3] {
        self.lattice.position(position)
    }

    /// The cell of a position, counted from the lattice's lowest. A cell is wider than a step, so
    /// there are no more of them than steps.
    fn cell(&self, position: Point) -> [u32; 3] {
        let along = self.along(position);
        std::array::from_fn(|axis| ((along[axis] / self.side).floor() - self.lowest[axis]) as u32)
    }

    /// Cell and position; sorts by cell.
    pub(super) fn record(&self, position: Point) -> Record<6> {
        let ([a, b, c], [x, y, z]) = (self.cell(position), position.map(|c| c as u32));
        [a, b, c, x, y, z]
    }

    /// Squared distance of a record's position to the centre of its cell, in the input's unit.
    pub(super) fn distance2(&self, record: Record<6>) -> f64 {
        let along = self.along(position(record));
        let off = |axis: usize| {
            let centre = (f64::from(record[axis]) + self.lowest[axis] + 0.5) * self.side;
            along[axis] - centre
        };
        let [x, y, z] = [0, 1, 2].map(off);
        x * x + y * y + z * z
    }
}

/// The position in a record.
pub(super) fn position([_, _, _, x, y, z]: Record<6>) -> Point {
    [x, y, z].map(|c| c as i32)
}

/// Whether two records are in one cell.
pub(super) fn same_cell(a: Record<6>, b: Record<6>) -> bool {
    a[..3] == b[..3]
}
