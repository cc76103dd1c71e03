//! The restricted Voronoi cell of a point, given its plane and its neighbours nearest first, and the cells of
//! several points together, at every level of instructions of the machine.

mod util;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use outcrop_paper::clip::Cell;
use outcrop_paper::clip::wrap::{MOST_NEIGHBORS, Site, TOGETHER, Wrapper};
use outcrop_paper::kernels::Level;
use outcrop_paper::plane::Normal;
use outcrop_stages::ids::Id;
use outcrop_stages::tiles::neighbors::Neighbors;

const POINTS: usize = 20_000;

fn main() {
    divan::main();
}

/// Id, normal, disk radius and neighbours of a cell.
type Task = (u32, Normal, f64, Neighbors);

fn tasks() -> Vec<Task> {
    let task = |(id, near): (Id, Neighbors)| {
        let plane = near.moments(util::NEIGHBORS, Level::best()).plane();
        let last = near.get(util::NEIGHBORS - 1)?;
        Some((
            id.get(),
            plane.normal?,
            2.0 * (last.distance2 as f64).sqrt(),
            near,
        ))
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
                cell.clip_nearest(near.columns(), 0);
                cell.triples(|a, b| {
                    black_box((a, b));
                });
            }
        });
}

#[divan::bench(args = Level::all())]
fn together(bencher: Bencher<'_, '_>, level: Level) {
    let tasks = tasks();
    let columns: Vec<[[i32; MOST_NEIGHBORS]; 3]> = (tasks.iter())
        .map(|(.., near)| {
            let near = near.columns();
            [near.x, near.y, near.z].map(|from| {
                let mut column = [0; MOST_NEIGHBORS];
                column[..util::NEIGHBORS].copy_from_slice(&from[..util::NEIGHBORS]);
                column
            })
        })
        .collect();
    let sites: Vec<Site<'_>> = (tasks.iter().zip(&columns))
        .map(|((_, normal, radius, _), columns)| Site {
            differences: columns.each_ref(),
            count: util::NEIGHBORS,
            normal: *normal,
            radius: *radius,
        })
        .collect();
    let mut wrapper = Wrapper::at(level);
    bencher
        .counter(ItemsCount::new(sites.len()))
        .bench_local(|| {
            for sites in sites.chunks(TOGETHER) {
                wrapper.wrap(sites);
                for place in 0..sites.len() {
                    black_box(wrapper.outline(place).sides());
                }
            }
        });
}
