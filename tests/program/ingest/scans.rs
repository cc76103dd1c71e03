//! Scans of PCD, PTX and E57: every point, where it belongs.

use crate::ingest::bench::{Bench, based, cloud, positions};
use crate::ingest::formats::e57::{
    SPHERICAL, Scan, cartesian, edited, points, pose, scaled, scan, with_states, write,
};
use crate::ingest::formats::{pcd, ptx};
use e57::{CartesianCoordinate, E57Reader, RecordDataType};
use outcrop_formats::probe;
use outcrop_points::{CoordinateType, Format};
use std::path::{Path, PathBuf};

#[test]
fn reads_every_kind_of_pcd() {
    let bench = Bench::new();
    let whole = cloud(3000, 8);
    let points: Vec<[f64; 3]> = whole.iter().map(|p| p.map(f64::from)).collect();
    for body in pcd::BODIES {
        for kind in [("F", "4"), ("F", "8"), ("I", "4"), ("I", "8")] {
            let path = bench.write("a.pcd", pcd::file(body, kind, &points));
            let spool = bench.read(std::slice::from_ref(&path)).unwrap();
            let lattice = spool.choose_lattice(0).unwrap();
            assert_eq!(
                (lattice.step, lattice.exact),
                (1.0, true),
                "{body} {kind:?}"
            );
            assert_eq!(positions(&bench, &spool, &lattice), based(&whole));
            assert_eq!(spool.source_precision(), CoordinateType::F32);
            assert_eq!(probe(&path).unwrap().points_claimed, Some(3000));
            assert_eq!(spool.stats().files[0].scanners, [[1.0, 2.0, 3.0]]);
        }
    }
}

#[test]
fn reads_pcd_of_many_slabs_and_windows() {
    let bench = Bench::new();
    let whole = cloud(150_000, 3);
    let points: Vec<[f64; 3]> = whole
        .iter()
        .map(|p| p.map(|c| f64::from(c) / 8.0))
        .collect();
    for body in pcd::BODIES {
        let bytes = pcd::file(body, ("F", "8"), &points);
        assert!(body == "binary_compressed" || bytes.len() > 4 << 20);
        let spool = bench.read(&[bench.write("a.pcd", bytes)]).unwrap();
        let lattice = spool.choose_lattice(0).unwrap();
        assert!(lattice.exact, "{body}");
        let found = positions(&bench, &spool, &lattice);
        let steps = 0.125 / lattice.step;
        let whole = based(&whole)
            .into_iter()
            .map(|p| p.map(|c| f64::from(c) * steps));
        assert!(found.iter().map(|p| p.map(f64::from)).eq(whole), "{body}");
    }
}

/// Lines of points in eighths.
fn eighths(points: &[[i32; 3]]) -> Vec<String> {
    let line = |p: &[i32; 3]| {
        let [x, y, z] = p.map(|c| f64::from(c) / 8.0);
        format!("{x} {y} {z} 0.5")
    };
    points.iter().map(line).collect()
}

#[test]
fn points_of_ptx_are_where_the_scanner_puts_them() {
    let bench = Bench::new();
    let whole = cloud(150_000, 5);
    let (first, second) = whole.split_at(100_000);
    // A quarter of a turn, and a stretch along z: all numbers stay eighths.
    let turn = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 2.0]];
    let text = ptx::scan([1000, 100], [0.0; 3], ptx::UNIT, &eighths(first))
        + &ptx::scan([500, 100], [1e5, -50.0, 3.5], turn, &eighths(second));
    assert!(text.len() > 4 << 20);
    let moved = second
        .iter()
        .map(|[x, y, z]| [800_000 - y, x - 400, 2 * z + 28]);
    let whole: Vec<[i32; 3]> = first.iter().copied().chain(moved).collect();
    for end in ["\n", "\r\n"] {
        let path = bench.write("a.ptx", text.replace('\n', end));
        let spool = bench.read(&[path]).unwrap();
        assert_eq!(spool.stats().files[0].format, Format::PTX);
        let scanners = &spool.stats().files[0].scanners;
        assert_eq!(scanners[..], [[0.0; 3], [1e5, -50.0, 3.5]]);
        let lattice = spool.choose_lattice(0).unwrap();
        assert_eq!((lattice.step, lattice.exact), (0.125, true));
        assert!(positions(&bench, &spool, &lattice) == based(&whole));
    }
    let lines: Vec<&str> = text.lines().collect();
    let mut wrong = lines.clone();
    wrong[120_000] = "1 2";
    let error = bench.error(bench.write("b.ptx", wrong.join("\n")));
    assert!(error.contains("line 120001: found \"1 2\""), "{error}");
    let mut wrong = lines;
    wrong[100_010 + 4] = "1 2";
    let error = bench.error(bench.write("c.ptx", wrong.join("\n")));
    assert!(
        error.contains("PTX header, line 100015: found \"1 2\""),
        "{error}"
    );
}

