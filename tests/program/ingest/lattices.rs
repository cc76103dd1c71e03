//! One lattice for all files.

use crate::ingest::bench::{Bench, cloud, ply, positions, write_las};
use outcrop_points::CoordinateType;
use std::path::PathBuf;

#[test]
fn the_order_of_files_does_not_matter() {
    let bench = Bench::new();
    let (a, b, c) = (
        bench.path("a.las"),
        bench.path("b.laz"),
        bench.path("c.las"),
    );
    write_las(
        &a,
        (1, 2),
        0,
        (0.01, [1000.0, 0.0, 0.0]),
        &cloud(500, 3),
        false,
    );
    write_las(
        &b,
        (1, 4),
        6,
        (0.001, [2000.0, 10.0, 5.0]),
        &cloud(700, 4),
        false,
    );
    write_las(
        &c,
        (1, 2),
        1,
        (0.0025, [999.75, 0.0, 0.0]),
        &cloud(600, 5),
        false,
    );
    let d = bench.write("d.xyz", "1000.125 1 2\n1001.5 2.25 3\n");
    let mut outcomes = Vec::new();
    for order in [[&a, &b, &c, &d], [&d, &c, &b, &a], [&b, &d, &a, &c]] {
        let spool = bench.read(&order.map(PathBuf::clone)).unwrap();
        let lattice = spool.choose_lattice(0).unwrap();
        let points = positions(&bench, &spool, &lattice);
        outcomes.push((lattice, points));
    }
    assert!(outcomes[0].0.exact);
    assert_eq!(outcomes[0].0.step, 0.0005);
    assert_eq!(outcomes[0].1.len(), 1802);
    assert!(outcomes.iter().all(|o| *o == outcomes[0]));
    let text = outcomes[0].1.iter().map(|p| outcomes[0].0.position(*p));
    assert!(
        text.into_iter()
            .any(|p| (p[0] - 1000.125).abs() < 1e-9 && (p[1] - 1.0).abs() < 1e-9)
    );
}

#[test]
fn meets_offsets_that_are_between_steps() {
    let bench = Bench::new();
    let (a, b) = (bench.path("a.las"), bench.path("b.las"));
    write_las(&a, (1, 2), 0, (0.01, [0.0; 3]), &cloud(50, 6), false);
    write_las(
        &b,
        (1, 2),
        0,
        (0.01, [0.005, 100.0025, 0.0]),
        &cloud(50, 7),
        false,
    );
    let spool = bench.read(&[a.clone(), b.clone()]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.0025, true));
    write_las(
        &b,
        (1, 2),
        0,
        (0.01, [std::f64::consts::PI, 0.0, 0.0]),
        &cloud(50, 7),
        false,
    );
    let lattice = bench.read(&[a, b]).unwrap().choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.001, false));
}

#[test]
fn refines_and_coarsens_to_what_fits() {
    let bench = Bench::new();
    let path = bench.path("a.las");
    let wide = [[i32::MIN, 0, 0], [i32::MAX, 5, 0], [0, 7, 1]];
    write_las(&path, (1, 2), 0, (0.01, [0.0; 3]), &wide, false);
    let spool = bench.read(std::slice::from_ref(&path)).unwrap();
    let lattice = spool.choose_lattice(3).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.05, false));
    assert_eq!(
        positions(&bench, &spool, &lattice).last().unwrap()[0],
        858_993_459
    );
    write_las(&path, (1, 2), 0, (0.01, [0.0; 3]), &cloud(9, 1), false);
    let spool = bench.read(&[path]).unwrap();
    let (coarse, fine) = (
        spool.choose_lattice(0).unwrap(),
        spool.choose_lattice(2).unwrap(),
    );
    assert_eq!((fine.step, fine.exact), (0.0025, true));
    let scaled = positions(&bench, &spool, &coarse)
        .into_iter()
        .map(|p| p.map(|c| 4 * c));
    assert!(scaled.eq(positions(&bench, &spool, &fine)));
    assert!(spool.choose_lattice(40).unwrap().step > 0.01 / (1 << 14) as f64);
}

#[test]
fn floats_lie_on_a_power_of_two() {
    let bench = Bench::new();
    let points = [[0.25, -3.5, 1.0], [8.0, 0.0, f64::NAN], [0.75, 1.0, 2.0]];
    let path = bench.write(
        "a.ply",
        ply("binary_little_endian", "float", false, &points),
    );
    let spool = bench.read(&[path]).unwrap();
    assert_eq!((spool.points(), spool.stats().dropped_non_finite), (2, 1));
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.25, true));
    assert_eq!(positions(&bench, &spool, &lattice), [[0, 0, 0], [2, 18, 4]]);
    let points = [[0.1, 1e-9, 0.0], [1000.0, 0.3, 0.7]];
    let path = bench.write("b.ply", ply("ascii", "double", false, &points));
    std::fs::write(
        &path,
        std::fs::read_to_string(&path)
            .unwrap()
            .replace("0.3", "3e-1"),
    )
    .unwrap();
    let spool = bench.read(&[path]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (2f64.powi(-20), false));
    assert_eq!(spool.source_precision(), CoordinateType::F64);
}

/// Found by fuzzing: the lattice is chosen without files of which no point is kept, and need not cover them.
#[test]
fn a_file_without_points_may_be_anywhere() {
    let bench = Bench::new();
    let far = bench.path("far.las");
    write_las(&far, (1, 2), 0, (0.01, [1e300, 0.0, 0.0]), &[], false);
    let near = bench.write("near.xyz", "1.5 2 -3.25\n1 2 3\n");
    let spool = bench.read(&[far, near]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!(positions(&bench, &spool, &lattice).len(), 2);
}
