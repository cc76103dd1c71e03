//! Columns of points: every field of LAS and LAZ, and the properties of PLY, are what was written.

use super::bench::{Bench, cloud, write_las};
use outcrop::Error;
use outcrop_formats::{ingest_selected, probe};
use outcrop_geom::Point;
use outcrop_points::{Attributes, Carried, Selection, Spool};
use std::path::{Path, PathBuf};

fn selection(list: &str) -> Selection {
    Selection {
        attributes: list.parse().unwrap(),
        ..Selection::default()
    }
}

/// The points with their values as numbers, sorted.
pub fn rows(bench: &Bench, spool: &Spool, carried: &Carried) -> Vec<(Point, Vec<f64>)> {
    let lattice = spool.choose_lattice(0).unwrap();
    let frames: Vec<u32> = spool.frames().into_iter().map(|f| f.0).collect();
    let mut all = Vec::new();
    let take = |points: &[Point], values: &[u8]| {
        for (point, row) in points.iter().zip(values.chunks(carried.bytes())) {
            let mut at = 0;
            let values = carried.columns.iter().map(|column| {
                let mut bytes = Vec::new();
                let own = &row[at..at + column.scalar.bytes()];
                Carried::unordered(column, own, &mut bytes);
                at += own.len();
                outcrop_ply::real(column.scalar, &bytes, false)
            });
            all.push((*point, values.collect()));
        }
        Ok(())
    };
    spool
        .for_values(&bench.workspace, &lattice, &frames, carried, take)
        .unwrap();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all
}

/// Reads files with the columns of a list.
pub fn read(bench: &Bench, paths: &[PathBuf], list: &str, wide: bool) -> (Spool, Carried) {
    let selection = selection(list);
    let spool = ingest_selected(paths, &selection, &bench.workspace).unwrap();
    let carried = spool.carried(&selection.attributes, wide);
    (spool, carried)
}

/// The values of point `number` as the crate `las` reads them, in the order of `columns`; near infrared, which it
/// does not read, as it was written.
fn expected(number: usize, point: &las::Point, columns: &[&str]) -> Vec<f64> {
    let color = point.color.unwrap_or_default();
    let value = |name: &&str| match *name {
        "intensity" => point.intensity.into(),
        "return_number" => point.return_number.into(),
        "number_of_returns" => point.number_of_returns.into(),
        "classification" => u8::from(point.classification).into(),
        "user_data" => point.user_data.into(),
        "point_source" => point.point_source_id.into(),
        "scan_angle" => f64::from(point.scan_angle),
        "gps_time" => point.gps_time.unwrap(),
        "red" => color.red.into(),
        "green" => color.green.into(),
        "blue" => color.blue.into(),
        "near_infrared" => (number as u16).into(),
        other => panic!("{other}"),
    };
    columns.iter().map(value).collect()
}

fn las_points(path: &Path) -> Vec<las::Point> {
    let mut reader = las::Reader::from_path(path).unwrap();
    let all = reader.read_all().unwrap();
    all.points().map(Result::unwrap).collect()
}

#[test]
fn every_field_of_every_point_format_is_kept() {
    let bench = Bench::new();
    let points = cloud(60_000, 5);
    for (minor, formats) in [(0, 0..=1), (2, 0..=3), (3, 4..=5), (4, 0..=10)] {
        for format in formats {
            for kind in ["las", "laz"] {
                let path = bench.path(&format!("v{minor}-{format}.{kind}"));
                let count = if kind == "laz" && minor == 4 {
                    60_000
                } else {
                    999
                };
                let grid = (0.001, [4e5, 5e6, 0.0]);
                write_las(&path, (1, minor), format, grid, &points[..count], false);
                let columns = probe(&path).unwrap().columns;
                let names: Vec<&str> = columns.iter().map(|c| &*c.name).collect();
                let (spool, carried) =
                    read(&bench, std::slice::from_ref(&path), &names.join(","), true);
                assert!(
                    carried
                        .columns
                        .iter()
                        .map(|c| &*c.name)
                        .eq(names.iter().copied())
                );
                let found = rows(&bench, &spool, &carried);
                let low = based_on(&points[..count]);
                let mut want: Vec<(Point, Vec<f64>)> = Vec::new();
                for (i, (point, at)) in las_points(&path).iter().zip(&points).enumerate() {
                    let place = std::array::from_fn(|a| at[a] - low[a]);
                    want.push((place, expected(i, point, &names)));
                }
                want.sort_by(|a, b| a.partial_cmp(b).unwrap());
                assert_eq!(found.len(), want.len());
                for (found, want) in found.iter().zip(&want) {
                    assert_eq!(found.0, want.0);
                    for ((name, f), w) in names.iter().zip(&found.1).zip(&want.1) {
                        let near = if *name == "scan_angle" { 1e-4 } else { 0.0 };
                        assert!((f - w).abs() <= near, "{path:?}: {name} is {f}, not {w}");
                    }
                }
                spool.release(&bench.workspace).unwrap();
            }
        }
    }
}

