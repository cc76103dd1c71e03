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

    /// The coordinates of a lattice position from a shifted origin, to the nearest `f64`.
    #[must_use]
    pub fn shifted(&self, p: Point, shift: &Shift) -> [f64; 3] {
        // Integers below 2^53 are exact, so the product is the only rounding.
        self.steps_from(p, shift)
            .map(|steps| steps as f64 * self.step)
    }

    /// The coordinates of a lattice position from a shifted origin, to the nearest `f32`.
    #[must_use]
    pub fn shifted_single(&self, p: Point, shift: &Shift) -> [f32; 3] {
        self.steps_from(p, shift)
            .map(|steps| single_product(steps as f64, self.step))
    }

    /// Steps from a shifted origin to a lattice position.
    fn steps_from(&self, p: Point, shift: &Shift) -> [i64; 3] {
        std::array::from_fn(|axis| i64::from(p[axis]) + self.base[axis] - shift.steps[axis])
    }
}

/// A shift of the origin by a whole number of steps along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    /// Steps from the offset of the lattice to the new origin; fewer than 2^52 from any position.
    pub steps: [i64; 3],
    /// The new origin in the input's coordinates.
    pub origin: [f64; 3],
}

/// The `f32` nearest to the exact product. Rounding the `f64` product again would round twice.
fn single_product(a: f64, b: f64) -> f32 {
    let product = a * b;
    let rest = libm::fma(a, b, -product);
    // If anything was cut off, an odd last bit keeps the second rounding on the right side: rounding to odd.
    let is_even = product.to_bits() & 1 == 0;
    let odd = match rest {
        0.0 => product,
        _ if !is_even || !product.is_finite() => product,
        rest if rest > 0.0 => product.next_up(),
        _ => product.next_down(),
    };
    odd as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_rounded_once() {
        // In f64 both products are exactly between two floats, in truth they are beside it.
        let (between, next) = (16_777_217.0, 16_777_219.0);
        let (above, below) = (between / 3.0, next / 3.0);
        assert_eq!((3.0 * above, 3.0 * below), (between, next));
        assert_eq!(single_product(3.0, above), 16_777_218.0);
        assert_eq!(single_product(-3.0, above), -16_777_218.0);
        assert_eq!(single_product(3.0, below), 16_777_218.0);
        assert_eq!(single_product(between, 1.0), 16_777_216.0);
        assert_eq!(single_product(3.0, 0.1), 0.3);
        assert_eq!(single_product(0.0, 0.01), 0.0);
        assert_eq!(single_product(1e300, 1e300), f32::INFINITY);
    }
}
