//! Points far from all others do not coarsen the lattice.

use crate::ingest::bench::{Bench, cloud, ply, positions, write_las};
use outcrop_geom::lattice::Lattice;
use outcrop_points::Spool;
use std::path::PathBuf;

/// The files, read, without far points; their lattice and the positions on it.
fn near(bench: &Bench, paths: &[PathBuf]) -> (Spool, Lattice, Vec<[i32; 3]>) {
    let mut spool = bench.read(paths).unwrap();
    spool.drop_far(&bench.workspace).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    let positions = positions(bench, &spool, &lattice);
    assert_eq!(positions.len() as u64, spool.points());
    let frames: u64 = spool.frames().iter().map(|frame| frame.1).sum();
    assert_eq!(frames, spool.points());
    let stats = spool.stats();
    assert_eq!(stats.read, stats.kept + stats.dropped_far);
    (spool, lattice, positions)
}

const GRID: (f64, [f64; 3]) = (0.001, [600_000.0, 5_000_000.0, 0.0]);

#[test]
fn grids_keep_their_steps() {
    let bench = Bench::new();
    let las = |name: &str, points: &[[i32; 3]]| {
        let path = bench.path(name);
        write_las(&path, (1, 2), 0, GRID, points, false);
        path
    };
    let points = cloud(4500, 3);
    let (_, lattice, alone) = near(&bench, &[las("alone.las", &points)]);
    let far = [[i32::MAX, 0, 0], [5, i32::MIN, i32::MAX]];
    let mut all = points.clone();
    all.splice(2000..2000, far);
    let whole = las("whole.laz", &all);
    all.reverse();
    let turned = las("turned.las", &all);
    let parts = [
        las("a.las", &points[..7]),
        las("b.las", &far),
        las("c.las", &points[7..]),
    ];
    for paths in [
        vec![whole],
        vec![turned],
        parts.to_vec(),
        parts.iter().rev().cloned().collect(),
    ] {
        let (spool, found, positions) = near(&bench, &paths);
        assert!(
            (found == lattice, positions == alone) == (true, true),
            "{found:?}"
        );
        let stats = spool.stats();
        assert_eq!((stats.dropped_far, stats.kept), (2, 4500));
        let least = far[1].map(|i| f64::from(i) * 0.001);
        let least: [f64; 3] = std::array::from_fn(|a| least[a] + GRID.1[a]);
        assert_eq!(stats.far_example, Some(least));
        let kept = stats.files.iter().filter_map(|f| f.max).map(|max| max[0]);
        assert!(kept.fold(0.0, f64::max) < 600_200.0);
        // Without the choice all are kept, on coarser steps.
        let spool = bench.read(&paths).unwrap();
        assert!(!spool.choose_lattice(0).unwrap().exact);
    }
}

#[test]
fn what_fits_stays() {
    let bench = Bench::new();
    let path = bench.path("fits.las");
    let mut points = cloud(4500, 3);
    // Far, but the lattice can hold it.
    points.push([1 << 29, 0, 0]);
    write_las(&path, (1, 2), 0, GRID, &points, false);
    let (spool, lattice, _) = near(&bench, std::slice::from_ref(&path));
    assert_eq!((spool.stats().dropped_far, lattice.exact), (0, true));
    // Too many to be strays: three of them are one in 1500.
    points.truncate(4500);
    points.extend([[i32::MAX, 0, 0]; 3]);
    write_las(&path, (1, 2), 0, GRID, &points, false);
    let (spool, lattice, _) = near(&bench, &[path]);
    assert_eq!((spool.stats().dropped_far, lattice.exact), (0, false));
    // Too few points to tell.
    let path = bench.path("few.las");
    write_las(
        &path,
        (1, 2),
        0,
        GRID,
        &[[0, 0, 0], [5, 1, 3], [i32::MAX, i32::MIN, 0]],
        false,
    );
    let (spool, _, _) = near(&bench, &[path]);
    assert_eq!(spool.stats().dropped_far, 0);
}

/// Pseudo-random numbers from 0 to 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The points that are not far, found by sorting.
fn by_sorting(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let may = points.len() / 2000;
    let core: [[f64; 2]; 3] = std::array::from_fn(|axis| {
        let mut sorted: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        sorted.sort_by(f64::total_cmp);
        [sorted[may], sorted[sorted.len() - 1 - may]]
    });
    let extent = core
        .iter()
        .map(|[low, high]| high - low)
        .fold(0.0, f64::max);
    let inside = |p: &&[f64; 3]| {
        (0..3).all(|a| (core[a][0] - 16.0 * extent..=core[a][1] + 16.0 * extent).contains(&p[a]))
    };
    points.iter().filter(inside).copied().collect()
}

#[test]
fn floats_are_judged_by_the_extent_of_the_others() {
    let bench = Bench::new();
    let mut dropped = 0;
    for (seed, tail) in [(1, 0.1), (2, 1.0), (3, 2.5), (4, 6.0), (5, 20.0)] {
        let mut next = random(seed);
        // The larger the exponent, the farther are the strays.
        let mut coordinate = || {
            let at = 1.0 / (next() + 1e-9) - 1.0;
            let sign = if next() < 0.5 { -1.0 } else { 1.0 };
            f64::from((1000.0 + sign * at.powf(tail).min(1e37)) as f32)
        };
        let mut points: Vec<[f64; 3]> = (0..40_000)
            .map(|_| std::array::from_fn(|_| coordinate()))
            .collect();
        if seed == 1 {
            points.extend([[1e30, 1000.0, 1000.0], [1000.0, -1e-30, -3e38]]);
        }
        let wanted = by_sorting(&points);
        let far = (points.len() - wanted.len()) as u64;
        dropped += far;
        let file = |name: &str, points: &[[f64; 3]]| {
            bench.write(name, ply("binary_little_endian", "float", false, points))
        };
        let whole = file("whole.ply", &points);
        let parts = [
            file("a.ply", &points[..30_000]),
            file("b.ply", &points[30_000..]),
        ];
        let turned = [parts[1].clone(), parts[0].clone()];
        let mut first = None;
        for paths in [&[whole][..], &parts, &turned] {
            let (spool, lattice, positions) = near(&bench, paths);
            assert_eq!(spool.stats().dropped_far, far, "{seed}");
            let first = first.get_or_insert((lattice.clone(), positions.clone()));
            assert!(*first == (lattice, positions), "{seed}");
        }
        // The same as a cloud that never had them.
        let (_, lattice, positions) = near(&bench, &[file("near.ply", &wanted)]);
        if by_sorting(&wanted).len() == wanted.len() {
            assert!(first.unwrap() == (lattice, positions), "{seed}");
        }
    }
    assert!(dropped > 10, "{dropped}");
}

#[test]
fn two_clusters_are_both_kept() {
    let bench = Bench::new();
    let mut next = random(9);
    let points: Vec<[f64; 3]> = (0..50_000)
        .map(|i| std::array::from_fn(|_| next() + if i % 100 == 0 { 1e9 } else { 0.0 }))
        .collect();
    let path = bench.write(
        "two.ply",
        ply("binary_little_endian", "double", false, &points),
    );
    let (spool, _, _) = near(&bench, &[path]);
    assert_eq!(spool.stats().dropped_far, 0);
}
