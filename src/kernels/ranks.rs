//! Sorting a few dozen keys by counting.

use super::kernel;

kernel! {
    /// For each key, the number of smaller keys: its rank if all keys are different. Keys must not be
    /// negative. Quadratic, but without branches: faster than sorting up to about a hundred keys.
    pub fn ranks(keys: &[i64], out: &mut [u32]) = ranks_of
}

#[inline(always)]
fn ranks_of(keys: &[i64], out: &mut [u32]) {
    let count = keys.len();
    let mut padded = keys.to_vec();
    padded.resize(count.next_multiple_of(RANKED), i64::MAX);
    let mut places = vec![0; padded.len()];
    ranks_body(&padded, count, &mut places);
    out.copy_from_slice(&places[..count]);
}

/// Keys whose ranks are counted in registers; the length of a column of keys is a multiple of this.
pub(crate) const RANKED: usize = 8;

/// As [`ranks`], for the first `count` keys.
#[inline(always)]
pub(crate) fn ranks_body(keys: &[i64], count: usize, out: &mut [u32]) {
    let blocks = keys.as_chunks::<RANKED>().0;
    let outs = out.as_chunks_mut::<RANKED>().0;
    for (block, out) in blocks.iter().zip(outs) {
        let mut smaller = [0i64; RANKED];
        for other in &keys[..count] {
            for (smaller, key) in smaller.iter_mut().zip(block) {
                // Adds the sign bit of the difference, which avoids a comparison.
                *smaller += ((other - key) as u64 >> 63) as i64;
            }
        }
        *out = smaller.map(|smaller| smaller as u32);
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
