//! The grid of cells for thinning.

use outcrop_disk::spill::row;
use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use serde::{Deserialize, Serialize};

/// Cubic cells of one size, with a corner at the origin of the input's coordinates.
///
/// The index of a cell along an axis is a monotone function of the coordinate, however it is rounded. So
/// every position is in exactly one cell, and cells are boxes.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Grid {
    pub(super) lattice: Lattice,
    /// Side of a cell, in the input's unit.
    pub(super) side: f64,
    /// For each axis, the cell of the lowest lattice coordinate.
    lowest: [f64; 3],
}

impl Grid {
    /// Cells of side `length` over the lattice; `None` if they are so small that no two points can share one.
    #[must_use]
    pub fn new(lattice: &Lattice, length: f64) -> Option<Self> {
        let mut grid = Self {
            lattice: lattice.clone(),
            side: length,
            lowest: [0.0; 3],
        };
        grid.lowest = lattice.position([0; 3]).map(|c| (c / length).floor());
        (length > lattice.step).then_some(grid)
    }

    /// The cell of a position, counted from the lowest cell of the lattice. A cell is wider than a step, so
    /// the number of cells along an axis is at most the number of steps.
    fn cell(&self, position: Point) -> [u32; 3] {
        let along = self.lattice.position(position);
        std::array::from_fn(|axis| ((along[axis] / self.side).floor() - self.lowest[axis]) as u32)
    }

    /// A position with its cell.
    pub(super) fn in_cell(&self, position: Point) -> InCell {
        InCell {
            cell: self.cell(position),
            // Lattice coordinates are not negative.
            position: position.map(i32::cast_unsigned),
        }
    }

    /// Squared distance of a position to the centre of its cell, in the input's unit.
    pub(super) fn distance2(&self, row: InCell) -> f64 {
        let along = self.lattice.position(row.position());
        let off = |axis: usize| {
            let centre = (f64::from(row.cell[axis]) + self.lowest[axis] + 0.5) * self.side;
            along[axis] - centre
        };
        let [x, y, z] = [0, 1, 2].map(off);
        x * x + y * y + z * z
    }
}

row! {
    /// A position and its cell; sorted by cell.
    pub struct InCell {
        /// Number of the cell along each axis.
        cell: [u32; 3],
        /// Coordinates on the lattice.
        position: [u32; 3],
    }
    unpacked
}

impl InCell {
    /// The position.
    pub(super) fn position(self) -> Point {
        self.position.map(u32::cast_signed)
    }
}
