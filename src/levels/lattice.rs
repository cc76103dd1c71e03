//! The step of which all coordinates of a mesh are multiples, found from the coordinates.

use serde::{Deserialize, Serialize};

/// Powers of ten that are tried as numbers of steps in a unit.
const SCALES: [f64; 13] = [
    1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12,
];

/// Positions along an axis: they fit 31 bits.
const POSITIONS: f64 = (1u32 << 31) as f64;

/// Whole numbers up to here are exact as `f64`.
const EXACT: f64 = (1u64 << 52) as f64;

/// Largest absolute coordinate, so that no square overflows.
pub(super) const LARGEST: f64 = 1e100;

/// Coordinates as whole numbers of steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// Steps in a unit, if that is a power of ten; otherwise the step is a power of two.
    scale: Option<f64>,
    /// Length of a step.
    pub step: f64,
    /// The steps of the lowest corner, whole numbers.
    first: [f64; 3],
    /// True if every coordinate is a multiple of the step, up to the rounding of `f64`.
    pub exact: bool,
    /// Bits of the largest position along an axis, at most 31.
    pub bits: u32,
}

impl Lattice {
    /// Steps from the lowest corner, rounded.
    #[must_use]
    pub fn index(&self, position: [f64; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| {
            let steps = steps(position[axis], self.scale, self.step) - self.first[axis];
            steps.clamp(0.0, f64::from(u32::MAX)) as u32
        })
    }

    /// The lowest corner.
    #[must_use]
    pub fn origin(&self) -> [f64; 3] {
        self.first.map(|first| match self.scale {
            Some(scale) => first / scale,
            None => first * self.step,
        })
    }
}

fn steps(x: f64, scale: Option<f64>, step: f64) -> f64 {
    scale.map_or_else(|| x / step, |scale| x * scale).round()
}

/// How coordinates are rounded in the file.
#[derive(Debug, Clone, Copy)]
struct Rounding {
    /// Largest error of a coordinate, as a part of it.
    part: f64,
    /// True if errors may be as large as those of the largest coordinates, since all were added to an offset.
    sums: bool,
    /// Largest error as a part of the step: any number is a decimal number with more.
    most: f64,
}

/// Coordinates as `f64`, after a few roundings.
const DOUBLES: Rounding = Rounding {
    part: 4.0 * f64::EPSILON,
    sums: true,
    most: 0.01,
};

/// Decimal coordinates as `f32`: the nearest ones.
const FLOATS: Rounding = Rounding {
    part: f32::EPSILON as f64 * 0.500_001,
    sums: false,
    most: 0.25,
};

/// Finds the lattice of coordinates that it is shown.
#[derive(Debug)]
pub struct Finder {
    min: [f64; 3],
    max: [f64; 3],
    rounding: Rounding,
    /// The least number of decimals that all coordinates may have so far; that of `SCALES` if they have more.
    decimals: usize,
    /// By axis and number of decimals: the largest distance of a coordinate from a number with as many, counting
    /// those that are farther than the error of the coordinate itself.
    rounded: [[f64; SCALES.len()]; 3],
    /// The exponent of the lowest bit that is set in a coordinate.
    lowest: i32,
}

impl Default for Finder {
    fn default() -> Self {
        Self {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            rounding: DOUBLES,
            decimals: 0,
            rounded: [[0.0; SCALES.len()]; 3],
            lowest: i32::MAX,
        }
    }
}

/// The distance of a number from the nearest multiple of `1 / scale`.
fn distance(x: f64, scale: f64) -> f64 {
    ((x * scale).round() / scale - x).abs()
}

fn lowest_bit(x: f64) -> i32 {
    let bits = x.to_bits();
    let (exponent, mantissa) = ((bits >> 52 & 0x7ff) as i32, bits & ((1 << 52) - 1));
    let whole = if exponent == 0 {
        mantissa
    } else {
        mantissa | 1 << 52
    };
    exponent.max(1) - 1075 + whole.trailing_zeros() as i32
}

impl Finder {
    /// For coordinates that are `f32` in the file.
    #[must_use]
    pub fn of_floats() -> Self {
        Self {
            rounding: FLOATS,
            ..Self::default()
        }
    }

    /// Takes a position; false if it is not a number, or too large.
    #[inline]
    pub fn see(&mut self, position: [f64; 3]) -> bool {
        for (axis, &x) in position.iter().enumerate() {
            if x.is_nan() || x.abs() > LARGEST {
                return false;
            }
            self.min[axis] = self.min[axis].min(x);
            self.max[axis] = self.max[axis].max(x);
            if self.decimals < SCALES.len()
                && distance(x, SCALES[self.decimals]) > self.rounding.part * x.abs()
            {
                self.see_decimals(axis, x);
            }
            if x != 0.0 {
                self.lowest = self.lowest.min(lowest_bit(x));
            }
        }
        true
    }

    /// Takes a coordinate that is not a number with as few decimals as the others: it has more, or it is small and has
    /// the rounding errors of large ones.
    fn see_decimals(&mut self, axis: usize, x: f64) {
        for (decimals, scale) in SCALES.iter().enumerate().skip(self.decimals) {
            let distance = distance(x, *scale);
            if distance > self.rounding.part * x.abs() {
                let most = &mut self.rounded[axis][decimals];
                *most = most.max(distance);
            }
            if decimals == self.decimals && distance * scale > self.rounding.most {
                self.decimals += 1;
            }
        }
    }