#[test]
fn decimals_of_ptx_that_only_moves_stay_a_lattice() {
    let bench = Bench::new();
    let whole = cloud(600, 6);
    let lines = |point: &[i32; 3]| {
        let [x, y, z] = point.map(|c| f64::from(c) / 1000.0);
        format!("{x:.3} {y:.3} {z:.3} 0.5")
    };
    let lines: Vec<String> = whole.iter().map(lines).collect();
    let text = ptx::scan([20, 30], [600_000.01, 5e6, 0.5], ptx::UNIT, &lines);
    let spool = bench.read(&[bench.write("a.ptx", text)]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.001, true));
    assert_eq!(positions(&bench, &spool, &lattice), based(&whole));
}

#[test]
fn a_scanner_without_a_matrix_is_where_the_third_line_says() {
    let bench = Bench::new();
    let text = ptx::scan(
        [1, 2],
        [0.0; 3],
        ptx::UNIT,
        &["1 2 3".into(), "0 0 0".into()],
    );
    let text = text.replacen("0 0 0\n", "7 8 9\n", 1);
    let spool = bench.read(&[bench.write("a.ptx", text)]).unwrap();
    let stats = spool.stats();
    assert_eq!(stats.files[0].scanners, [[7.0, 8.0, 9.0]]);
    assert_eq!((stats.read, stats.kept, stats.invalid), (2, 1, 1));
}

/// The valid points as the crate that wrote the file reads them.
fn expected(path: &Path) -> Vec<[f64; 3]> {
    let mut reader = E57Reader::from_file(path).unwrap();
    let mut points = Vec::new();
    for scan in reader.pointclouds() {
        for point in reader.pointcloud_simple(&scan).unwrap() {
            if let CartesianCoordinate::Valid { x, y, z } = point.unwrap().cartesian {
                points.push([x, y, z]);
            }
        }
    }
    points
}

/// Compares a file with what another reader finds; returns step and exactness of the lattice.
fn compare(bench: &Bench, path: &PathBuf) -> (f64, bool) {
    let spool = bench.read(std::slice::from_ref(path)).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    let want = expected(path);
    assert_eq!(spool.points(), want.len() as u64);
    let mut found = Vec::new();
    spool
        .for_each(&bench.workspace, &lattice, |points| {
            found.extend(points.iter().map(|p| lattice.position(*p)));
            Ok(())
        })
        .unwrap();
    // Frames are numbered by units, so the order is that of the file.
    let reach = want.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    let slack = reach * 4.0 * f64::EPSILON
        + if lattice.exact {
            0.0
        } else {
            0.51 * lattice.step
        };
    for (a, b) in found.iter().flatten().zip(want.iter().flatten()) {
        assert!((a - b).abs() <= slack, "{a} for {b}, {lattice:?}");
    }
    (lattice.step, lattice.exact)
}

