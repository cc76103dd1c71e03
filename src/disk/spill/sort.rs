//! Sorting rows in memory.

use super::Row;
use std::cmp::Ordering;

/// Rows that one thread sorts alone: they fit its cache.
const LEAF: usize = 1 << 16;

/// Rows from which a pivot is chosen.
const SAMPLE: usize = 31;

/// Rows of up to so many words are sorted by code that is compiled once for each number of words, not for each
/// kind of row.
const WIDEST: usize = 8;

#[derive(Debug, Clone, Copy)]
enum Way {
    Threads,
    OneThread,
    Runs,
}

/// Sorts on the current threads of rayon. The order of equal rows is unspecified.
pub(super) fn sort_on_threads<R: Row>(rows: &mut [R]) {
    put_in_order(rows, Way::Threads);
}

/// Sorts on this thread. The order of equal rows is unspecified, but equal rows have equal words.
pub fn sort<R: Row>(rows: &mut [R]) {
    put_in_order(rows, Way::OneThread);
}

/// Sorts rows that consist of ascending runs, which takes less time the longer these are.
pub(super) fn merge<R: Row>(rows: &mut [R]) {
    put_in_order(rows, Way::Runs);
}

fn put_in_order<R: Row>(rows: &mut [R], way: Way) {
    if const { R::WORDS <= WIDEST } {
        by_width(bytemuck::cast_slice_mut(rows), R::WORDS, way);
    } else {
        sort_as(rows, way);
    }
}

fn by_width(words: &mut [u32], width: usize, way: Way) {
    match width {
        1 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 1]>(words), way),
        2 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 2]>(words), way),
        3 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 3]>(words), way),
        4 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 4]>(words), way),
        5 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 5]>(words), way),
        6 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 6]>(words), way),
        7 => sort_as(bytemuck::cast_slice_mut::<_, [u32; 7]>(words), way),
        _ => sort_as(bytemuck::cast_slice_mut::<_, [u32; WIDEST]>(words), way),
    }
}

fn sort_as<R: Row>(rows: &mut [R], way: Way) {
    match way {
        // If the pivots are bad at many levels, which is very unlikely, one thread does the rest.
        Way::Threads => sort_part(rows, 2 * rows.len().max(1).ilog2()),
        Way::OneThread => rows.sort_unstable_by(R::compare),
        Way::Runs => rows.sort_by(R::compare),
    }
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
        sort_on_threads(&mut records);
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
