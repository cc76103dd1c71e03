//! Sums that do not depend on the order of what is added: integers of a fixed unit.
//!
//! A contribution is computed in double precision from the corners of one triangle, or of one piece of one, and
//! is then rounded to a whole number of units. The unit is 2^-86 of the largest contribution that the box of the
//! mesh allows, far below the rounding of the contribution itself (2^-53 of it, unless it is very small). So the
//! error of a sum is that of its contributions: with `A` the area in plan of all triangles, facing up and down,
//! and `H` the largest difference of heights, a volume is off by at most `2^-49 A H`, an area by at most `2^-49`
//! times the sum of the products of two sides of each triangle.

/// Binary digits of the largest contribution. The sum has 127: there is room for 2^40 contributions.
const DIGITS: i32 = 86;

/// Largest exponent of the factor that makes contributions integers: what is smaller counts as 0.
const LARGEST: i32 = 1000;

/// The unit of a sum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// Units in 1, a power of 2.
    factor: f64,
}

impl Scale {
    /// For contributions up to `largest`, or twice that where rounding made them larger.
    pub fn of(largest: f64) -> Self {
        let bits = largest.max(f64::MIN_POSITIVE).to_bits();
        // One more than the exponent: `largest` is below 2^exponent.
        let exponent = (bits >> 52) as i32 - 1022;
        let shift = (DIGITS - exponent).clamp(-LARGEST, LARGEST);
        Self {
            factor: 2f64.powi(shift),
        }
    }

    /// A contribution as an integer.
    pub fn whole(self, contribution: f64) -> i128 {
        (contribution * self.factor) as i128
    }

    /// The value of a sum.
    pub fn value(self, sum: i128) -> f64 {
        sum as f64 / self.factor
    }
}

/// The units of areas and volumes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    pub area: Scale,
    pub volume: Scale,
}

impl Scales {
    /// For surfaces of this extent in plan and this largest difference of heights.
    pub fn of([x, y]: [f64; 2], height: f64) -> Self {
        Self {
            area: Scale::of(x * y),
            volume: Scale::of(x * y * height),
        }
    }
}

/// The area of a triangle in plan: positive if its corners run counterclockwise, seen from above.
pub(crate) fn plan_area([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2.0
}

/// What lies above and below height 0 under triangles, signed: a triangle that faces down counts less than 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Layers {
    /// Volumes between the surface and the level, where the surface is above it, and where it is below.
    pub volumes: [i128; 2],
    /// Areas in plan, likewise.
    pub areas: [i128; 2],
    /// Areas in plan of what faces up, and of what faces down.
    pub facing: [i128; 2],
}

impl Layers {
    /// Adds a triangle of this area in plan with these heights of its corners.
    pub fn add(&mut self, scales: &Scales, area: f64, heights: [f64; 3]) {
        let (volumes, areas) = split(area, heights);
        for side in 0..2 {
            if areas[side] != 0.0 {
                self.volumes[side] += scales.volume.whole(volumes[side]);
                self.areas[side] += scales.area.whole(areas[side]);
            }
        }
        self.facing[usize::from(area < 0.0)] += scales.area.whole(area.abs());
    }

    /// Adds what others have.
    pub fn join(&mut self, other: &Self) {
        let add = |sums: &mut [i128; 2], more: &[i128; 2]| {
            sums[0] += more[0];
            sums[1] += more[1];
        };
        add(&mut self.volumes, &other.volumes);
        add(&mut self.areas, &other.areas);
        add(&mut self.facing, &other.facing);
    }

    /// The same, seen from below.
    pub fn turned(&self) -> Self {
        Self {
            volumes: self.volumes.map(|sum| -sum),
            areas: self.areas.map(|sum| -sum),
            facing: [self.facing[1], self.facing[0]],
        }
    }

    /// The signed area in plan.
    pub fn cover(&self) -> i128 {
        self.areas[0] + self.areas[1]
    }
}

/// Volumes and areas of the parts of a triangle above and below height 0, all with the sign of its area in plan.
fn split(area: f64, heights: [f64; 3]) -> ([f64; 2], [f64; 2]) {
    let whole = area * ((heights[0] + heights[1] + heights[2]) / 3.0);
    let above = heights.map(|height| height > 0.0);
    if heights.iter().all(|height| *height >= 0.0) {
        return ([whole, 0.0], [area, 0.0]);
    }
    if !above.contains(&true) {
        return ([0.0, -whole], [0.0, area]);
    }
    // The corner that is alone on its side, which is a smaller triangle of the same kind.
    let side = above.iter().filter(|above| **above).count() == 1;
    let alone = (0..3).find(|k| above[*k] == side).unwrap_or(0);
    let [h, i, j] = [0, 1, 2].map(|k| heights[(alone + k) % 3]);
    let part = area * (h / (h - i)) * (h / (h - j));
    let volume = part * (h / 3.0);
    match side {
        true => ([volume, volume - whole], [part, area - part]),
        false => ([whole - volume, -volume], [area - part, part]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_split_at_the_level() {
        // A ridge of height 1 over a triangle of area 2, of which the level cuts off all but a quarter.
        let (volumes, areas) = split(2.0, [1.0, -1.0, -1.0]);
        assert_eq!(areas, [0.5, 1.5]);
        assert!((volumes[0] - 0.5 / 3.0).abs() < 1e-15);
        assert!((volumes[0] - volumes[1] + 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(split(-2.0, [1.0, 1.0, 1.0]), ([-2.0, 0.0], [-2.0, 0.0]));
        assert_eq!(split(2.0, [0.0, -3.0, 0.0]), ([0.0, 2.0], [0.0, 2.0]));
        // A corner on the level.
        let (volumes, areas) = split(1.0, [0.0, 1.0, -1.0]);
        assert_eq!((areas, volumes[0]), ([0.5, 0.5], volumes[1]));
        let (one, other) = (split(1.0, [1.0, 2.0, -4.0]), split(1.0, [-1.0, -2.0, 4.0]));
        assert_eq!((one.0[0], one.1[0]), (other.0[1], other.1[1]));
    }

    #[test]
    fn sums_do_not_depend_on_order_and_keep_small_parts() {
        let scale = Scale::of(1e6);
        let parts: Vec<f64> = (0..1000).map(|n| 1e6 / f64::from(n * n + 1)).collect();
        let all = |parts: &mut dyn Iterator<Item = &f64>| parts.map(|x| scale.whole(*x)).sum();
        let (one, other): (i128, i128) = (all(&mut parts.iter()), all(&mut parts.iter().rev()));
        assert_eq!(one, other);
        let exact: f64 = parts.iter().rev().sum();
        assert!((scale.value(one) / exact - 1.0).abs() < 1e-15);
        for largest in [1e-250, 1e-3, 1.0, 1e10, 1e210] {
            let scale = Scale::of(largest);
            let value = scale.value(scale.whole(largest) * (1 << 39));
            assert!((value / largest / (1u64 << 39) as f64 - 1.0).abs() < 1e-12);
        }
    }
}
