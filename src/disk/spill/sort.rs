//! Sorting rows in memory on several threads.

use super::Row;
use std::cmp::Ordering;

/// Rows that one thread sorts alone: they fit its cache.
const LEAF: usize = 1 << 16;

/// Rows from which a pivot is chosen.
const SAMPLE: usize = 31;

/// Sorts on the current threads of rayon. The order of equal rows is unspecified.
pub(super) fn sort<R: Row>(records: &mut [R]) {
    // If the pivots are bad at many levels, which is very unlikely, one thread does the rest.
    sort_part(records, 2 * records.len().max(1).ilog2());
}

fn sort_part<R: Row>(records: &mut [R], depth: u32) {
    let middle = if records.len() <= LEAF || depth == 0 {
        0
    } else {
        split(records)
    };
    // Nothing is below the pivot if many rows are equal.
    if middle == 0 {
        records.sort_unstable_by(R::compare);
        return;
    }
    let (below, above) = records.split_at_mut(middle);
    rayon::join(
        || sort_part(below, depth - 1),
        || sort_part(above, depth - 1),
    );
}

/// Moves the rows below a pivot to the front; returns their number.
fn split<R: Row>(records: &mut [R]) -> usize {
    let mut sample: [R; SAMPLE] =
        std::array::from_fn(|n| records[(2 * n + 1) * records.len() / (2 * SAMPLE)]);
    sample.sort_unstable_by(R::compare);
    let pivot = sample[SAMPLE / 2];
    let mut below = 0;
    for at in 0..records.len() {
        let less = records[at].compare(&pivot) == Ordering::Less;
        records.swap(below, at);
        below += usize::from(less);
    }
    below
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<R: Row + Ord>(mut records: Vec<R>) {
        let mut want = records.clone();
        want.sort_unstable();
        sort(&mut records);
        assert!(records == want);
    }

    #[test]
    fn sorts_what_is_larger_than_a_leaf() {
        let random = |n: u32| n.wrapping_mul(2_654_435_761) >> 7;
        let count = 5 * LEAF as u32;
        check((0..count).map(|n| [random(n), n, 7]).collect());
        check((0..count).map(|n| [n, 0, n]).collect());
        check((0..count).map(|n| [0, 1, 2, 3, random(n), n]).collect());
        check((0..count).map(|n| [random(n) % 3]).collect());
        check(vec![[1, 2]; count as usize]);
        check(Vec::<[u32; 3]>::new());
    }
}
