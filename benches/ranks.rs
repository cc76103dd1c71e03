//! Sorting a query's neighbours by counting, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::{Level, ranks};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn sort_by_counting(bencher: Bencher<'_, '_>, level: Level) {
    let keys: Vec<i64> = util::column(util::LISTED, 19)
        .into_iter()
        .map(i64::from)
        .collect();
    let mut places = vec![0; util::LISTED];
    bencher
        .counter(ItemsCount::new(util::LISTED))
        .bench_local(|| ranks(level, black_box(&keys), &mut places));
}
