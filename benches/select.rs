//! Counting and choosing the candidates within a limit, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::{Level, count_within, pick_column};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn count_and_pick(bencher: Bencher<'_, '_>, level: Level) {
    let numbers: Vec<f32> = util::column(util::CANDIDATES, 17)
        .iter()
        .map(|n| *n as f32)
        .collect();
    let mut sorted = numbers.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let limit = sorted[util::LISTED];
    let places: Vec<u32> = (0..util::CANDIDATES as u32).collect();
    let mut picked = vec![0; util::CANDIDATES + 16];
    bencher
        .counter(ItemsCount::new(util::CANDIDATES))
        .bench_local(|| {
            black_box(count_within(level, black_box(&numbers), limit));
            black_box(pick_column(level, &numbers, limit, &places, &mut picked));
        });
}
