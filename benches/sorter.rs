//! The external sorter, in memory and with four runs to merge.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_disk::spill::Sorter;
use outcrop_geom::hilbert::{Key, encode};

const RECORDS: usize = 500_000;

fn main() {
    divan::main();
}

#[divan::bench(args = [1, 4], sample_count = 10)]
fn sort(bencher: Bencher<'_, '_>, runs: usize) {
    let workspace = util::workspace();
    let keys: Vec<Key> = util::points(RECORDS).into_iter().map(encode).collect();
    // Room for one more row keeps a single run in memory.
    let buffer = (RECORDS.div_ceil(runs) + usize::from(runs == 1)) * size_of::<Key>();
    bencher.counter(ItemsCount::new(RECORDS)).bench_local(|| {
        let sorter = Sorter::<Key>::new(&workspace, "bench", buffer as u64);
        sorter.push(&keys).expect("scratch space");
        let each = |record| {
            black_box(record);
            Ok(())
        };
        sorter
            .finish(&workspace)
            .expect("scratch space")
            .for_each(each)
            .expect("scratch file");
    });
}
