//! Bisectors as lines, and the corners that they cut off, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::{CornerGroup, LANES, Level, bisectors, cut_corners};

fn main() {
    divan::main();
}

#[divan::bench(args = Level::all())]
fn lines_and_corners(bencher: Bencher<'_, '_>, level: Level) {
    let [x, y, z] = [7, 11, 13].map(|seed| util::column(LANES, seed));
    let frame = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let corners = [CornerGroup::default(); 2];
    bencher.counter(ItemsCount::new(LANES)).bench_local(|| {
        let lines = bisectors(level, black_box(&x), &y, &z, &frame);
        for k in 0..LANES {
            black_box(cut_corners(level, &corners, &lines.get(k)));
        }
    });
}
