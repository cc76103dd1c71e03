//! Selection of points by class.

use crate::bench::{Bench, ply};
use outcrop::stages::ingest::{Classes, ingest_classes};
use std::path::{Path, PathBuf};

/// Point `i` has class `i % 19`; every hundredth is withheld.
fn write(path: &Path, version: (u8, u8), format: u8, count: i32) {
    let mut builder = las::Builder::from(version);
    builder.point_format = las::point::Format::new(format).unwrap();
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    let format = *writer.header().point_format();
    for i in 0..count {
        // Class 12 means overlap, which is a flag in new formats.
        let class = match i % 19 {
            12 => 11,
            class => class as u8,
        };
        let point = las::Point {
            x: f64::from(i),
            y: f64::from(i % 7),
            classification: las::point::Classification::new(class).unwrap(),
            is_withheld: i % 100 == 0,
            is_key_point: i % 3 == 0,
            is_synthetic: i % 5 == 0,
            gps_time: format.has_gps_time.then_some(f64::from(i)),
            color: format.has_color.then(|| las::Color::new(1, 2, 3)),
            nir: format.has_nir.then_some(4),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn classes_are_found_in_every_format() {
    let bench = Bench::new();
    let count = 60_000;
    for (version, format) in [
        ((1, 2), 0),
        ((1, 2), 1),
        ((1, 2), 3),
        ((1, 4), 6),
        ((1, 4), 8),
    ] {
        for kind in ["las", "laz"] {
            let path = bench.path(&format!("classes-{format}.{kind}"));
            write(&path, version, format, count);
            for (classes, wanted) in [
                (Classes::All, (|_| true) as fn(i32) -> bool),
                (Classes::Keep(vec![2, 6]), |c| c == 2 || c == 6),
                (Classes::Drop(vec![7, 18]), |c| c != 7 && c != 18),
            ] {
                let paths = std::slice::from_ref(&path);
                let spool = ingest_classes(paths, &classes, &bench.workspace).unwrap();
                let stats = spool.stats();
                let present = || (0..count).filter(|i| i % 100 != 0);
                let kept = present().filter(|i| wanted(i % 19)).count() as u64;
                assert_eq!(stats.kept, kept, "{path:?} {classes:?}");
                assert_eq!(stats.dropped_by_class, present().count() as u64 - kept);
                assert_eq!(stats.read, count as u64);
                assert!(stats.warnings.is_empty());
            }
        }
    }
}

#[test]
fn files_without_classes_are_read_whole_and_it_is_said() {
    let bench = Bench::new();
    let points: Vec<[f64; 3]> = (0..50).map(|i| [f64::from(i), 1.0, 2.0]).collect();
    let path: PathBuf = bench.write("a.ply", ply("ascii", "float", false, &points));
    let classes = Classes::Keep(vec![2]);
    let spool = ingest_classes(&[path], &classes, &bench.workspace).unwrap();
    assert_eq!(spool.points(), 50);
    let warnings = &spool.stats().warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("no class"),
        "{warnings:?}"
    );
}

#[test]
fn what_is_left_out_is_told_if_nothing_is_left() {
    let bench = Bench::new();
    let path = bench.path("a.las");
    write(&path, (1, 2), 0, 10);
    let classes = Classes::Keep(vec![30]);
    let spool = ingest_classes(&[path], &classes, &bench.workspace).unwrap();
    let error = spool.choose_lattice(0).unwrap_err().to_string();
    assert!(
        error.contains("1 withheld, 9 of classes that are not wanted"),
        "{error}"
    );
}
