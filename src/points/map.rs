//! Conversion of native coordinates to lattice positions, for each axis.

use super::frames::FrameBuffer;
use super::native::Native;
use super::source::Source;

/// Largest position before the base is subtracted; beyond it sums could overflow, so larger ones are
/// rejected.
const POSITION_LIMIT: f64 = (1u64 << 62) as f64;

/// Largest distance from the lattice, in steps, at which a file's offset counts as on it.
const RESIDUE: f64 = 1e-6;

/// Relative tolerance for comparing two scales: far below a step over the whole range of `i32`.
const RATIO: f64 = 1e-12;

/// The rational `n / d` closest to `x > 0` within a relative 1e-12, with `d` at most `limit`.
pub(super) fn rational(x: f64, limit: i64) -> Option<(i64, i64)> {
    let (mut n, mut d) = ([0i64, 1], [1i64, 0]);
    let mut rest = x;
    for _ in 0..40 {
        let whole = rest.floor();
        if !(0.0..9e15).contains(&whole) {
            return None;
        }
        let next = |v: [i64; 2]| {
            (whole as i64)
                .checked_mul(v[1])
                .and_then(|p| p.checked_add(v[0]))
        };
        n = [n[1], next(n)?];
        d = [d[1], next(d)?];
        if d[1] > limit {
            return None;
        }
        if n[1] > 0 && (n[1] as f64 / d[1] as f64 - x).abs() <= RATIO * x {
            return Some((n[1], d[1]));
        }
        rest = 1.0 / (rest - whole);
    }
    None
}

/// The map of one axis of one source to positions, before the base is subtracted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisMap {
    /// `(i * mul + shift) / div`, rounded half to even.
    Ratio { mul: i64, shift: i64, div: i64 },
    /// `(v * scale + shift) / step`, rounded half to even.
    Real { scale: f64, shift: f64, step: f64 },
}

impl AxisMap {
    fn integer(self, i: i64) -> i128 {
        match self {
            Self::Ratio { mul, shift, div } => {
                let numerator = i128::from(i) * i128::from(mul) + i128::from(shift);
                divide_half_even(numerator, i128::from(div))
            }
            Self::Real { .. } => self.real(i as f64) as i128,
        }
    }

    fn real(self, v: f64) -> f64 {
        match self {
            Self::Ratio { .. } => f64::NAN,
            Self::Real { scale, shift, step } => nearest((v * scale + shift) / step),
        }
    }
}

/// Rounds half to even. Small numbers are rounded by adding and subtracting a large constant, which is faster
/// if the processor has no rounding instruction.
fn nearest(x: f64) -> f64 {
    const WHOLES: f64 = 1.5 * (1u64 << 52) as f64;
    if x.abs() < (1u64 << 51) as f64 {
        (x + WHOLES) - WHOLES
    } else {
        x.round_ties_even()
    }
}

fn divide_half_even(numerator: i128, divisor: i128) -> i128 {
    if divisor == 1 {
        return numerator;
    }
    let floor = numerator.div_euclid(divisor);
    let twice = 2 * numerator.rem_euclid(divisor);
    let up = twice > divisor || (twice == divisor && floor & 1 == 1);
    floor + i128::from(up)
}

/// The map of one source.
#[derive(Debug, Clone)]
pub(super) struct SourceMap {
    axes: [AxisMap; 3],
    /// Power of ten that makes the numbers of a text source integers.
    decimal: Option<f64>,
    /// True if every point of the source is on the lattice without rounding.
    pub(super) exact: bool,
}

impl SourceMap {
    /// The map to a lattice of `step` and `offset`; `None` if positions would exceed the limits.
    pub(super) fn new(source: &Source, step: f64, offset: [f64; 3]) -> Option<Self> {
        let [x, y, z] = [0, 1, 2].map(|axis| match source.grid(axis) {
            Some((scale, shift)) => grid_map(scale, shift - offset[axis], offset[axis], step),
            None => Some(float_map(source, offset[axis], step)),
        });
        let maps = [x?, y?, z?];
        Some(Self {
            axes: maps.map(|(map, _)| map),
            decimal: source.decimals().map(|d| 10f64.powi(d as i32)),
            exact: maps.iter().all(|(_, exact)| *exact),
        })
    }

    /// Lowest and highest position along an axis; `None` if they exceed the limits.
    pub(super) fn extent(&self, source: &Source, axis: usize) -> Option<[i64; 2]> {
        let a = self.position(source.native, axis, source.stats.min[axis])?;
        let b = self.position(source.native, axis, source.stats.max[axis])?;
        Some([a.min(b), a.max(b)])
    }

    fn position(&self, native: Native, axis: usize, value: f64) -> Option<i64> {
        let map = self.axes[axis];
        let position = match (native, self.decimal) {
            (Native::Las { .. }, _) => map.integer(value as i64),
            (_, Some(power)) => map.integer((value * power).round() as i64),
            _ => Some(map.real(value)).filter(|p| !p.is_nan())? as i128,
        };
        ((position as f64).abs() < POSITION_LIMIT).then_some(position as i64)
    }

