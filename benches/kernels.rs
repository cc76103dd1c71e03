//! The kernels at every level that the machine has: what wider registers buy.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop::kernels::{
    CornerGroup, LANES, Level, bisectors, count_within, cut_corners, distances, keep_within, ranks,
    second_moments,
};

/// Candidates of a query, about.
const CANDIDATES: usize = 192;
/// Neighbours listed for a query, about.
const LISTED: usize = 40;

fn main() {
    divan::main();
}

fn levels() -> Vec<Level> {
    Level::all()
}

/// Numbers without a pattern.
fn column(count: usize, seed: u32) -> Vec<i32> {
    let mixed = |n: u32| {
        (n + 1)
            .wrapping_mul(seed)
            .rotate_left(13)
            .wrapping_mul(0x9e37_79b1)
    };
    (0..count as u32).map(|n| (mixed(n) >> 12) as i32).collect()
}

#[divan::bench(args = levels())]
fn distances_of_candidates(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| column(CANDIDATES, seed));
    let mut out = vec![0.0; CANDIDATES];
    bencher
        .counter(ItemsCount::new(CANDIDATES))
        .bench_local(|| distances(level, black_box(&x), &y, &z, [1, 2, 3], &mut out));
}

#[divan::bench(args = levels())]
fn count_and_keep(bencher: Bencher<'_, '_>, level: Level) {
    let numbers: Vec<f32> = column(CANDIDATES, 17).iter().map(|n| *n as f32).collect();
    let mut sorted = numbers.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let limit = sorted[LISTED];
    let mut kept = Vec::new();
    bencher
        .counter(ItemsCount::new(CANDIDATES))
        .bench_local(|| {
            black_box(count_within(level, black_box(&numbers), limit));
            keep_within(level, &numbers, limit, &mut kept);
        });
}

#[divan::bench(args = levels())]
fn sort_by_counting(bencher: Bencher<'_, '_>, level: Level) {
    let keys: Vec<i64> = column(LISTED, 19).into_iter().map(i64::from).collect();
    let mut places = vec![0; LISTED];
    bencher
        .counter(ItemsCount::new(LISTED))
        .bench_local(|| ranks(level, black_box(&keys), &mut places));
}

#[divan::bench(args = levels())]
fn sums_of_neighbors(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| column(30, seed));
    bencher
        .counter(ItemsCount::new(30usize))
        .bench_local(|| second_moments(level, black_box(&x), &y, &z));
}

#[divan::bench(args = levels())]
fn lines_and_corners(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| column(LANES, seed));
    let frame = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let corners = [CornerGroup::default(); 2];
    bencher.counter(ItemsCount::new(LANES)).bench_local(|| {
        let lines = bisectors(level, black_box(&x), &y, &z, &frame);
        for k in 0..LANES {
            black_box(cut_corners(level, &corners, &lines.get(k)));
        }
    });
}
