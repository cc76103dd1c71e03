//! The exact test for triangles without area.

/// True if three points with finite coordinates lie exactly on a line or coincide.
///
/// Exact if the nonzero coordinates of the three points are within a factor of 2^400 of each other.
pub(super) fn collinear(points: [[f64; 3]; 3]) -> bool {
    const PLANES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
    if PLANES.iter().any(|&plane| surely_turns(points, plane)) {
        return false;
    }
    // Scaling by a power of two rounds nothing and avoids overflow of products.
    let all = points.iter().flatten();
    let largest = all.fold(f64::MIN_POSITIVE, |m, c| m.max(c.abs()));
    let scale = -(libm::log2(largest).clamp(-1000.0, 1000.0) as i32);
    let points = points.map(|p| p.map(|c| c * 2f64.powi(scale)));
    !PLANES.iter().any(|&plane| turns(points, plane))
}

/// True only if the projection of the points to a coordinate plane has an area larger than the rounding
/// error.
fn surely_turns([p, q, r]: [[f64; 3]; 3], [x, y]: [usize; 2]) -> bool {
    let left = (p[x] - r[x]) * (q[y] - r[y]);
    let right = (p[y] - r[y]) * (q[x] - r[x]);
    // (3 + 16 ε) ε with ε = 2^-53 (Shewchuk 1997); the last term is for products that underflow.
    (left - right).abs() > 3.330_669_073_875_471_6e-16 * (left.abs() + right.abs()) + 1e-300
}

/// True if the projection of the points to a coordinate plane has an area, computed exactly.
fn turns([p, q, r]: [[f64; 3]; 3], [x, y]: [usize; 2]) -> bool {
    let products = [
        (p[x], q[y]),
        (-p[y], q[x]),
        (q[x], r[y]),
        (-q[y], r[x]),
        (r[x], p[y]),
        (-r[y], p[x]),
    ];
    let mut sum = Expansion::default();
    for (a, b) in products {
        let product = a * b;
        sum.add(product);
        sum.add(libm::fma(a, b, -product));
    }
    !sum.is_zero()
}

/// An exact sum: terms that do not overlap, added without rounding.
#[derive(Default)]
struct Expansion {
    terms: [f64; 12],
    count: usize,
}

impl Expansion {
    fn add(&mut self, value: f64) {
        let mut carry = value;
        for term in &mut self.terms[..self.count] {
            let sum = carry + *term;
            let virtual_term = sum - carry;
            *term = (carry - (sum - virtual_term)) + (*term - virtual_term);
            carry = sum;
        }
        self.terms[self.count] = carry;
        self.count += 1;
    }

    fn is_zero(&self) -> bool {
        self.terms[..self.count].iter().all(|term| *term == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The answer by `i128`, for integers that fit.
    fn expected(p: [[i64; 3]; 3]) -> bool {
        let d = |i: usize, j: usize| i128::from(p[i][j]) - i128::from(p[2][j]);
        (0..3).all(|j| {
            let k = (j + 1) % 3;
            d(0, j) * d(1, k) == d(0, k) * d(1, j)
        })
    }

    proptest! {
        #[test]
        fn agrees_with_integers(
            a in prop::array::uniform3(-(1i64 << 50)..1 << 50),
            step in prop::array::uniform3(-1000i64..1000),
            (m, n) in (-1000i64..1000, -1000i64..1000),
            bump in prop::array::uniform3(-1i64..2),
            exponent in -600i32..600,
        ) {
            let along = |times: i64| std::array::from_fn(|i| a[i] + times * step[i]);
            let mut points: [[i64; 3]; 3] = [a, along(m), along(n)];
            for k in 0..2 {
                let as_float = points.map(|p| p.map(|c| c as f64 * 2f64.powi(exponent)));
                prop_assert_eq!(collinear(as_float), expected(points), "{}", k);
                points[2] = std::array::from_fn(|i| points[2][i] + bump[i]);
            }
        }
    }

    #[test]
    fn coincident_and_extreme_points() {
        let (o, x) = ([0.0; 3], [1e308, 0.0, -1e308]);
        assert!(collinear([o, o, o]));
        assert!(collinear([x, x, o]));
        assert!(!collinear([x, [1e308, 1e300, -1e308], o]));
        assert!(!collinear([o, [1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]]));
        assert!(collinear([o, [5e-324, 0.0, 0.0], [1e-323, 0.0, 0.0]]));
    }
}
