//! Eigenvalues of a scatter matrix and the direction of least scatter, for one point or eight at a time.

use super::{NORMAL_SCALE, Normal};
use crate::kernels::numbers::Numbers;
use crate::method::METHOD;
use outcrop_geom::round::rounded;

/// A scatter matrix that is not zero, divided by the largest of its diagonal, and its eigenvalues.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread<F> {
    /// xx, yy, zz, xy, xz, yz.
    m: [F; 6],
    least: F,
    middle: F,
    top: F,
}

/// The largest of a scatter's diagonal. If it is 0, all points coincide and there is no [`Spread`].
#[inline(always)]
pub(super) fn extent<F: Numbers>(scatter: &[F; 6]) -> F {
    scatter[0].larger(scatter[1]).larger(scatter[2])
}

impl<F: Numbers> Spread<F> {
    #[inline(always)]
    pub fn of(scatter: [F; 6]) -> Self {
        let largest = extent(&scatter);
        let [a, b, c, d, e, f] = scatter;
        let m = [
            a / largest,
            b / largest,
            c / largest,
            d / largest,
            e / largest,
            f / largest,
        ];
        let least = least_eigenvalue(&m);
        let trace = m[0] + m[1] + m[2];
        // The other two eigenvalues, from the trace and the sum of the principal minors.
        let zero = F::splat(0.0);
        let rest = trace - least;
        let product = (minors(&m) - least * rest).larger(zero);
        let square = (rest * rest - F::splat(4.0) * product).larger(zero);
        let top = F::splat(0.5) * (rest + square.sqrt());
        let [middle] = F::choose(top.greater(zero), [product / top], [zero]);
        Self {
            m,
            least,
            middle,
            top,
        }
    }

    /// Bits of the lanes whose points lie on a line.
    #[inline(always)]
    pub fn on_lines(&self) -> u64 {
        (F::splat(METHOD.plane.line) * self.top).greater(self.middle)
    }

    /// Bits of the lanes whose points lie on a narrow band.
    #[inline(always)]
    pub fn on_bands(&self) -> u64 {
        (F::splat(METHOD.plane.band) * self.top).greater(self.middle)
    }

    /// The null direction of `m - least`: the longest cross product of its rows, scaled to the length of a
    /// [`Normal`], and the length of the product. If that is 0 there is no such direction.
    #[inline(always)]
    pub fn direction(&self) -> ([F; 3], F) {
        let [a, b, c] = self.rows();
        let with_length2 = |v: [F; 3]| [v[0], v[1], v[2], length2(v)];
        let mut best = with_length2(cross(a, b));
        for other in [cross(a, c), cross(b, c)] {
            let other = with_length2(other);
            best = F::choose(other[3].greater(best[3]), other, best);
        }
        let [x, y, z, length2] = best;
        let length = length2.sqrt();
        let scale = F::splat(NORMAL_SCALE);
        let direction = [x / length * scale, y / length * scale, z / length * scale];
        (direction, length)
    }

    #[inline(always)]
    fn rows(&self) -> [[F; 3]; 3] {
        let (m, least) = (&self.m, self.least);
        [
            [m[0] - least, m[3], m[4]],
            [m[3], m[1] - least, m[5]],
            [m[4], m[5], m[2] - least],
        ]
    }
}

impl Spread<f64> {
    /// The direction of least scatter.
    #[inline(always)]
    pub fn normal(&self) -> Option<Normal> {
        let (direction, length) = self.direction();
        if length > 0.0 && length.is_finite() {
            return Some(normal(direction));
        }
        self.across()
    }

    /// A direction across the longest row, for points almost on a line: all rows are parallel.
    #[cold]
    fn across(&self) -> Option<Normal> {
        let rows = self.rows();
        let mut row = rows[0];
        for other in rows {
            if length2(other) > length2(row) {
                row = other;
            }
        }
        let least = (0..3).min_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()))?;
        let mut axis = [0.0; 3];
        axis[least] = 1.0;
        let across = cross(row, axis);
        let length = length2(across).sqrt();
        (length > 0.0).then(|| normal(across.map(|x| x / length * NORMAL_SCALE)))
    }
}

#[inline(always)]
fn cross<F: Numbers>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn length2<F: Numbers>(v: [F; 3]) -> F {
    v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
}

#[inline(always)]
fn minors<F: Numbers>(m: &[F; 6]) -> F {
    (m[0] * m[1] - m[3] * m[3]) + (m[0] * m[2] - m[4] * m[4]) + (m[1] * m[2] - m[5] * m[5])
}

/// Newton's method for the least root of the characteristic polynomial, from below, where the polynomial is
/// monotone. It ends where the next value is no larger: values only grow, and not beyond the root.
#[inline(always)]
fn least_eigenvalue<F: Numbers>(m: &[F; 6]) -> F {
    let (zero, two, three) = (F::splat(0.0), F::splat(2.0), F::splat(3.0));
    let trace = m[0] + m[1] + m[2];
    let minors = minors(m);
    let determinant = m[0] * (m[1] * m[2] - m[5] * m[5]) - m[3] * (m[3] * m[2] - m[5] * m[4])
        + m[4] * (m[3] * m[5] - m[1] * m[4]);
    let mut x = zero;
    let mut going = F::ALL;
    loop {
        let value = ((trace - x) * x - minors) * x + determinant;
        let slope = (two * trace - three * x) * x - minors;
        going &= value.greater(zero) & zero.greater(slope);
        if going == 0 {
            break;
        }
        let next = x - value / slope;
        going &= next.greater(x);
        if going == 0 {
            break;
        }
        [x] = F::choose(going, [next], [x]);
    }
    x
}

/// A direction of the length of a [`Normal`], rounded to one.
#[inline]
pub(super) fn normal([x, y, z]: [f64; 3]) -> Normal {
    [rounded(x) as i32, rounded(y) as i32, rounded(z) as i32]
}
