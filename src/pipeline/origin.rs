//! The origin of the mesh's coordinates (`--origin`): a lattice position, so that local coordinates are whole
//! numbers of steps.

use outcrop_disk::error::{Error, Result};
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::{COORDINATE_LIMIT, Lattice, Shift};
use outcrop_points::CoordinateType;

/// Units of automatic origins, if they are whole numbers of steps. Adjacent clouds are likely to have the same
/// multiple of a large unit.
const UNITS: [f64; 13] = [
    1e3, 1e2, 1e1, 1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9,
];

/// Largest number of steps between an origin and the cloud; sums and products of such numbers are exact.
const FARTHEST: f64 = (1u64 << 52) as f64;

/// The lattice, and its step before it was refined.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steps<'a> {
    pub lattice: &'a Lattice,
    /// A power of two times the step of the lattice.
    pub coarse: f64,
}

impl Steps<'_> {
    /// The shift of a cloud with these bounds to a round position below it: a multiple of the largest unit with
    /// which single precision suffices, else of the largest that is not above the extent of the cloud. None if
    /// the origin is there already.
    pub fn automatic(&self, bounds: Aabb) -> Option<Shift> {
        let [min, max] = [bounds.min, bounds.max].map(|corner| self.lattice.position(corner));
        let extent = (0..3).map(|a| max[a] - min[a]).fold(0.0, f64::max);
        let below = |unit: f64| self.shift(min.map(|c| (c / unit).floor() * unit));
        let units = self.units();
        let single = units.iter().find_map(|unit| {
            below(*unit).filter(|shift| self.precision(shift, bounds) == CoordinateType::F32)
        });
        let suited = || {
            let suited = units.iter().find(|unit| **unit <= extent);
            below(*suited.or(units.last())?)
        };
        let shift = single.or_else(suited)?;
        (shift.origin != [0.0; 3]).then_some(shift)
    }

    /// The units of automatic origins, descending: round decimals, then round numbers of steps.
    fn units(&self) -> Vec<f64> {
        let step = self.coarse;
        let whole = |unit: &f64| {
            let steps = unit / step;
            steps >= 1.0 && (steps - steps.round()).abs() <= 1e-9 * steps
        };
        let mut units: Vec<f64> = UNITS.into_iter().filter(whole).collect();
        // Below them round numbers of steps, in the system of the step.
        let binary = step.to_bits() & ((1 << 52) - 1) == 0;
        let factor = if binary { 2.0 } else { 10.0 };
        let most = units.last().copied().unwrap_or(UNITS[0]);
        let powers = std::iter::successors(Some(step), |unit| Some(unit * factor));
        let powers: Vec<f64> = powers.take_while(|unit| *unit < most).collect();
        units.extend(powers.into_iter().rev());
        if units.is_empty() {
            units.push(step);
        }
        units
    }

    /// The shift to the lattice position nearest to the given one; none if it is too far away.
    fn shift(&self, to: [f64; 3]) -> Option<Shift> {
        let lattice = self.lattice;
        let refined = (self.coarse / lattice.step) as i64;
        let mut shift = Shift {
            steps: [0; 3],
            origin: [0.0; 3],
        };
        for (axis, to) in to.into_iter().enumerate() {
            let offset = lattice.offset[axis];
            let steps = ((to - offset) / self.coarse).round();
            let far = steps * refined as f64 - lattice.base[axis] as f64;
            if far.is_nan() || far.abs() >= FARTHEST - COORDINATE_LIMIT as f64 {
                return None;
            }
            shift.steps[axis] = (steps as i64).checked_mul(refined)?;
            let noise = 1e-6 * self.coarse + 2.0 * f64::EPSILON * (to.abs() + offset.abs());
            shift.origin[axis] = decimal(steps * self.coarse + offset, noise);
        }
        Some(shift)
    }

    /// The shift to the lattice position nearest to the given one.
    ///
    /// # Errors
    /// [`Error::Parameter`] if it is too far from the cloud.
    pub fn given(&self, to: [f64; 3]) -> Result<Shift> {
        self.shift(to).ok_or_else(|| Error::Parameter {
            name: "origin",
            found: format!("{},{},{}", to[0], to[1], to[2]),
            expected: format!(
                "a position within 2^52 steps of {} of the cloud",
                self.coarse
            ),
        })
    }

    /// The precision that suffices for the local coordinates of a cloud with these bounds.
    pub fn precision(&self, shift: &Shift, bounds: Aabb) -> CoordinateType {
        let corners = [bounds.min, bounds.max].map(|corner| self.lattice.shifted(corner, shift));
        let largest = corners.as_flattened().iter();
        outcrop_points::enough_for(self.coarse, largest.fold(0.0, |m, c| m.max(c.abs())))
    }
}

