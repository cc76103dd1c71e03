//! Tables of rows like the triples of a surface: packing and writing, reading and unpacking.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_disk::spill::Table;

fn main() {
    divan::main();
}

/// Three triangles for each point; most vertices are near each other in order, some are far.
fn triples() -> Vec<[u32; 4]> {
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
    let rows = triples();
    let items = ItemsCount::new(rows.len());
    bencher.counter(items).bench_local(|| {
        let table = Table::new("bench", 1);
        table
            .put(&workspace.unit(), 0, &rows)
            .expect("scratch space");
    });
}

#[divan::bench]
fn get(bencher: Bencher<'_, '_>) {
    let workspace = util::workspace();
    let rows = triples();
    let table = Table::new("bench", 1);
    let unit = workspace.unit();
    table.put(&unit, 0, &rows).expect("scratch space");
    let items = ItemsCount::new(rows.len());
    let mut back = Vec::new();
    bencher.counter(items).bench_local(|| {
        table.get_into(&unit, 0, &mut back).expect("scratch file");
        black_box(&back);
    });
}
