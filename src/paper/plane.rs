//! The plane through a point's neighbours (paper, sections 3.2 and 3.3).
//!
//! Sums are exact integers, so the order of the neighbours does not matter. The normal follows from them by a
//! fixed sequence of correctly rounded `+ - * / sqrt`.

mod spread;

use crate::kernels::eight::{Eight, loaded, stored};
use crate::kernels::numbers::Numbers;
use crate::kernels::pair::Pair;
use crate::kernels::{LANES, kernel};
use crate::method::METHOD;
use spread::{Spread, extent, normal};

/// A direction as an integer vector, about [`NORMAL_SCALE`] long.
///
/// Rounding turns the normal by less than 10⁻⁷ rad. In return the plane of the disk is exact, so that
/// predicates on it can be decided exactly.
pub type Normal = [i32; 3];

/// Length, in integer units, of a [`Normal`].
pub const NORMAL_SCALE: f64 = (1 << 24) as f64;

/// Moments whose planes are computed together.
pub const PLANES: usize = 2 * LANES;

/// The pairs of axes of the six second moments, in their order.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Exact first and second moments of the neighbours' differences to a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments {
    count: i64,
    sum: [i64; 3],
    /// Sums of the products xx, yy, zz, xy, xz, yz.
    products: [i128; 6],
}

/// The plane fitted to the moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The normal; `None` if all points are exactly on a line.
    pub normal: Option<Normal>,
    /// False if the points are so close to a line that the normal is unreliable.
    pub spans: bool,
    /// False if the points are so close to a narrow band that the normal is uncertain.
    pub wide: bool,
}

impl Plane {
    /// No plane.
    pub const NONE: Self = Self {
        normal: None,
        spans: false,
        wide: false,
    };
}

impl Moments {
    /// Adds the difference of a neighbour to the point.
    pub fn add(&mut self, d: [i64; 3]) {
        self.count += 1;
        self.shift(d);
        for (product, (a, b)) in self.products.iter_mut().zip(PAIRS) {
            *product += i128::from(d[a]) * i128::from(d[b]);
        }
    }

    fn shift(&mut self, d: [i64; 3]) {
        for (sum, x) in self.sum.iter_mut().zip(d) {
            *sum += x;
        }
    }

    /// Moments from sums over `count` differences: x, y, z, and xx, yy, zz, xy, xz, yz.
    #[must_use]
    pub fn from_sums(count: usize, sum: [i64; 3], products: [i64; 6]) -> Self {
        Self {
            count: count as i64,
            sum,
            products: std::array::from_fn(|i| i128::from(products[i])),
        }
    }

    /// Covariance times the squared number of points, the point itself included, in squared steps.
    #[inline(always)]
    fn scatter(&self) -> [f64; 6] {
        // The common case: everything fits machine words.
        let m = self.count + 1;
        let most = 1i64 << (62 - m.ilog2() - 1);
        let mut fits = self.sum.iter().all(|s| s.unsigned_abs() < 1 << 31);
        let mut scatter = [0.0; 6];
        for (i, (a, b)) in PAIRS.into_iter().enumerate() {
            let product = self.products[i];
            fits &= product.unsigned_abs() < most as u128;
            let scaled = (product as i64).wrapping_mul(m);
            let crossed = self.sum[a].wrapping_mul(self.sum[b]);
            scatter[i] = scaled.wrapping_sub(crossed) as f64;
        }
        if fits {
            return scatter;
        }
        self.wide_scatter(m).map(|x| x as f64)
    }

    /// As [`Moments::scatter`], exactly, of `m` points: with the point itself or without it.
    #[cold]
    fn wide_scatter(&self, m: i64) -> [i128; 6] {
        let m = i128::from(m);
        let s = self.sum.map(i128::from);
        std::array::from_fn(|i| m * self.products[i] - s[PAIRS[i].0] * s[PAIRS[i].1])
    }

    /// True if the point and its neighbours fill space instead of lying along a surface: their scatter along
    /// the normal is more than a tenth of that in all directions.
    #[must_use]
    pub fn fill_space(&self, normal: Normal) -> bool {
        let [xx, yy, zz, ..] = self.scatter();
        let (along, length2) = self.scatter_along(normal);
        METHOD.off_surface.space * along > (xx + yy + zz) * length2
    }

    /// The scatter along a normal, times the square of its length, and that square.
    fn scatter_along(&self, normal: Normal) -> (f64, f64) {
        let [xx, yy, zz, xy, xz, yz] = self.scatter();
        let [x, y, z] = normal.map(f64::from);
        let along =
            (xx * x * x + yy * y * y + zz * z * z) + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
        (along, x * x + y * y + z * z)
    }

    /// True if the point is beside the surface of its neighbours: farther from the plane through them alone than
    /// they are from their centroid (root mean square). A bird is beside the ground; a coarse point at the edge of a
    /// dense area is not, because it is on the plane.
    #[must_use]
    pub fn is_beside(&self) -> bool {
        let scatter = self.wide_scatter(self.count).map(|x| x as f64);
        let Some(normal) = least_direction(&scatter) else {
            return false;
        };
        let [x, y, z] = normal.map(f64::from);
        let [sx, sy, sz] = self.sum.map(|sum| sum as f64);
        let along = sx * x + sy * y + sz * z;
        along * along > (scatter[0] + scatter[1] + scatter[2]) * (x * x + y * y + z * z)
    }

    /// True if a direction suits the point and its neighbours as well as the `estimated` one, or nearly: their scatter
    /// along it is not much larger.
    #[must_use]
    pub fn suits(&self, estimated: Normal, given: Normal) -> bool {
        let [xx, yy, zz, ..] = self.scatter();
        let [estimated, given] = [estimated, given].map(|normal| {
            let (along, length2) = self.scatter_along(normal);
            along / length2
        });
        given <= METHOD.normals.scatter * estimated + METHOD.plane.line * (xx + yy + zz)
    }

