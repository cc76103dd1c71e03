//! Neighbours of all points of a tile, and reading the tile with its halo.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::kernels::Level;
use outcrop_stages::tiles::Tile;
use outcrop_stages::tiles::near::Search;

const POINTS: usize = 200_000;
/// A tile in the middle of the cloud, of the pipeline's size.
const TILE: std::ops::Range<usize> = 65_536..131_072;

fn main() {
    divan::main();
}

fn tile() -> Tile {
    let workspace = util::workspace();
    let store = util::store(POINTS, &workspace);
    Tile::load(&store, TILE).expect("scratch file")
}

#[divan::bench]
fn load(bencher: Bencher<'_, '_>) {
    let workspace = util::workspace();
    let store = util::store(POINTS, &workspace);
    bencher
        .counter(ItemsCount::new(TILE.len()))
        .bench_local(|| Tile::load(&store, TILE).expect("scratch file"));
}

#[divan::bench(args = [10, 30], sample_count = 30)]
fn neighbors(bencher: Bencher<'_, '_>, k: usize) {
    let tile = tile();
    let mut search = Search::default();
    bencher
        .counter(ItemsCount::new(TILE.len()))
        .bench_local(|| {
            tile.for_each_query(
                k,
                &mut search,
                |_| (),
                |_, _, query| {
                    black_box(query.map_or(0, |q| q.near().len()));
                },
            );
        });
}

#[divan::bench(args = [10, 30], sample_count = 30)]
fn sums(bencher: Bencher<'_, '_>, k: usize) {
    let tile = tile();
    let mut search = Search::default();
    bencher
        .counter(ItemsCount::new(TILE.len()))
        .bench_local(|| {
            tile.for_some_sums(
                k,
                &mut search,
                |_| true,
                |_| (),
                |_, _, sums| {
                    black_box(sums.map_or(0, |sums| sums.last2));
                },
            );
        });
}

#[divan::bench(args = Level::all(), sample_count = 30)]
fn groups(bencher: Bencher<'_, '_>, level: Level) {
    let tile = tile();
    let mut search = Search::at(level);
    bencher
        .counter(ItemsCount::new(TILE.len()))
        .bench_local(|| {
            tile.for_each_group(
                30,
                &mut search,
                |_| (),
                |group| {
                    black_box(group.members().len());
                },
            );
        });
}
