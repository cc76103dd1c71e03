//! Sorting a few dozen keys by counting.

use super::kernel;

kernel! {
    /// For each key how many are smaller: its place once sorted, if all keys are different.
    /// Quadratic, without a branch: faster than sorting up to about a hundred keys.
    pub fn ranks(keys: &[i64], out: &mut [u32]) = ranks_body
}

#[inline(always)]
pub(crate) fn ranks_body(keys: &[i64], out: &mut [u32]) {
    for (key, out) in keys.iter().zip(out) {
        *out = keys.iter().map(|other| i64::from(other < key)).sum::<i64>() as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_agrees_with_sorting(keys in prop::collection::hash_set(any::<i64>(), 0..130)) {
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
