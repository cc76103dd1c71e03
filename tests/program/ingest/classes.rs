//! Selection of points by class.

use crate::ingest::bench::{Bench, ply};
use crate::ingest::columns::rows;
use crate::ingest::formats::e57::{Scan, cartesian, edited};
use crate::ingest::formats::pcd;
use e57::{Record, RecordDataType, RecordName, RecordValue};
use outcrop_formats::ingest_selected;
use outcrop_points::{Classes, Crop, Selection, Spool};
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

/// Reads the points of these classes.
fn read(bench: &Bench, path: &PathBuf, classes: &Classes) -> Spool {
    let selection = Selection {
        classes: classes.clone(),
        ..Selection::default()
    };
    ingest_selected(std::slice::from_ref(path), &selection, &bench.workspace).unwrap()
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
                let spool = read(&bench, &path, &classes);
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
    let spool = read(&bench, &path, &classes);
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
    let spool = read(&bench, &path, &classes);
    let error = spool.choose_lattice(0).unwrap_err().to_string();
    assert!(
        error.contains("1 withheld, 9 of classes that are not wanted"),
        "{error}"
    );
}

/// The class of point `i` of the files below.
fn class(i: usize) -> usize {
    i * 7 % 19
}

const COUNT: usize = 5000;

/// PLY in text and binary, with the class as a byte or a float.
fn ply_with(body: &str, kind: &str, name: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {body} 1.0\nelement vertex {COUNT}\nproperty float x\nproperty {kind} {name}\n\
         property float y\nproperty float z\nend_header\n"
    )
    .into_bytes();
    for i in 0..COUNT {
        if body == "ascii" {
            bytes.extend(format!("{i} {} 0 0\n", class(i)).bytes());
            continue;
        }
        bytes.extend((i as f32).to_le_bytes());
        match kind {
            "uchar" => bytes.push(class(i) as u8),
            _ => bytes.extend((class(i) as f32).to_le_bytes()),
        }
        bytes.extend([0; 8]);
    }
    bytes
}

fn pcd_with(body: &str) -> Vec<u8> {
    let head = format!(
        "VERSION 0.7\nFIELDS x y z classification\nSIZE 4 4 4 1\nTYPE F F F U\nPOINTS {COUNT}\nDATA {body}\n"
    );
    let point = |i: usize| [&(i as f32).to_le_bytes()[..], &[0; 8], &[class(i) as u8]].concat();
    let column = |f: fn(usize) -> Vec<u8>| (0..COUNT).flat_map(f);
    let body: Vec<u8> = match body {
        "ascii" => (0..COUNT)
            .flat_map(|i| format!("{i} 0 0 {}\n", class(i)).into_bytes())
            .collect(),
        "binary" => (0..COUNT).flat_map(point).collect(),
        _ => {
            let x = column(|i| (i as f32).to_le_bytes().into());
            let rest = column(|_| vec![0; 8]).chain(column(|i| vec![class(i) as u8]));
            pcd::compressed(&x.chain(rest).collect::<Vec<u8>>())
        }
    };
    [head.into_bytes(), body].concat()
}

/// Two scans, of which only the first has classes.
fn e57_scans() -> [Scan; 2] {
    let points = |from: usize| {
        (from..from + COUNT)
            .map(|i| [i as f64, 0.0, 0.0])
            .collect::<Vec<_>>()
    };
    let mut first = cartesian(&RecordDataType::F64, &points(0));
    // It is renamed in the description.
    first.fields.push(Record {
        name: RecordName::RowIndex,
        data_type: RecordDataType::Integer { min: 0, max: 255 },
    });
    for (i, row) in first.rows.iter_mut().enumerate() {
        row.push(RecordValue::Integer(class(i) as i64));
    }
    [first, cartesian(&RecordDataType::F64, &points(COUNT))]
}

fn files_with_a_column(bench: &Bench) -> Vec<PathBuf> {
    let mut files = vec![
        bench.write("a.ply", ply_with("ascii", "uchar", "classification")),
        bench.write("b.ply", ply_with("binary_little_endian", "uchar", "class")),
        bench.write(
            "c.ply",
            ply_with("binary_little_endian", "float", "scalar_Classification"),
        ),
    ];
    for body in pcd::BODIES {
        files.push(bench.write(&format!("{body}.pcd"), pcd_with(body)));
    }
    let lines = (0..COUNT).map(|i| format!("{i},0,0,{}\n", class(i)));
    let text = "x,y,z,Classification\n".to_owned() + &lines.collect::<String>();
    files.push(bench.write("a.csv", text));
    files
}

#[test]
fn a_column_of_classes_selects_points_in_every_format() {
    let bench = Bench::new();
    let mut cases: Vec<(PathBuf, u64, u64)> = files_with_a_column(&bench)
        .into_iter()
        .map(|path| (path, 0, 0))
        .collect();
    // Points without a class are in no list.
    for (number, name) in ["classification", "las:classification"].iter().enumerate() {
        let named = |xml: String| xml.replace("rowIndex", name);
        let path = edited(&bench, &format!("{number}.e57"), &e57_scans(), named);
        cases.push((path, 0, COUNT as u64));
    }
    for (path, kept_more, dropped_more) in cases {
        for (classes, wanted) in [
            (
                Classes::Keep(vec![2, 6]),
                (|c| c == 2 || c == 6) as fn(usize) -> bool,
            ),
            (Classes::Drop(vec![7, 18]), |c| c != 7 && c != 18),
        ] {
            let keeps = matches!(classes, Classes::Keep(_));
            let spool = read(&bench, &path, &classes);
            let stats = spool.stats();
            let kept = (0..COUNT).filter(|i| wanted(class(*i))).count() as u64;
            let more = if keeps { kept_more } else { dropped_more };
            assert_eq!(stats.kept, kept + more, "{path:?} {classes:?}");
            assert_eq!(stats.dropped_by_class + stats.kept, stats.read);
            assert_eq!(stats.warnings, [""; 0], "{path:?}");
            spool.release(&bench.workspace).unwrap();
        }
    }
}

#[test]
fn the_points_that_stay_have_their_values_and_their_place() {
    let bench = Bench::new();
    for path in files_with_a_column(&bench) {
        let selection = Selection {
            classes: Classes::Keep(vec![3, 6]),
            attributes: "classification".parse().unwrap(),
            crop: Some(Crop {
                region: "-1,-1,3000.5,1".parse().unwrap(),
                margin: 0.0,
            }),
            ..Selection::default()
        };
        let spool = ingest_selected(std::slice::from_ref(&path), &selection, &bench.workspace);
        let spool = spool.unwrap();
        let wanted = |i: &usize| [3, 6].contains(&class(*i));
        let inside = (0..3001).filter(wanted);
        let carried = spool.carried(&selection.attributes, false);
        let found = rows(&bench, &spool, &carried);
        let first = (0..COUNT).find(wanted).unwrap();
        for ((place, values), i) in found.iter().zip(inside.clone()) {
            assert_eq!(
                (place[0] as usize, values[0] as usize),
                (i - first, class(i)),
                "{path:?}"
            );
        }
        assert_eq!(found.len(), inside.count());
        let outside = (3001..COUNT).filter(wanted).count() as u64;
        assert_eq!(spool.stats().dropped_by_crop, outside, "{path:?}");
        // The class that only selects is no column of the mesh.
        let carried = spool.carried(&"none".parse().unwrap(), false);
        assert!(carried.is_empty());
        spool.release(&bench.workspace).unwrap();
    }
}
