//! Sorting records in memory on several threads.

use super::Record;
use std::cmp::Ordering;

/// Records that one thread sorts by itself: they fit its cache.
const LEAF: usize = 1 << 16;

/// Records looked at for a pivot.
const SAMPLE: usize = 31;

/// Sorts with rayon's current threads; which record of equal ones comes first has no meaning.
pub(super) fn sort<const N: usize>(records: &mut [Record<N>]) {
    // A bad pivot at every level would be a remarkable accident; then one thread does the rest.
    sort_part(records, 2 * records.len().max(1).ilog2());
}

fn sort_part<const N: usize>(records: &mut [Record<N>], depth: u32) {
    let middle = if records.len() <= LEAF || depth == 0 {
        0
    } else {
        split(records)
    };
    // Nothing is below the pivot if many records are equal.
    if middle == 0 {
        records.sort_unstable_by(compare);
        return;
    }
    let (below, above) = records.split_at_mut(middle);
    rayon::join(
        || sort_part(below, depth - 1),
        || sort_part(above, depth - 1),
    );
}

/// Moves the records below a pivot to the front; their number.
fn split<const N: usize>(records: &mut [Record<N>]) -> usize {
    let mut sample: [Record<N>; SAMPLE] =
        std::array::from_fn(|n| records[(2 * n + 1) * records.len() / (2 * SAMPLE)]);
    sample.sort_unstable_by(compare);
    let pivot = sample[SAMPLE / 2];
    let mut below = 0;
    for at in 0..records.len() {
        let less = compare(&records[at], &pivot) == Ordering::Less;
        records.swap(below, at);
        below += usize::from(less);
    }
    below
}

/// As records compare; four words at a time.
#[inline]
fn compare<const N: usize>(a: &Record<N>, b: &Record<N>) -> Ordering {
    let head = |r: &Record<N>| {
        let words = r.iter().take(4);
        words.fold(0u128, |sum, word| sum << 32 | u128::from(*word))
    };
    let order = head(a).cmp(&head(b));
    if N <= 4 {
        return order;
    }
    order.then_with(|| a[4..].cmp(&b[4..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const N: usize>(mut records: Vec<Record<N>>) {
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
        check::<3>(Vec::new());
    }
}