/// The number with the fewest decimals within `noise` of `x`.
fn decimal(x: f64, noise: f64) -> f64 {
    let powers = (0..=15).map(|decimals| 10f64.powi(decimals));
    let rounded = powers.map(|power| (x * power).round() / power);
    // Adding zero turns a negative one into a positive one.
    rounded
        .take_while(|rounded| rounded.is_finite())
        .find(|rounded| (rounded - x).abs() <= noise)
        .unwrap_or(x)
        + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(step: f64, offset: [f64; 3], base: [i64; 3]) -> Lattice {
        Lattice {
            step,
            offset,
            base,
            exact: true,
        }
    }

    fn automatic(lattice: &Lattice, max: [i32; 3]) -> [f64; 3] {
        let steps = Steps {
            lattice,
            coarse: lattice.step,
        };
        let shift = steps.automatic(Aabb { min: [0; 3], max }).unwrap();
        for axis in 0..3 {
            let at = shift.steps[axis] as f64 * lattice.step + lattice.offset[axis];
            assert!((at - shift.origin[axis]).abs() < 1e-6 * lattice.step + 1e-9);
            let from = lattice.shifted([0; 3], &shift)[axis];
            assert!(from >= 0.0, "{from}");
        }
        shift.origin
    }

    #[test]
    fn automatic_origins_are_round() {
        let feet = lattice(0.01, [0.0; 3], [63_601_234, 84_801_234, 40_612]);
        assert_eq!(
            automatic(&feet, [500_000, 400_000, 60_000]),
            [636_000.0, 848_000.0, 0.0]
        );
        // A statue: thousands would take the precision away.
        let fine = lattice(1e-5, [0.0; 3], [63_605_234_000, 84_801_234_000, 40_612_000]);
        assert_eq!(
            automatic(&fine, [250_000, 200_000, 300_000]),
            [636_050.0, 848_010.0, 400.0]
        );
        // Wider than what single precision can hold.
        assert_eq!(
            automatic(&feet, [50_000_000; 3]),
            [636_000.0, 848_000.0, 0.0]
        );
        // An offset between the steps stays in the origin.
        let odd = lattice(
            0.01,
            [600_000.002, 0.25, 0.0],
            [3_601_234, 84_801_234, -612],
        );
        assert_eq!(
            automatic(&odd, [500_000, 400_000, 60_000]),
            [636_000.002, 848_000.0, -1000.0]
        );
        // 1000 is not a multiple of the step, 300 is.
        let threes = lattice(0.003, [0.0; 3], [212_004_113, 1, 1]);
        assert_eq!(automatic(&threes, [500_000; 3])[0], 636_000.0);
        let binary = lattice(2f64.powi(-10), [0.0; 3], [651_277_000, 868_352_001, 5]);
        assert_eq!(
            automatic(&binary, [5_000_000; 3]),
            [636_000.0, 848_000.0, 0.0]
        );
        let tiny = lattice(2f64.powi(-30), [0.0; 3], [682_911_875_000_000, 7, 5]);
        let at = automatic(&tiny, [300; 3]);
        assert_eq!(at[0].fract() * 1024.0 % 1.0, 0.0);
        assert!((636_011.0..636_012.0).contains(&at[0]));
    }

    #[test]
    fn given_origins_are_rounded_to_the_lattice() {
        let fine = lattice(0.01 / 1024.0, [0.5, 0.0, 0.0], [63_601_234 << 10, 0, 0]);
        let steps = Steps {
            lattice: &fine,
            coarse: 0.01,
        };
        let shift = steps.given([636_000.123, -0.004, 7.0]).unwrap();
        assert_eq!(shift.origin, [636_000.12, 0.0, 7.0]);
        assert_eq!(shift.steps, [63_599_962 << 10, 0, 700 << 10]);
        assert!(shift.origin[1].is_sign_positive());
        for far in [1e20, -1e300, f64::MAX] {
            let error = steps.given([0.0, far, 0.0]).unwrap_err().to_string();
            assert!(error.starts_with("origin: "), "{error}");
        }
    }
}
