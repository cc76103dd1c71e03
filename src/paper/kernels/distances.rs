//! Approximate squared distances, and the number of them within a limit.

use super::kernel;

kernel! {
    /// Squared distances of the points in columns to `p`, with a relative error below 2^-21. Coordinates are
    /// in `0..2^30`; all slices have the same length.
    pub fn distances(x: &[i32], y: &[i32], z: &[i32], p: [i32; 3], out: &mut [f32]) = distances_body
}

/// The definition of [`distances`].
#[inline(always)]
pub fn distances_body(x: &[i32], y: &[i32], z: &[i32], p: [i32; 3], out: &mut [f32]) {
    for (((x, y), z), out) in x.iter().zip(y).zip(z).zip(out) {
        let dx = (x - p[0]) as f32;
        let dy = (y - p[1]) as f32;
        let dz = (z - p[2]) as f32;
        *out = dx * dx + dy * dy + dz * dz;
    }
}

kernel! {
    /// The number of values that are at most `limit`.
    pub fn count_within(numbers: &[f32], limit: f32) -> usize = count_body
}

/// The definition of [`count_within`].
#[inline(always)]
pub fn count_body(numbers: &[f32], limit: f32) -> usize {
    // With 32-bit sums a register has as many lanes as it holds values.
    numbers.iter().map(|d| u32::from(*d <= limit)).sum::<u32>() as usize
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use outcrop_geom::distance2;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_gives_the_same_bits(
            points in prop::collection::vec(prop::array::uniform3(0i32..1 << 30), 0..200),
            p in prop::array::uniform3(0i32..1 << 30),
            share in 0.0f32..1.5,
        ) {
            let column = |axis: usize| points.iter().map(|q| q[axis]).collect::<Vec<_>>();
            let (x, y, z) = (column(0), column(1), column(2));
            let mut expected = vec![0.0; points.len()];
            distances_body(&x, &y, &z, p, &mut expected);
            let limit = share * expected.iter().copied().fold(0.0, f32::max);
            let within = expected.iter().filter(|d| **d <= limit).count();
            for level in Level::all() {
                let mut got = vec![0.0; points.len()];
                distances(level, &x, &y, &z, p, &mut got);
                let bits = |d: &[f32]| d.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
                prop_assert_eq!(bits(&got), bits(&expected));
                prop_assert_eq!(count_within(level, &got, limit), within);
            }
            for (q, d) in points.iter().zip(&expected) {
                let exact = distance2(*q, p) as f64;
                prop_assert!((f64::from(*d) - exact).abs() <= exact / f64::from(1 << 21));
            }
        }
    }
}
