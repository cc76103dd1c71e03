//! The restricted Voronoi cell of a point, given its plane and its neighbours nearest first.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop::geom::clip::Cell;
use outcrop::geom::plane::{Moments, Normal};
use outcrop::stages::tiles::Near;

const POINTS: usize = 20_000;

fn main() {
    divan::main();
}

/// A cell's id, normal, disk radius and neighbours.
type Task = (u32, Normal, f64, Vec<Near>);

fn tasks() -> Vec<Task> {
    let task = |(id, near): (u32, Vec<Near>)| {
        let mut moments = Moments::default();
        moments.add_near(near.iter().take(util::NEIGHBORS).map(|n| n.difference));
        let radius = (near[util::NEIGHBORS - 1].distance2 as f64).sqrt();
        Some((id, moments.plane().normal?, radius, near))
    };
    util::neighbors(POINTS)
        .into_iter()
        .filter_map(task)
        .collect()
}

#[divan::bench]
fn disk(bencher: Bencher<'_, '_>) {
    let tasks = tasks();
    let mut cell = Cell::new(0, [0, 0, 1 << 24], 1.0);
    bencher
        .counter(ItemsCount::new(tasks.len()))
        .bench_local(|| {
            for &(id, normal, radius, _) in &tasks {
                cell.start(id, normal, radius);
                black_box(&cell);
            }
        });
}

#[divan::bench]
fn whole_cell(bencher: Bencher<'_, '_>) {
    let tasks = tasks();
    let mut cell = Cell::new(0, [0, 0, 1 << 24], 1.0);
    bencher
        .counter(ItemsCount::new(tasks.len()))
        .bench_local(|| {
            for (id, normal, radius, near) in &tasks {
                cell.start(*id, *normal, *radius);
                for n in near {
                    if n.distance2 > cell.reach2() {
                        break;
                    }
                    cell.clip(n.difference, n.id);
                }
                cell.triples(|a, b| {
                    black_box((a, b));
                });
            }
        });
}