    /// The power of ten of which all coordinates are fractions, up to their rounding.
    fn scale(&self) -> Option<f64> {
        let Rounding { part, sums, most } = self.rounding;
        let explains = |decimals: &usize| {
            (0..3).all(|axis| {
                let largest = self.min[axis].abs().max(self.max[axis].abs());
                let error = if largest.is_finite() {
                    part * largest
                } else {
                    0.0
                };
                let allowed = if sums { error } else { 0.0 };
                self.rounded[axis][*decimals] <= allowed && error * SCALES[*decimals] <= most
            })
        };
        let decimals = (self.decimals..SCALES.len()).find(explains)?;
        Some(SCALES[decimals])
    }

    /// The lattice of all positions.
    #[must_use]
    pub fn finish(&self) -> Lattice {
        let spans = (0..3).map(|axis| self.max[axis] - self.min[axis]);
        let span = spans.fold(0.0, f64::max);
        let (min, max) = (self.min.iter(), self.max.iter());
        let largest = min
            .chain(max)
            .fold(0.0, |most: f64, x| match x.is_finite() {
                true => most.max(x.abs()),
                false => most,
            });
        let fits = |step: f64| span / step < POSITIONS - 2.0 && largest / step < EXACT;
        let of = |scale: Option<f64>, step: f64, exact| Lattice {
            scale,
            step,
            first: self.min.map(|x| match x.is_finite() {
                true => steps(x, scale, step),
                false => 0.0,
            }),
            exact,
            bits: 32 - ((span / step).ceil().clamp(0.0, POSITIONS - 1.0) as u32).leading_zeros(),
        };
        if let Some(scale) = self.scale()
            && fits(1.0 / scale)
        {
            return of(Some(scale), 1.0 / scale, true);
        }
        let wanted = self.lowest.clamp(-1000, 1000);
        let exponent = (wanted..).find(|e| fits(2f64.powi(*e))).unwrap_or(wanted);
        let exact = exponent == self.lowest;
        of(None, 2f64.powi(exponent), exact)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(positions: &[[f64; 3]]) -> Lattice {
        let mut finder = Finder::default();
        assert!(positions.iter().all(|p| finder.see(*p)));
        finder.finish()
    }

    #[test]
    fn decimals_and_bits_are_found() {
        let utm = of(&[
            [635_123.45, 4_848_000.01, 17.3],
            [635_001.0, 4_849_000.99, -2.25],
        ]);
        assert_eq!((utm.step, utm.exact), (0.01, true));
        assert_eq!(utm.index([635_001.01, 4_848_000.02, -2.24]), [1, 1, 1]);
        assert_eq!(utm.origin(), [635_001.0, 4_848_000.01, -2.25]);
        let floats = of(&[[0.1f32, 0.7f32, -1.3f32].map(f64::from), [0.0; 3]]);
        assert!(floats.exact && floats.step == 2f64.powi(-27), "{floats:?}");
        // The rounding errors of an offset that was added, seen near zero.
        let offset = of(&[[300.0; 3], [300.0 + -299_999.0 * 0.001, 0.0, 645.483]]);
        assert_eq!((offset.step, offset.exact), (0.001, true));
        let other = of(&[[1.0, 0.0, 0.0], [1e-3 + 1e-15, 0.0, 0.0]]);
        assert!(other.scale.is_none() && !other.exact, "{other:?}");
        let shifted = of(&[[2.0, 0.0, 0.0], [3e-9 + 1e-7, 0.0, 0.0]]);
        assert_eq!((shifted.step, shifted.exact), (1e-9, true));
        let tiny = of(&[[1.0, 1.3e-13, 0.0], [0.0, 0.3, 1.0]]);
        assert!(!tiny.exact && tiny.step > 0.0);
        assert_eq!(of(&[[3.0; 3]]).index([3.0; 3]), [0; 3]);
        assert_eq!(of(&[]).index([0.0; 3]), [0; 3]);
        let huge = of(&[[0.0; 3], [1e99; 3]]);
        assert!(!huge.exact && huge.index([1e99; 3])[0] > 1 << 29);
        let mut finder = Finder::default();
        assert!(!finder.see([f64::NAN, 0.0, 0.0]) && !finder.see([1e101, 0.0, 0.0]));
    }

    #[test]
    fn floats_of_decimals_are_decimals() {
        let of = |positions: &[[f32; 3]]| {
            let mut finder = Finder::of_floats();
            assert!(positions.iter().all(|p| finder.see(p.map(f64::from))));
            finder.finish()
        };
        let (mut metres, mut random) = (Vec::new(), Vec::new());
        for n in 0..2000u32 {
            let steps = [n * 7919, n * 104_729, n].map(|x| x % 1_500_000);
            metres.push(steps.map(|x| x as f32 / 1000.0));
            random.push(steps.map(|x| (x as f32).sin()));
        }
        let lattice = of(&metres);
        assert_eq!((lattice.step, lattice.exact), (0.001, true));
        for point in &metres {
            let index = lattice.index(point.map(f64::from));
            let origin = lattice.origin();
            let again = [0, 1, 2].map(|k| (origin[k] + f64::from(index[k]) * lattice.step) as f32);
            assert_eq!(again, *point);
        }
        // All bits of floats that are no decimals.
        let lattice = of(&random);
        assert!(lattice.scale.is_none(), "{lattice:?}");
    }

    #[test]
    fn the_lowest_bit_is_that_of_the_number() {
        for (x, bit) in [(1.0, 0), (0.75, -2), (-6.0, 1), (2f64.powi(-1074), -1074)] {
            assert_eq!(lowest_bit(x), bit, "{x}");
        }
    }
}
