//! The plane through the neighbours of a point: sums, and the fit from the sums.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::Level;
use outcrop_paper::plane::{Moments, PLANES, planes};
use outcrop_stages::ids::Id;
use outcrop_stages::tiles::neighbors::Neighbors;

const POINTS: usize = 20_000;

fn main() {
    divan::main();
}

fn neighbors() -> Vec<(Id, Neighbors)> {
    util::neighbors(POINTS)
}

fn sums(near: &Neighbors) -> Moments {
    near.moments(util::NEIGHBORS, Level::best())
}

#[divan::bench]
fn moments(bencher: Bencher<'_, '_>) {
    let all = neighbors();
    bencher.counter(ItemsCount::new(all.len())).bench_local(|| {
        for (_, near) in &all {
            black_box(sums(black_box(near)));
        }
    });
}

#[divan::bench]
fn fit(bencher: Bencher<'_, '_>) {
    let all: Vec<Moments> = neighbors().iter().map(|(_, near)| sums(near)).collect();
    bencher.counter(ItemsCount::new(all.len())).bench_local(|| {
        for moments in &all {
            black_box(black_box(moments).plane());
        }
    });
}

#[divan::bench]
fn fit_several(bencher: Bencher<'_, '_>) {
    let all: Vec<Moments> = neighbors().iter().map(|(_, near)| sums(near)).collect();
    let level = Level::best();
    bencher.counter(ItemsCount::new(all.len())).bench_local(|| {
        for moments in all.as_chunks::<PLANES>().0 {
            black_box(planes(level, black_box(moments)));
        }
    });
}