fn based_on(points: &[[i32; 3]]) -> [i32; 3] {
    std::array::from_fn(|a| points.iter().map(|p| p[a]).min().unwrap())
}

fn ply(format: &str, properties: &str, count: usize) -> String {
    format!("ply\nformat {format} 1.0\nelement vertex {count}\n{properties}end_header\n")
}

#[test]
fn properties_of_ply_are_columns_in_text_and_binary() {
    let bench = Bench::new();
    let properties = "property float x\nproperty uchar Red\nproperty float y\nproperty double scalar_Time\n\
        property float z\nproperty list uchar int odd\nproperty short depth\n";
    let values = [
        (1.0, 200, 2.0, 1e9 + 0.25, 3.0, -5),
        (4.0, 7, 5.0, f64::NAN, 6.0, 300),
    ];
    let lines: Vec<String> = values
        .iter()
        .map(|(x, r, y, t, z, d)| format!("{x} {r} {y} {t} {z} 2 8 9 {d}\n"))
        .collect();
    let text = ply("ascii", properties, 2) + &lines.concat();
    let mut files = vec![bench.write("text.ply", text)];
    for big in [false, true] {
        let name = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        for lists in [true, false] {
            let properties = match lists {
                true => properties.to_owned(),
                false => properties.replace("property list uchar int odd\n", ""),
            };
            let mut bytes = ply(name, &properties, 2).into_bytes();
            let mut put = |one: &[u8]| {
                let mut one = one.to_vec();
                if big {
                    one.reverse();
                }
                bytes.extend(one);
            };
            for (x, r, y, t, z, d) in values {
                put(&f32::to_le_bytes(x));
                put(&[r as u8]);
                put(&f32::to_le_bytes(y));
                put(&f64::to_le_bytes(t));
                put(&f32::to_le_bytes(z));
                if lists {
                    put(&[2]);
                    put(&8i32.to_le_bytes());
                    put(&9i32.to_le_bytes());
                }
                put(&i16::to_le_bytes(d));
            }
            files.push(bench.write(&format!("{name}-{lists}.ply"), bytes));
        }
    }
    for file in files {
        let (spool, carried) = read(&bench, std::slice::from_ref(&file), "time,DEPTH,red", false);
        let found = rows(&bench, &spool, &carried);
        assert_eq!(found[0].1, [1e9 + 0.25, -5.0, 200.0], "{file:?}");
        assert!(found[1].1[0].is_nan(), "{file:?}");
        assert_eq!(found[1].1[1..], [300.0, 7.0], "{file:?}");
    }
}

