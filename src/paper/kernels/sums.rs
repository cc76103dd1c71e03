//! Exact sums over the differences to a point's neighbours.

use super::kernel;

/// First moments x, y, z, then second moments xx, yy, zz, xy, xz, yz.
pub type SecondMoments = ([i64; 3], [i64; 6]);

/// Most differences whose sums are exact.
pub const MOST_SUMMED: usize = 256;

/// Their squared lengths must be less than this.
pub const SUMMED_LIMIT2: u64 = 1 << 54;

kernel! {
    /// Sums over columns of differences. Exact for up to 256 differences with components below 2^27 in
    /// absolute value.
    pub fn second_moments(x: &[i32], y: &[i32], z: &[i32]) -> SecondMoments = second_moments_body
}

/// The definition of [`second_moments`].
#[inline(always)]
pub fn second_moments_body(x: &[i32], y: &[i32], z: &[i32]) -> SecondMoments {
    let mut sum = [0i64; 3];
    let mut products = [0i64; 6];
    for ((&x, &y), &z) in x.iter().zip(y).zip(z) {
        let (x, y, z) = (i64::from(x), i64::from(y), i64::from(z));
        sum[0] += x;
        sum[1] += y;
        sum[2] += z;
        products[0] += x * x;
        products[1] += y * y;
        products[2] += z * z;
        products[3] += x * y;
        products[4] += x * z;
        products[5] += y * z;
    }
    (sum, products)
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_gives_the_same_sums(
            points in prop::collection::vec(prop::array::uniform3(-(1i32 << 27) + 1..1 << 27), 0..=256),
        ) {
            let column = |axis: usize| points.iter().map(|q| q[axis]).collect::<Vec<_>>();
            let (x, y, z) = (column(0), column(1), column(2));
            let wide = |a: &[i32], b: &[i32]| {
                a.iter().zip(b).map(|(a, b)| i128::from(*a) * i128::from(*b)).sum::<i128>() as i64
            };
            let expected = [wide(&x, &x), wide(&y, &y), wide(&z, &z), wide(&x, &y), wide(&x, &z), wide(&y, &z)];
            for level in Level::all() {
                let (sum, products) = second_moments(level, &x, &y, &z);
                prop_assert_eq!(sum[2], z.iter().map(|z| i64::from(*z)).sum::<i64>());
                prop_assert_eq!(products, expected);
                prop_assert_eq!((sum, products), second_moments_body(&x, &y, &z));
            }
        }
    }
}
