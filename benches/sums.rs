//! The sums for the fit of a plane, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::{Level, second_moments};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn neighbors(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| util::column(util::NEIGHBORS, seed));
    bencher
        .counter(ItemsCount::new(util::NEIGHBORS))
        .bench_local(|| second_moments(level, black_box(&x), &y, &z));
}
