//! The integer lattice on which all positions lie.

use super::Point;
use serde::{Deserialize, Serialize};

/// Lattice coordinates are in `0..COORDINATE_LIMIT`, so that all products in the exact predicates fit 128
/// bits.
pub const COORDINATE_LIMIT: i64 = 1 << 30;

/// Maps lattice positions to the input's coordinates: `(p + base) * step + offset` per axis.
///
/// For LAS input with one scale and offset this is the map of the file, so the coordinates written are
/// exactly those of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Length of one step, the same along each axis, in the input's unit.
    pub step: f64,
    /// Offset, in the input's unit.
    pub offset: [f64; 3],
    /// Integer shift that moves the cloud's lowest corner to the lattice's origin.
    pub base: [i64; 3],
    /// True if every input position is on the lattice without rounding.
    pub exact: bool,
}

impl Lattice {
    /// The input coordinates of a lattice position.
    #[must_use]
    pub fn position(&self, p: Point) -> [f64; 3] {
        std::array::from_fn(|axis| {
            (i64::from(p[axis]) + self.base[axis]) as f64 * self.step + self.offset[axis]
        })
    }
}
