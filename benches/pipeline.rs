//! A whole reconstruction, from cloud to mesh, and K: a k-d tree's 30 nearest neighbours of all points on the
//! same number of threads. The ratio of the two is the result.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use outcrop::Reconstruction;
use outcrop_cloudgen::{Cloud, Format, Kind};
use rayon::prelude::*;
use std::num::NonZero;

const POINTS: usize = 300_000;

/// Neighbours of a plane, with the query itself.
const NEIGHBORS: NonZero<usize> = NonZero::new(util::NEIGHBORS).unwrap();

fn main() {
    divan::main();
}

/// One thread, and all available ones.
fn threads() -> Vec<usize> {
    let mut counts = vec![1, outcrop::default_threads()];
    counts.dedup();
    counts
}

#[divan::bench(args = threads(), sample_count = 5, sample_size = 1)]
fn k(bencher: Bencher<'_, '_>, threads: usize) {
    let workspace = util::workspace();
    let store = util::store(POINTS, &workspace);
    let points = store.slice(0..store.len()).expect("scratch file");
    let points: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
    let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&points);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let pool = pool.build().expect("threads");
    bencher
        .counter(ItemsCount::new(points.len()))
        .bench_local(|| {
            let answer = |p| {
                let near = tree.nearest_n::<SquaredEuclidean>(p, NEIGHBORS);
                near.last().map_or(0.0, |n| f64::from(n.distance))
            };
            black_box(pool.install(|| points.par_iter().map(answer).sum::<f64>()));
        });
}

#[divan::bench(args = threads(), sample_count = 5, sample_size = 1)]
fn reconstruct(bencher: Bencher<'_, '_>, threads: usize) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cloud = folder.path().join("bumpy.ply");
    let surface = Cloud::new(Kind::Bumpy).points(POINTS as u64);
    let format: Format = "ply-le-f32".parse().expect("a format");
    surface.write(&cloud, format).expect("a cloud");
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        let run = Reconstruction::builder()
            .input(&cloud)
            .output(folder.path().join("mesh.ply"))
            .threads(threads)
            .build();
        black_box(run.and_then(|run| run.run()).expect("a mesh"));
    });
}
