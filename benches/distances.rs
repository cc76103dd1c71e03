//! Approximate squared distances of a query's candidates, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::{Level, distances};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn candidates(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| util::column(util::CANDIDATES, seed));
    let mut out = vec![0.0; util::CANDIDATES];
    bencher
        .counter(ItemsCount::new(util::CANDIDATES))
        .bench_local(|| distances(level, black_box(&x), &y, &z, [1, 2, 3], &mut out));
}