#[test]
fn points_of_e57_are_those_of_another_reader() {
    let bench = Bench::new();
    let whole = RecordDataType::Integer {
        min: 0,
        max: 30_000,
    };
    let kinds = [
        (RecordDataType::F32, 0.25),
        (RecordDataType::F64, 0.25),
        (whole, 1.0),
        (scaled(-10, 50_000, 0.001, 100.0), 0.001),
    ];
    let turned = pose(0.5, [0.5, -0.5, 0.5], [100.0, -50.0, 3.5]);
    let any = pose(0.9, [0.1, 0.3, (1.0f64 - 0.91).sqrt()], [1e5, 5e6, 0.1]);
    for (kind, step) in &kinds {
        let all = points(20_000);
        let plain = || cartesian(kind, &all);
        let path = write(&bench, "plain.e57", &[plain(), cartesian(kind, &points(7))]);
        assert_eq!(compare(&bench, &path), (*step, true), "{kind:?}");
        for pose in [&turned, &any] {
            let posed = Scan {
                pose: Some(pose.clone()),
                ..plain()
            };
            let path = write(&bench, "posed.e57", &[plain(), posed]);
            compare(&bench, &path);
            let spool = bench.read(&[path]).unwrap();
            let to = &pose.translation;
            assert_eq!(spool.stats().files[0].scanners, [[to.x, to.y, to.z]]);
        }
    }
    let angles: Vec<[f64; 3]> = (0..5000)
        .map(|i| {
            let turn = f64::from(i) * 0.001;
            [5.0 + turn, turn - 2.5, turn * 0.5 - 1.2]
        })
        .collect();
    for kind in [RecordDataType::F32, RecordDataType::F64] {
        let mut spherical = scan(SPHERICAL, &kind, &angles);
        spherical.pose = Some(turned.clone());
        compare(&bench, &write(&bench, "spherical.e57", &[spherical]));
    }
}

#[test]
fn whole_numbers_of_e57_of_any_width() {
    let bench = Bench::new();
    for bits in 1..=50 {
        let (lowest, most) = (-7i64, (1i64 << bits) - 1);
        let kind = RecordDataType::Integer {
            min: lowest,
            max: lowest + most,
        };
        let all: Vec<[f64; 3]> = (0..300i64)
            .map(|i| {
                let of = |n: i64| (lowest + n.rem_euclid(most + 1)) as f64;
                [
                    of(i),
                    of(most - i),
                    of(i.wrapping_mul(0x1234_5678_9abc) ^ i),
                ]
            })
            .collect();
        compare(&bench, &write(&bench, "a.e57", &[cartesian(&kind, &all)]));
    }
}

#[test]
fn directions_without_a_point_are_counted() {
    let bench = Bench::new();
    let path = write(&bench, "a.e57", &[with_states()]);
    let spool = bench.read(std::slice::from_ref(&path)).unwrap();
    let stats = spool.stats();
    assert_eq!((stats.read, stats.kept, stats.invalid), (60, 40, 20));
    assert_eq!(stats.files[0].invalid, 20);
    compare(&bench, &path);
}

#[test]
fn reference_systems_of_e57_are_compared() {
    let bench = Bench::new();
    let file = |name: &str, system: &str| {
        let text = format!(
            "<coordinateMetadata type=\"String\"><![CDATA[{system}]]></coordinateMetadata>"
        );
        let scans = [cartesian(&RecordDataType::F32, &points(9))];
        edited(&bench, name, &scans, |xml| {
            xml.replacen("<data3D", &format!("{text}<data3D"), 1)
        })
    };
    let utm = |zone: u32| format!("PROJCS[\"UTM\",AUTHORITY[\"EPSG\",\"{zone}\"]]");
    let (a, b) = (file("a.e57", &utm(32617)), file("b.e57", &utm(32618)));
    let spool = bench.read(&[a.clone(), b]).unwrap();
    let warnings = &spool.stats().warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("EPSG:32618") && warnings[0].contains("EPSG:32617"));
    let spool = bench.read(&[a, file("c.e57", "none known")]).unwrap();
    let warnings = &spool.stats().warnings;
    assert!(
        warnings[0].contains("c.e57: it gives no reference system"),
        "{warnings:?}"
    );
}
