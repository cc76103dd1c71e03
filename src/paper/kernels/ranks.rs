//! Sorting a few dozen keys by counting.

use super::kernel;
use super::pick::{Pick, RANKED, SHORT_RANKED};

kernel! {
    /// For each key, the number of smaller keys: its rank if all keys are different. Keys must not be
    /// negative. Quadratic, but without branches: faster than sorting up to about a hundred keys.
    pub fn ranks(keys: &[i64], out: &mut [u32]) = ranks_of<Eight>
}

#[inline(always)]
fn ranks_of<P: Pick>(keys: &[i64], out: &mut [u32]) {
    let count = keys.len();
    let mut padded = keys.to_vec();
    padded.resize(count.next_multiple_of(RANKED), i64::MAX);
    let mut places = vec![0; padded.len()];
    ranks_body::<P>(&padded, count, &mut places);
    out.copy_from_slice(&places[..count]);
}

/// As [`ranks`], for the first `count` keys.
#[inline(always)]
pub fn ranks_body<P: Pick>(keys: &[i64], count: usize, out: &mut [u32]) {
    let blocks = keys.as_chunks::<RANKED>().0;
    let outs = out.as_chunks_mut::<RANKED>().0;
    for (block, out) in blocks.iter().zip(outs) {
        *out = P::smaller(block, &keys[..count]);
    }
}

kernel! {
    /// As [`ranks`], for keys of 32 bits: twice as fast.
    pub fn short_ranks(keys: &[i32], out: &mut [u32]) = short_ranks_of<Eight>
}

#[inline(always)]
fn short_ranks_of<P: Pick>(keys: &[i32], out: &mut [u32]) {
    let count = keys.len();
    let mut padded = keys.to_vec();
    padded.resize(count.next_multiple_of(SHORT_RANKED), i32::MAX);
    let mut places = vec![0; padded.len()];
    short_ranks_body::<P>(&padded, count, &mut places);
    out.copy_from_slice(&places[..count]);
}

/// As [`short_ranks`], for the first `count` keys.
#[inline(always)]
pub fn short_ranks_body<P: Pick>(keys: &[i32], count: usize, out: &mut [u32]) {
    let blocks = keys.as_chunks::<SHORT_RANKED>().0;
    let outs = out.as_chunks_mut::<SHORT_RANKED>().0;
    for (block, out) in blocks.iter().zip(outs) {
        *out = P::short_smaller(block, &keys[..count]);
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

        #[test]
        fn short_keys_are_ranked_as_long_ones(keys in prop::collection::hash_set(0..i32::MAX, 0..130)) {
            let keys: Vec<i32> = keys.into_iter().collect();
            let long: Vec<i64> = keys.iter().map(|key| i64::from(*key)).collect();
            let mut expected = vec![0; keys.len()];
            ranks(Level::BASE, &long, &mut expected);
            for level in Level::all() {
                let mut places = vec![0; keys.len()];
                short_ranks(level, &keys, &mut places);
                prop_assert_eq!(&places, &expected);
            }
        }
    }
}