    /// Converts a frame of the source to positions, minus `base`.
    pub(super) fn apply(
        &self,
        native: Native,
        frame: &FrameBuffer,
        base: [i64; 3],
        out: &mut Vec<[i64; 3]>,
    ) {
        out.clear();
        out.resize(frame.points, [0; 3]);
        for axis in 0..3 {
            let (map, base) = (self.axes[axis], base[axis]);
            match (native, self.decimal) {
                (Native::Las { .. }, _) => {
                    let values = frame.points::<i32>().iter().map(|p| i64::from(p[axis]));
                    integers(map, base, axis, values, out);
                }
                (Native::F64, Some(power)) => {
                    let values = frame.points::<f64>().iter();
                    let values = values.map(|p| (p[axis] * power).round() as i64);
                    integers(map, base, axis, values, out);
                }
                (Native::F64, None) => {
                    for (to, p) in out.iter_mut().zip(frame.points::<f64>()) {
                        to[axis] = (map.real(p[axis]) as i64).wrapping_sub(base);
                    }
                }
                (Native::F32, _) => {
                    for (to, p) in out.iter_mut().zip(frame.points::<f32>()) {
                        to[axis] = (map.real(f64::from(p[axis])) as i64).wrapping_sub(base);
                    }
                }
            }
        }
    }
}

fn integers(
    map: AxisMap,
    base: i64,
    axis: usize,
    values: impl Iterator<Item = i64>,
    out: &mut [[i64; 3]],
) {
    match map {
        // The extent was checked against the limit, so no value of the source overflows. A value that does
        // comes from a damaged spool and is rejected by its position.
        AxisMap::Ratio { mul, shift, div: 1 } => {
            let shift = shift.wrapping_sub(base);
            for (to, i) in out.iter_mut().zip(values) {
                to[axis] = i.wrapping_mul(mul).wrapping_add(shift);
            }
        }
        _ => {
            for (to, i) in out.iter_mut().zip(values) {
                to[axis] = (map.integer(i) as i64).wrapping_sub(base);
            }
        }
    }
}

/// The map of values on a grid of step `scale`, shifted by `shift` from the lattice's `origin`; true if it is
/// exact.
fn grid_map(scale: f64, shift: f64, origin: f64, step: f64) -> Option<(AxisMap, bool)> {
    let real = AxisMap::Real { scale, shift, step };
    let Some((mul, div)) = rational(scale.abs() / step, 10_000_000) else {
        return Some((real, false));
    };
    let mul = if scale < 0.0 { -mul } else { mul };
    let steps = shift / step * div as f64;
    if steps.abs() >= POSITION_LIMIT {
        return None;
    }
    let whole = steps.round_ties_even();
    // Offsets are decimals, which doubles represent approximately.
    let noise = (shift.abs() + 2.0 * origin.abs()) * f64::EPSILON / step;
    let on = div == 1 && (steps - whole).abs() <= RESIDUE + noise;
    let map = AxisMap::Ratio {
        mul,
        shift: whole as i64,
        div,
    };
    Some((map, on))
}

/// The map of floating-point values; true if all are on the lattice.
fn float_map(source: &Source, origin: f64, step: f64) -> (AxisMap, bool) {
    let map = AxisMap::Real {
        scale: 1.0,
        shift: -origin,
        step,
    };
    let power_of_two = step.is_normal() && step.to_bits() & ((1 << 52) - 1) == 0;
    let exponent = (step.to_bits() >> 52 & 0x7ff) as i32 - 1023;
    let on = origin == 0.0 && power_of_two && exponent <= source.stats.exponent;
    (map, on)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_ratios_of_decimals() {
        assert_eq!(rational(0.01 / 0.001, 100), Some((10, 1)));
        assert_eq!(rational(0.00025 / 0.001, 100), Some((1, 4)));
        assert_eq!(
            rational(1.000_000_000_000_000_2e-6 / 1e-7, 100),
            Some((10, 1))
        );
        assert_eq!(rational(std::f64::consts::PI, 1000), None);
        assert_eq!(rational(1e300, 1000), None);
        assert_eq!(rational(1e-300, 1000), None);
    }

    #[test]
    fn rounds_as_the_standard_library() {
        let large = (1u64 << 51) as f64;
        for x in [
            0.0,
            0.5,
            1.5,
            2.5,
            1e9 + 0.5,
            large - 0.5,
            large,
            large + 1.5,
            1e18,
        ] {
            for x in [x, x.next_up(), x.next_down(), f64::NAN, f64::INFINITY] {
                for x in [x, -x] {
                    let (got, want) = (nearest(x), x.round_ties_even());
                    assert!(got == want || got.is_nan() && want.is_nan(), "{x}: {got}");
                }
            }
        }
    }

    #[test]
    fn rounds_half_to_even() {
        let halves: Vec<i128> = (-5..=5).map(|n| divide_half_even(n, 2)).collect();
        assert_eq!(halves, [-2, -2, -2, -1, 0, 0, 0, 1, 2, 2, 2]);
        assert_eq!(divide_half_even(7, 5), 1);
        assert_eq!(divide_half_even(-8, 5), -2);
    }
}
