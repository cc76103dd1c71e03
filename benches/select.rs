//! Counting and keeping the candidates within a limit, at every level that the machine has.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop::kernels::{Level, count_within, keep_within};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn count_and_keep(bencher: Bencher<'_, '_>, level: Level) {
    let numbers: Vec<f32> = util::column(util::CANDIDATES, 17)
        .iter()
        .map(|n| *n as f32)
        .collect();
    let mut sorted = numbers.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let limit = sorted[util::LISTED];
    let mut kept = Vec::new();
    bencher
        .counter(ItemsCount::new(util::CANDIDATES))
        .bench_local(|| {
            black_box(count_within(level, black_box(&numbers), limit));
            keep_within(level, &numbers, limit, &mut kept);
        });
}