#[test]
fn files_without_a_column_and_colours_of_all_kinds_agree() {
    let bench = Bench::new();
    let colors = |kind: &str| {
        format!(
            "property float x\nproperty float y\nproperty float z\nproperty {kind} red\nproperty {kind} green\nproperty {kind} blue\n"
        )
    };
    let narrow = bench.write(
        "narrow.ply",
        ply("ascii", &colors("uchar"), 1) + "0 0 0 255 128 1\n",
    );
    let unit = bench.write(
        "unit.ply",
        ply("ascii", &colors("float"), 1) + "1 0 0 1 0.501960784 0.003921569\n",
    );
    let wide = bench.write(
        "wide.ply",
        ply("ascii", &colors("ushort"), 1) + "2 0 0 65535 32896 257\n",
    );
    let none = bench.write("none.xyz", "3 0 0\n");
    let files = [narrow, unit, wide, none];
    let (spool, carried) = read(&bench, &files, "color", false);
    let found = rows(&bench, &spool, &carried);
    let (full, black) = (vec![255.0, 128.0, 1.0], vec![0.0; 3]);
    assert!(found.iter().map(|r| &r.1).eq([&full, &full, &full, &black]));
    assert!(
        carried.warnings[0].starts_with("1 of 4 files have no red"),
        "{:?}",
        carried.warnings
    );
    let (spool, carried) = read(&bench, &files, "color", true);
    let found = rows(&bench, &spool, &carried);
    let full = vec![65535.0, 32896.0, 257.0];
    assert!(found.iter().map(|r| &r.1).eq([&full, &full, &full, &black]));
    // Only 8 of 16 bits are used.
    let dark = bench.write(
        "dark.ply",
        ply("ascii", &colors("ushort"), 1) + "2 0 0 255 128 1\n",
    );
    let (spool, carried) = read(&bench, &[dark], "color", false);
    assert_eq!(rows(&bench, &spool, &carried)[0].1, [255.0, 128.0, 1.0]);
    assert_eq!(carried.warnings, ["colours 8 bits"]);
}

#[test]
fn what_no_file_has_is_refused_and_what_is_always_the_same_is_left_out() {
    let bench = Bench::new();
    let path = bench.path("cloud.las");
    write_las(&path, (1, 2), 2, (0.01, [0.0; 3]), &cloud(500, 3), false);
    let error = ingest_selected(
        std::slice::from_ref(&path),
        &selection("intensity,foo"),
        &bench.workspace,
    );
    let error = error.unwrap_err();
    assert!(matches!(error, Error::Parameter { .. }));
    assert!(
        error.to_string().contains("foo") && error.to_string().contains("return_number"),
        "{error}"
    );
    let (_, carried) = read(&bench, &[path], "auto", false);
    let names = carried.columns.iter().map(|c| &*c.name);
    assert!(
        names.eq(["red", "green", "blue", "intensity"]),
        "{carried:?}"
    );
    assert_eq!(
        carried.warnings[0],
        "the same at all points, so not kept: classification"
    );
    let text = bench.write("cloud.xyz", "1 2 3\n4 5 6\n");
    let (spool, carried) = read(&bench, &[text], "auto", false);
    assert!(!spool.has_values() && carried.columns.is_empty());
    assert_eq!(Attributes::default(), Attributes::None);
}

/// A descriptor of extra bytes: type, options, name, scale, offset.
fn descriptor(kind: u8, options: u8, name: &str, scale: f64, offset: f64) -> Vec<u8> {
    let mut bytes = vec![0; 192];
    (bytes[2], bytes[3]) = (kind, options);
    bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
    for part in 0..3 {
        bytes[112 + 8 * part..][..8].copy_from_slice(&scale.to_le_bytes());
        bytes[136 + 8 * part..][..8].copy_from_slice(&offset.to_le_bytes());
    }
    bytes
}

