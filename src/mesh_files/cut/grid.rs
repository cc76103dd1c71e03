//! The grid of squares for dividing a mesh.

use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use serde::{Deserialize, Serialize};

/// A square: its number along x and y. The square 0, 0 has its lowest corner at the origin of the coordinates.
pub type Square = [i64; 2];

/// Squares of one size in x and y, with a corner at the origin of the input's coordinates.
///
/// The number of a square along an axis is a monotone function of the sum of three coordinates, however it is
/// rounded. So every triangle is in exactly one square, and squares meet in straight lines.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Grid {
    lattice: Lattice,
    side: f64,
}

impl Grid {
    /// Squares of side `side`, in the input's unit.
    #[must_use]
    pub fn new(lattice: &Lattice, side: f64) -> Self {
        Self {
            lattice: lattice.clone(),
            side,
        }
    }

    /// The square with the centroid of a triangle.
    #[must_use]
    pub fn of(&self, corners: [Point; 3]) -> Square {
        [0, 1].map(|axis| {
            // The sum of the coordinates is exact.
            let sum: i128 = corners.iter().map(|p| i128::from(p[axis])).sum();
            let thrice = sum + 3 * i128::from(self.lattice.base[axis]);
            let centre = thrice as f64 * self.lattice.step / 3.0 + self.lattice.offset[axis];
            (centre / self.side).floor() as i64
        })
    }

    /// Side of the squares, in the input's unit.
    #[must_use]
    pub fn side(&self) -> f64 {
        self.side
    }
}
