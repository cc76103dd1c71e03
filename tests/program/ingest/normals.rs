//! Normals of points: their columns have many names, and are read from every format that may have them.

use crate::ingest::bench::Bench;
use crate::ingest::formats::e57::{cartesian, pose};
use e57::{E57Writer, Extension, Record, RecordDataType, RecordName, RecordValue};
use outcrop_formats::{ingest_selected, probe};
use outcrop_points::{Attributes, Selection, direction};
use std::path::{Path, PathBuf};

/// The short forms of the normals of three points at 0, 1 and 2 on the x axis.
fn normals(bench: &Bench, path: &Path, turned: bool) -> Vec<Option<[i32; 3]>> {
    assert!(probe(path).unwrap().normal_bytes > 0, "{path:?}");
    let selection = Selection {
        normals: true,
        ..Selection::default()
    };
    let spool = ingest_selected(&[path.to_path_buf()], &selection, &bench.workspace).unwrap();
    let carried = spool.with_normals(spool.carried(&Attributes::None, false));
    assert!(carried.has_normals() && carried.bytes() == 8, "{path:?}");
    let lattice = spool.choose_lattice(0).unwrap();
    let frames: Vec<u32> = spool.frames().into_iter().map(|f| f.0).collect();
    let mut all = Vec::new();
    let take = |points: &[[i32; 3]], rows: &[u8]| {
        for (point, row) in points.iter().zip(rows.chunks(8)) {
            let word = |at: usize| u32::from_be_bytes(row[at..at + 4].try_into().unwrap());
            all.push((*point, direction([word(0), word(4)])));
        }
        Ok(())
    };
    spool
        .for_values(&bench.workspace, &lattice, &frames, &carried, take)
        .unwrap();
    spool.release(&bench.workspace).unwrap();
    all.sort_by_key(|(point, _)| point[usize::from(turned)]);
    all.into_iter().map(|(_, normal)| normal).collect()
}

/// The normals as they are written: one is none.
const GIVEN: [[f64; 3]; 3] = [[0.0, 0.0, 2.0], [0.0; 3], [-0.6, 0.8, 0.0]];

/// The same in their short form.
const EXPECTED: [Option<[i32; 3]>; 3] = [Some([0, 0, 32767]), None, Some([-19660, 26214, 0])];

fn lines(each: impl Fn(usize, [f64; 3]) -> String) -> String {
    GIVEN
        .into_iter()
        .enumerate()
        .map(|(i, n)| each(i, n))
        .collect()
}

fn text(bench: &Bench) -> PathBuf {
    let points = lines(|i, [a, b, c]| format!("{i} 0 0 7 {a} {b} {c}\n"));
    bench.write("a.asc", format!("//X Y Z Intensity Nx Ny Nz\n{points}"))
}

fn ply(bench: &Bench) -> PathBuf {
    let points = lines(|i, [a, b, c]| format!("{b} {i} 0 0 {a} {c}\n"));
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float ny\nproperty float x\n\
                property float y\nproperty float z\nproperty double nx\nproperty float nz\nend_header\n";
    bench.write("a.ply", format!("{head}{points}"))
}

fn pcd(bench: &Bench) -> PathBuf {
    let points = lines(|i, [a, b, c]| format!("{i} 0 0 {a} {b} {c} 0.1\n"));
    let head = "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z curvature\nSIZE 4 4 4 4 4 4 4\n\
                TYPE F F F F F F F\nCOUNT 1 1 1 1 1 1 1\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n";
    bench.write("a.pcd", format!("{head}{points}"))
}

fn las(bench: &Bench) -> PathBuf {
    let path = bench.path("a.laz");
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(0).unwrap();
    builder.point_format.extra_bytes = 12;
    let descriptor = |name: &str| {
        let mut bytes = vec![0; 192];
        bytes[2] = 9;
        bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
        bytes
    };
    builder.vlrs.push(las::Vlr {
        user_id: "LASF_Spec".into(),
        record_id: 4,
        description: String::new(),
        data: ["NormalX", "NormalY", "NormalZ"].map(descriptor).concat(),
    });
    let mut writer = las::Writer::from_path(&path, builder.into_header().unwrap()).unwrap();
    for (i, normal) in GIVEN.into_iter().enumerate() {
        let point = las::Point {
            x: i as f64,
            extra_bytes: normal.map(|c| (c as f32).to_le_bytes()).concat(),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    path
}

/// A scan that is turned by a right angle about z if `turned`.
fn e57(bench: &Bench, turned: bool) -> PathBuf {
    let path = bench.path("a.e57");
    let mut writer = E57Writer::from_file(&path, "a file").unwrap();
    let url = "http://www.libe57.org/E57_NOR_surface_normals.txt";
    writer
        .register_extension(Extension::new("nor", url))
        .unwrap();
    let places = [0.0, 1.0, 2.0].map(|x| [x, 0.0, 0.0]);
    let mut scan = cartesian(&RecordDataType::F64, &places);
    for name in ["normalX", "normalY", "normalZ"] {
        scan.fields.push(Record {
            name: RecordName::Unknown {
                namespace: "nor".into(),
                name: name.into(),
            },
            data_type: RecordDataType::F32,
        });
    }
    for (row, normal) in scan.rows.iter_mut().zip(GIVEN) {
        row.extend(normal.map(|c| RecordValue::Single(c as f32)));
    }
    let mut part = writer.add_pointcloud("a scan", scan.fields).unwrap();
    let half = 0.5f64.sqrt();
    part.set_transform(turned.then(|| pose(half, [0.0, 0.0, half], [3.0, 4.0, 5.0])));
    for row in scan.rows {
        part.add_point(row).unwrap();
    }
    part.finalize().unwrap();
    writer.finalize().unwrap();
    path
}

#[test]
fn normals_of_every_format_are_read() {
    let bench = Bench::new();
    for path in [
        text(&bench),
        ply(&bench),
        pcd(&bench),
        las(&bench),
        e57(&bench, false),
    ] {
        assert_eq!(normals(&bench, &path, false), EXPECTED, "{path:?}");
    }
    let turned = normals(&bench, &e57(&bench, true), true);
    let expected = [Some([0, 0, 32767]), None, Some([-26214, -19660, 0])];
    assert_eq!(turned, expected);
}

#[test]
fn columns_that_are_no_normal_are_not_read() {
    let bench = Bench::new();
    let path = bench.write("a.xyz", "x y z nx ny\n0 0 0 1 0\n1 0 0 1 0\n");
    assert_eq!(probe(&path).unwrap().normal_bytes, 0);
    let selection = Selection {
        normals: true,
        ..Selection::default()
    };
    let spool = ingest_selected(&[path], &selection, &bench.workspace).unwrap();
    assert_eq!(spool.normal_names(), None);
    assert!(!spool.has_values());
    let carried = spool.with_normals(spool.carried(&Attributes::None, false));
    assert!(carried.is_empty());
}