#[test]
fn extra_bytes_of_las_are_columns_by_their_names() {
    let bench = Bench::new();
    // Unsigned 16 bits with scale and offset, three bytes of nothing, two floats, signed 64 bits.
    let data = [
        descriptor(3, 0b11000, "Pulse width", 0.5, 100.0),
        descriptor(0, 3, "", 0.0, 0.0),
        descriptor(19, 0, "Normal", 0.0, 0.0),
        descriptor(8, 0, "Intensity", 0.0, 0.0),
    ];
    for (kind, format) in [("las", 1), ("laz", 3), ("las", 6), ("laz", 7), ("laz", 4)] {
        let path = bench.path(&format!("{format}.{kind}"));
        let mut builder = las::Builder::from((1, 4));
        builder.point_format = las::point::Format::new(format).unwrap();
        builder.point_format.extra_bytes = 21;
        builder.vlrs.push(las::Vlr {
            user_id: "LASF_Spec".into(),
            record_id: 4,
            description: String::new(),
            data: data.concat(),
        });
        let header = builder.into_header().unwrap();
        let format = *header.point_format();
        let mut writer = las::Writer::from_path(&path, header).unwrap();
        let count = 70_000u32;
        for i in 0..count {
            let extra = [
                &(i as u16).to_le_bytes()[..],
                &[7; 3],
                &(i as f32 / 3.0).to_le_bytes(),
                &(-1f32).to_le_bytes(),
                &(i64::from(i) - 9).to_le_bytes(),
            ];
            let point = las::Point {
                x: f64::from(i),
                gps_time: format.has_gps_time.then_some(1.0),
                color: format.has_color.then(las::Color::default),
                waveform: format.has_waveform.then(Default::default),
                extra_bytes: extra.concat(),
                ..Default::default()
            };
            writer.write_point(point).unwrap();
        }
        writer.close().unwrap();
        let columns = probe(&path).unwrap().columns;
        let names: Vec<&str> = columns.iter().map(|c| &*c.name).collect();
        assert!(names.ends_with(&["pulse_width", "normal0", "normal1", "extra_intensity"]));
        let list = "extra_intensity,normal1,pulse_width,normal0";
        let (spool, carried) = read(&bench, std::slice::from_ref(&path), list, true);
        let found = rows(&bench, &spool, &carried);
        assert_eq!(found.len(), count as usize);
        for (i, (_, values)) in found.iter().enumerate() {
            let width = f64::from(i as u16) * 0.5 + 100.0;
            let normal = f64::from(i as f32 / 3.0);
            assert_eq!(
                *values,
                [i as f64 - 9.0, -1.0, width, normal],
                "{path:?} {i}"
            );
        }
        spool.release(&bench.workspace).unwrap();
        // Nothing of it is decoded unless it is wanted, and the usual columns are as before.
        let (spool, carried) = read(&bench, std::slice::from_ref(&path), "intensity", true);
        assert!(
            rows(&bench, &spool, &carried)
                .iter()
                .all(|(_, v)| v == &[0.0])
        );
        spool.release(&bench.workspace).unwrap();
    }
}

#[test]
fn columns_with_the_names_of_coordinates_are_extra() {
    let bench = Bench::new();
    let path = bench.path("a.las");
    let mut builder = las::Builder::from((1, 4));
    builder.point_format.extra_bytes = 8;
    let names = ["X", "y", "extra_x", "z"];
    builder.vlrs.push(las::Vlr {
        user_id: "LASF_Spec".into(),
        record_id: 4,
        description: String::new(),
        data: names.map(|name| descriptor(3, 0, name, 0.0, 0.0)).concat(),
    });
    let mut writer = las::Writer::from_path(&path, builder.into_header().unwrap()).unwrap();
    for i in 0..9u16 {
        let extra: Vec<u8> = (0..4).flat_map(|n| (10 * i + n).to_le_bytes()).collect();
        let point = las::Point {
            x: i.into(),
            extra_bytes: extra,
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
    let columns = probe(&path).unwrap().columns;
    let found: Vec<&str> = columns.iter().map(|c| &*c.name).collect();
    assert!(
        found.ends_with(&["extra_x", "extra_y", "extra_extra_x", "extra_z"]),
        "{found:?}"
    );
    let (spool, carried) = read(&bench, &[path], "X,z,extra_y", false);
    let names: Vec<&str> = carried.columns.iter().map(|c| &*c.name).collect();
    assert_eq!(names, ["extra_x", "extra_z", "extra_y"]);
    for (i, (_, values)) in rows(&bench, &spool, &carried).iter().enumerate() {
        let base = 10.0 * i as f64;
        assert_eq!(*values, [base, base + 3.0, base + 1.0]);
    }
    let properties = "property float x\nproperty float y\nproperty float z\nproperty float X\nproperty int scalar_Y\n";
    let ply = bench.write("a.ply", ply("ascii", properties, 1) + "1 2 3 4 5\n");
    let pcd = "FIELDS x y z X scalar_Y\nSIZE 4 4 4 4 4\nTYPE F F F F I\nPOINTS 1\nDATA ascii\n1 2 3 4 5\n";
    let pcd = bench.write("a.pcd", pcd);
    for path in [ply, pcd] {
        let (spool, carried) = read(&bench, std::slice::from_ref(&path), "x,y", false);
        let names: Vec<&str> = carried.columns.iter().map(|c| &*c.name).collect();
        assert_eq!(names, ["extra_x", "extra_y"], "{path:?}");
        assert_eq!(rows(&bench, &spool, &carried)[0].1, [4.0, 5.0], "{path:?}");
    }
}
