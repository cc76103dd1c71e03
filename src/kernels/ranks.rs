//! Sorting a few dozen keys by counting.

use super::kernel;

kernel! {
    /// For each key how many are smaller: its place once sorted, if all keys are different. Keys are
    /// not negative.
    /// Quadratic, without a branch: faster than sorting up to about a hundred keys.
    pub fn ranks(keys: &[i64], out: &mut [u32]) = ranks_body
}

#[inline(always)]
pub(crate) fn ranks_body(keys: &[i64], out: &mut [u32]) {
    /// Keys whose counts are kept in registers.
    const BLOCK: usize = 8;
    let mut blocks = keys.chunks_exact(BLOCK);
    let mut outs = out.chunks_exact_mut(BLOCK);
    for (block, out) in blocks.by_ref().zip(outs.by_ref()) {
        let mut smaller = [0i64; BLOCK];
        for other in keys {
            for (smaller, key) in smaller.iter_mut().zip(block) {
                // The sign of the difference, without a comparison.
                *smaller += ((other - key) as u64 >> 63) as i64;
            }
        }
        for (out, smaller) in out.iter_mut().zip(smaller) {
            *out = smaller as u32;
        }
    }
    for (key, out) in blocks.remainder().iter().zip(outs.into_remainder()) {
        *out = keys.iter().map(|other| u32::from(other < key)).sum();
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_agrees_with_sorting(keys in prop::collection::hash_set(0..i64::MAX, 0..130)) {
            let keys: Vec<i64> = keys.into_iter().collect();
            let mut sorted = keys.clone();
            sorted.sort_unstable();
            for level in Level::all() {
                let mut places = vec![0; keys.len()];
                ranks(level, &keys, &mut places);
                for (key, place) in keys.iter().zip(&places) {
                    prop_assert_eq!(sorted[*place as usize], *key);
                }
            }
        }
    }
}
