//! The plane through a point's neighbours (paper, sections 3.2 and 3.3).
//!
//! Sums are exact integers, so they do not depend on the order of the neighbours; from there on
//! one fixed sequence of `+ - * / sqrt` (all correctly rounded) leads to the normal.

/// A direction as an integer vector; its longest component is about [`NORMAL_SCALE`].
///
/// Rounding the normal costs less than a ten-millionth of a radian and makes the disk's plane
/// exact, so that predicates on it can be decided exactly.
pub type Normal = [i32; 3];

/// Length, in integer units, of a [`Normal`].
pub const NORMAL_SCALE: f64 = (1 << 24) as f64;

/// If the middle eigenvalue is below this share of the largest, the points lie on a line.
const LINE_RATIO: f64 = 1.0 / 400.0;

/// Below this share they lie on a band so narrow that its normal is a matter of chance.
const BAND_RATIO: f64 = 1.0 / 25.0;

/// The axes of second moments, in their order.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Exact first and second moments of differences to a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments {
    count: i64,
    sum: [i64; 3],
    /// xx, yy, zz, xy, xz, yz.
    products: [i128; 6],
}

/// What the moments say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The normal; `None` if all points are exactly on a line.
    pub normal: Option<Normal>,
    /// False if the points are so close to a line that the normal means little.
    pub spans: bool,
    /// False if they are so close to a narrow band that the normal is unsure.
    pub wide: bool,
}

impl Moments {
    /// Takes in the difference of a neighbour to the point itself.
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

    /// From sums over `count` differences: x, y, z, and xx, yy, zz, xy, xz, yz.
    #[must_use]
    pub fn from_sums(count: usize, sum: [i64; 3], products: [i64; 6]) -> Self {
        Self {
            count: count as i64,
            sum,
            products: std::array::from_fn(|i| i128::from(products[i])),
        }
    }

    /// Covariance times the number of points (the point itself among them), in squared steps.
    fn scatter(&self) -> [f64; 6] {
        // Machine words where everything fits: almost always.
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
        self.wide_scatter().map(|x| x as f64)
    }

    fn wide_scatter(&self) -> [i128; 6] {
        let m = i128::from(self.count + 1);
        let s = self.sum.map(i128::from);
        std::array::from_fn(|i| m * self.products[i] - s[PAIRS[i].0] * s[PAIRS[i].1])
    }

    /// The best-fitting plane of the point and its neighbours.
    #[must_use]
    pub fn plane(&self) -> Plane {
        let scatter = self.scatter();
        let largest = scatter[0].max(scatter[1]).max(scatter[2]);
        if largest <= 0.0 {
            return Plane {
                normal: None,
                spans: false,
                wide: false,
            };
        }
        let m = scatter.map(|x| x / largest);
        let least = least_eigenvalue(&m);
        let trace = m[0] + m[1] + m[2];
        // The two others, from the trace and the sum of the principal minors.
        let rest = trace - least;
        let product = (minors(&m) - least * rest).max(0.0);
        let top = 0.5 * (rest + (rest * rest - 4.0 * product).max(0.0).sqrt());
        let middle = if top > 0.0 { product / top } else { 0.0 };
        let spans = middle >= LINE_RATIO * top;
        // Points that span a plane are not on a line.
        let normal = if !spans && self.collinear() {
            None
        } else {
            eigenvector(&m, least)
        };
        Plane {
            normal,
            spans: spans && normal.is_some(),
            wide: middle >= BAND_RATIO * top && normal.is_some(),
        }
    }

    /// True if the point and all its neighbours are exactly on a line: the scatter has rank one.
    fn collinear(&self) -> bool {
        let c = self.wide_scatter();
        let zero = |a: i128, b: i128, ab: i128| match (a.checked_mul(b), ab.checked_mul(ab)) {
            (Some(x), Some(y)) => x == y,
            // Too large for exact arithmetic: equal in floating point is equal enough.
            _ => a as f64 * b as f64 == ab as f64 * ab as f64,
        };
        zero(c[0], c[1], c[3]) && zero(c[0], c[2], c[4]) && zero(c[1], c[2], c[5])
    }

    /// Offset from the point to its foot on the plane with `normal` through the centroid, in steps.
    #[must_use]
    pub fn project(&self, normal: Normal) -> [f64; 3] {
        let n = normal.map(f64::from);
        let m = (self.count + 1) as f64;
        let c = self.sum.map(|s| s as f64 / m);
        let along =
            (c[0] * n[0] + c[1] * n[1] + c[2] * n[2]) / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        n.map(|x| x * along)
    }
}

/// The nearest integer, away from zero in the middle, as `round` has it, without a call.
#[inline]
fn rounded(x: f64) -> i32 {
    let whole = x as i32;
    let rest = x - f64::from(whole);
    whole + i32::from(rest >= 0.5) - i32::from(rest <= -0.5)
}

/// The direction in which a scatter (xx, yy, zz, xy, xz, yz) is least, by the steps of
/// [`Moments::plane`]; `None` without any extent.
#[must_use]
pub fn least_direction(scatter: &[f64; 6]) -> Option<Normal> {
    let largest = scatter[0].max(scatter[1]).max(scatter[2]);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let m = scatter.map(|x| x / largest);
    eigenvector(&m, least_eigenvalue(&m))
}

fn minors(m: &[f64; 6]) -> f64 {
    (m[0] * m[1] - m[3] * m[3]) + (m[0] * m[2] - m[4] * m[4]) + (m[1] * m[2] - m[5] * m[5])
}

