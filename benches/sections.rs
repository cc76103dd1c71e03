//! Sections of records like the triples of a surface: packing and writing, reading and unpacking.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop::spill::{Record, Sections, Word};

const LAYOUT: [Word; 4] = [Word::Above, Word::Rising, Word::Rising, Word::Above];

fn main() {
    divan::main();
}

/// Three triangles for each point, with vertices near in order and now and then far.
fn triples() -> Vec<Record<4>> {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    };
    let mut step = || {
        let reach = [20, 20, 200, 200, 1000, 10_000][random() as usize % 6];
        1 + random() % reach
    };
    let mut all: Vec<_> = (0..65_536u32)
        .flat_map(|i| [i; 3])
        .map(|i| {
            let j = i + step();
            [i, j, j + step(), if step() % 7 == 0 { 2 } else { 3 }]
        })
        .collect();
    all.sort_unstable();
    all
}

#[divan::bench]
fn put(bencher: Bencher<'_, '_>) {
    let workspace = util::workspace();
    let records = triples();
    let items = ItemsCount::new(records.len());
    bencher.counter(items).bench_local(|| {
        let sections =
            Sections::with_layout(&workspace, "bench", 1, LAYOUT).expect("scratch space");
        sections.put(0, &records).expect("scratch space");
    });
}

#[divan::bench]
fn get(bencher: Bencher<'_, '_>) {
    let workspace = util::workspace();
    let records = triples();
    let sections = Sections::with_layout(&workspace, "bench", 1, LAYOUT).expect("scratch space");
    sections.put(0, &records).expect("scratch space");
    let items = ItemsCount::new(records.len());
    let mut back = Vec::new();
    bencher.counter(items).bench_local(|| {
        sections.get_into(0, &mut back).expect("scratch file");
        black_box(&back);
    });
}