    /// The best-fitting plane of the point and its neighbours.
    #[must_use]
    pub fn plane(&self) -> Plane {
        let scatter = self.scatter();
        if extent(&scatter) <= 0.0 {
            return Plane::NONE;
        }
        let spread = Spread::of(scatter);
        let spans = spread.on_lines() & 1 == 0;
        // Points that span a plane cannot be collinear.
        let normal = if !spans && self.collinear() {
            None
        } else {
            spread.normal()
        };
        Plane {
            normal,
            spans: spans && normal.is_some(),
            wide: spread.on_bands() & 1 == 0 && normal.is_some(),
        }
    }

    /// True if the point and all its neighbours are exactly collinear: the scatter matrix has rank one.
    fn collinear(&self) -> bool {
        let c = self.wide_scatter(self.count + 1);
        let zero = |a: i128, b: i128, ab: i128| match (a.checked_mul(b), ab.checked_mul(ab)) {
            (Some(x), Some(y)) => x == y,
            // Too large for exact arithmetic: compared in floating point.
            _ => a as f64 * b as f64 == ab as f64 * ab as f64,
        };
        zero(c[0], c[1], c[3]) && zero(c[0], c[2], c[4]) && zero(c[1], c[2], c[5])
    }

    /// Offset, in steps, from the point to its foot on the plane with `normal` through the centroid.
    #[must_use]
    #[inline]
    pub fn project(&self, [x, y, z]: Normal) -> [f64; 3] {
        let n = [f64::from(x), f64::from(y), f64::from(z)];
        let m = (self.count + 1) as f64;
        let [x, y, z] = self.sum;
        let c = [x as f64 / m, y as f64 / m, z as f64 / m];
        let along =
            (c[0] * n[0] + c[1] * n[1] + c[2] * n[2]) / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        [n[0] * along, n[1] * along, n[2] * along]
    }
}

/// The direction of least scatter (xx, yy, zz, xy, xz, yz), computed as in [`Moments::plane`]; `None` if all
/// points coincide.
#[must_use]
pub fn least_direction(scatter: &[f64; 6]) -> Option<Normal> {
    let largest = extent(scatter);
    if largest > 0.0 && largest.is_finite() {
        Spread::of(*scatter).normal()
    } else {
        None
    }
}

kernel! {
    /// The directions of least scatter of several scatters, equal to [`least_direction`] of each.
    pub fn least_directions(scatters: &[[f64; LANES]; 6]) -> [Option<Normal>; LANES] = least_body<Eight>
}

#[inline(always)]
fn least_body<F: Eight>(scatters: &[[f64; LANES]; 6]) -> [Option<Normal>; LANES] {
    let (_, directions, known) = directions(loaded::<F, 6>(scatters));
    let [x, y, z] = stored(directions);
    let mut normals = [None; LANES];
    for (lane, to) in normals.iter_mut().enumerate() {
        *to = if known >> lane & 1 == 1 {
            Some(normal([x[lane], y[lane], z[lane]]))
        } else {
            least_direction(&lane_of(scatters, lane))
        };
    }
    normals
}

#[cold]
fn lane_of<const N: usize>(columns: &[[f64; LANES]; N], lane: usize) -> [f64; N] {
    columns.map(|column| column[lane])
}

/// The spreads of several scatters and the directions of least scatter, with the bits of those that are known.
#[inline(always)]
fn directions<F: Numbers>(scatters: [F; 6]) -> (Spread<F>, [F; 3], u64) {
    let spread = Spread::of(scatters);
    let (direction, length) = spread.direction();
    let (zero, infinity) = (F::splat(0.0), F::splat(f64::INFINITY));
    let largest = extent(&scatters);
    let some = largest.greater(zero) & infinity.greater(largest);
    let known = some & length.greater(zero) & infinity.greater(length);
    (spread, direction, known)
}

kernel! {
    /// The planes of several moments at a time, equal to [`Moments::plane`] of each.
    pub fn planes(moments: &[Moments; PLANES]) -> [Plane; PLANES] = planes_body<Eight>
}

#[inline(always)]
fn planes_body<F: Eight>(moments: &[Moments; PLANES]) -> [Plane; PLANES] {
    let mut columns = [[[0.0; LANES]; 6]; 2];
    for (place, moments) in moments.iter().enumerate() {
        let scatter = moments.scatter();
        for (column, x) in columns[place / LANES].iter_mut().zip(scatter) {
            column[place % LANES] = x;
        }
    }
    let [low, high] = [loaded(&columns[0]), loaded(&columns[1])];
    let mut scatters = [Pair(F::splat(0.0), F::splat(0.0)); 6];
    for (to, (low, high)) in scatters.iter_mut().zip(low.into_iter().zip(high)) {
        *to = Pair(low, high);
    }
    let (spread, [x, y, z], known) = directions(scatters);
    let known = known & !spread.on_lines();
    let narrow = spread.on_bands();
    let halves = [stored([x.0, y.0, z.0]), stored([x.1, y.1, z.1])];
    let mut planes = [Plane::NONE; PLANES];
    for (place, plane) in planes.iter_mut().enumerate() {
        // Points on a line or all in one place: rare, and handled by other formulas.
        if known >> place & 1 == 0 {
            *plane = moments[place].plane();
            continue;
        }
        let ([x, y, z], lane) = (&halves[place / LANES], place % LANES);
        *plane = Plane {
            normal: Some(normal([x[lane], y[lane], z[lane]])),
            spans: true,
            wide: narrow >> place & 1 == 0,
        };
    }
    planes
}

#[cfg(test)]
mod tests;