/// Newton's method from below on the characteristic polynomial, which is monotone up to its
/// least root.
fn least_eigenvalue(m: &[f64; 6]) -> f64 {
    let trace = m[0] + m[1] + m[2];
    let minors = minors(m);
    let determinant = m[0] * (m[1] * m[2] - m[5] * m[5]) - m[3] * (m[3] * m[2] - m[5] * m[4])
        + m[4] * (m[3] * m[5] - m[1] * m[4]);
    let mut x = 0.0f64;
    for _ in 0..40 {
        let value = ((trace - x) * x - minors) * x + determinant;
        let slope = (2.0 * trace - 3.0 * x) * x - minors;
        if value <= 0.0 || slope >= 0.0 {
            break;
        }
        let next = x - value / slope;
        if next <= x {
            break;
        }
        x = next;
    }
    x
}

/// The direction that `m - lambda` maps to nothing: the longest cross product of its rows.
fn eigenvector(m: &[f64; 6], lambda: f64) -> Option<Normal> {
    let rows = [
        [m[0] - lambda, m[3], m[4]],
        [m[3], m[1] - lambda, m[5]],
        [m[4], m[5], m[2] - lambda],
    ];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let length2 = |v: [f64; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let candidates = [
        cross(rows[0], rows[1]),
        cross(rows[0], rows[2]),
        cross(rows[1], rows[2]),
    ];
    let mut best = candidates[0];
    for candidate in candidates {
        if length2(candidate) > length2(best) {
            best = candidate;
        }
    }
    let length = length2(best).sqrt();
    if length > 0.0 && length.is_finite() {
        return Some(best.map(|x| rounded(x / length * NORMAL_SCALE)));
    }
    // All rows are parallel (points almost on a line): any direction across the longest row.
    let mut row = rows[0];
    for candidate in rows {
        if length2(candidate) > length2(row) {
            row = candidate;
        }
    }
    let least = (0..3).min_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()))?;
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let across = cross(row, axis);
    let length = length2(across).sqrt();
    (length > 0.0).then(|| across.map(|x| rounded(x / length * NORMAL_SCALE)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn moments(points: &[[i64; 3]]) -> Moments {
        let mut m = Moments::default();
        points.iter().for_each(|&p| m.add(p));
        m
    }

    proptest! {
        #[test]
        fn finds_the_plane_of_points_on_a_plane(
            u in prop::array::uniform3(-1000i64..1000),
            v in prop::array::uniform3(-1000i64..1000),
            steps in prop::collection::vec((-50i64..50, -50i64..50), 8..30),
        ) {
            let points: Vec<_> = steps.iter()
                .map(|(a, b)| std::array::from_fn(|i| a * u[i] + b * v[i])).collect();
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
                .map(|x| x as f64);
            let plane = moments(&points).plane();
            if plane.spans {
                let got = plane.normal.unwrap().map(f64::from);
                let dot = (0..3).map(|i| got[i] * n[i]).sum::<f64>();
                let len = |x: [f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
                prop_assert!((dot.abs() / (len(got) * len(n)) - 1.0).abs() < 1e-9, "{got:?} {n:?}");
            }
        }

        #[test]
        fn scatter_is_that_of_wide_words(
            points in prop::collection::vec(prop::array::uniform3(-(1i64 << 30)..1 << 30), 1..40),
            shift in 0u32..31,
        ) {
            let points: Vec<_> = points.iter().map(|p| p.map(|c| c >> shift)).collect();
            let m = moments(&points);
            prop_assert_eq!(m.scatter(), m.wide_scatter().map(|x| x as f64));
        }

        #[test]
        fn rounding_is_to_the_nearest(x in -(1 << 24)..=1i32 << 24, part in -1.0f64..1.0) {
            for x in [f64::from(x) + part, f64::from(x) + 0.5, 0.499_999_999_999_999_94] {
                prop_assert_eq!(rounded(x), x.round() as i32);
                prop_assert_eq!(rounded(-x), (-x).round() as i32);
            }
        }

        #[test]
        fn the_residual_is_least(
            points in prop::collection::vec(prop::array::uniform3(-1000i64..1000), 4..20),
            tilt in prop::array::uniform3(-0.05f64..0.05),
        ) {
            let m = moments(&points);
            let Some(n) = m.plane().normal else { return Ok(()) };
            let s = m.scatter();
            let cost = |n: [f64; 3]| {
                let l = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
                (s[0] * n[0] * n[0] + s[1] * n[1] * n[1] + s[2] * n[2] * n[2]
                    + 2.0 * (s[3] * n[0] * n[1] + s[4] * n[0] * n[2] + s[5] * n[1] * n[2])) / l
            };
            let n = n.map(|x| f64::from(x) / NORMAL_SCALE);
            let tilted = std::array::from_fn(|i| n[i] + tilt[i]);
            prop_assert!(cost(n) <= cost(tilted) + 1e-6 * (s[0] + s[1] + s[2]));
        }
    }

    #[test]
    fn a_line_has_no_plane() {
        let line: Vec<_> = (1..20).map(|i| [i, 2 * i, -3 * i]).collect();
        assert_eq!(
            moments(&line).plane(),
            Plane {
                normal: None,
                spans: false,
                wide: false
            }
        );
        assert_eq!(moments(&[]).plane().normal, None);
    }
}
