//! Curve keys: encode and decode.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_geom::hilbert::{Key, decode, encode};

const POINTS: usize = 100_000;

fn main() {
    divan::main();
}

#[divan::bench]
fn encode_points(bencher: Bencher<'_, '_>) {
    let points = util::points(POINTS);
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        for &p in &points {
            black_box(encode(black_box(p)));
        }
    });
}

#[divan::bench]
fn decode_keys(bencher: Bencher<'_, '_>) {
    let keys: Vec<Key> = util::points(POINTS).into_iter().map(encode).collect();
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        for &key in &keys {
            black_box(decode(black_box(key)));
        }
    });
}
