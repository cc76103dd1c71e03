//! Columns of PCD, PTX, text and E57.

use crate::ingest::bench::Bench;
use crate::ingest::columns::{read, rows};
use crate::ingest::formats::e57::{Scan, cartesian, scaled, write};
use crate::ingest::formats::{pcd, ptx};
use e57::{Record, RecordDataType, RecordName, RecordValue};
use outcrop_formats::{ingest_selected, probe};
use outcrop_points::Selection;
use std::path::Path;

fn names(path: &Path) -> Vec<String> {
    let columns = probe(path).unwrap().columns.into_iter();
    columns.map(|column| column.name).collect()
}

/// The values of all points, in the order of their positions.
fn values(bench: &Bench, path: &Path, list: &str) -> Vec<Vec<f64>> {
    let (spool, carried) = read(bench, &[path.to_path_buf()], list, false);
    let found = rows(bench, &spool, &carried);
    spool.release(&bench.workspace).unwrap();
    found.into_iter().map(|(_, values)| values).collect()
}

/// Points along x with a packed colour, an intensity, a whole number of 64 bits, and a label.
fn pcd_file(body: &str, colors: &str, count: u32) -> Vec<u8> {
    let mut bytes = format!(
        "VERSION 0.7\nFIELDS y rgb intensity _ x stamp z Label\nSIZE 4 4 4 1 4 8 4 2\nTYPE F {colors} F U F U F I\n\
         COUNT 1 1 1 3 1 1 1 1\nPOINTS {count}\nDATA {body}\n"
    )
    .into_bytes();
    let mut columns: [Vec<u8>; 8] = Default::default();
    for i in 0..count {
        let color = 0x00c8_6400 | (i % 256);
        let (intensity, label) = (i as f32 / 4.0, i as i16 - 50);
        if body == "ascii" {
            let color = match colors {
                "F" => format!("{:e}", f32::from_bits(color)),
                _ => color.to_string(),
            };
            let line = format!(
                "0 {color} {intensity} 0 0 0 {i} {} 1.5 {label}\n",
                u64::from(i) + 7
            );
            bytes.extend(line.into_bytes());
            continue;
        }
        let row: [&[u8]; 8] = [
            &[0; 4],
            &color.to_le_bytes(),
            &intensity.to_le_bytes(),
            &[0; 3],
            &(i as f32).to_le_bytes(),
            &(u64::from(i) + 7).to_le_bytes(),
            &1.5f32.to_le_bytes(),
            &label.to_le_bytes(),
        ];
        match body {
            "binary" => row.iter().for_each(|part| bytes.extend(*part)),
            _ => columns
                .iter_mut()
                .zip(row)
                .for_each(|(c, part)| c.extend(part)),
        }
    }
    if body == "binary_compressed" {
        columns[3].clear();
        bytes.extend(pcd::compressed(&columns.concat()));
    }
    bytes
}

#[test]
fn fields_of_pcd_are_columns() {
    let bench = Bench::new();
    for body in pcd::BODIES {
        for colors in ["F", "U"] {
            let path = bench.write("a.pcd", pcd_file(body, colors, 20_000));
            let all = ["red", "green", "blue", "intensity", "stamp", "label"];
            assert_eq!(names(&path), all);
            let found = values(&bench, &path, "label,colour,stamp,intensity");
            assert_eq!(found.len(), 20_000);
            for (i, values) in found.iter().enumerate() {
                let i = i as f64;
                let want = [i - 50.0, 200.0, 100.0, i % 256.0, i + 7.0, i / 4.0];
                assert_eq!(*values, want, "{body} {colors} {i}");
            }
            // The last column alone, and none.
            let found = values(&bench, &path, "label");
            assert!(
                found
                    .iter()
                    .enumerate()
                    .all(|(i, v)| *v == [i as f64 - 50.0])
            );
            assert_eq!(bench.read(&[path]).unwrap().points(), 20_000);
        }
    }
    let short = "FIELDS x y z a b\nSIZE 4 4 4 4 4\nTYPE F F F F U\nPOINTS 2\nDATA ascii\n";
    let path = bench.write("short.pcd", format!("{short}1 0 0 9 8\n2 0 0 word\n"));
    let found = values(&bench, &path, "a,b");
    assert_eq!(found[0], [9.0, 8.0]);
    assert!(found[1][0].is_nan() && found[1][1] == 0.0);
}

#[test]
fn lines_of_ptx_have_an_intensity_and_a_colour() {
    let bench = Bench::new();
    let line = |i: i32| format!("{i} 0 0 0.{i}25 {} 2 3", 10 * i);
    let lines: Vec<String> = (1..=4).map(line).collect();
    let path = bench.write("a.ptx", ptx::scan([2, 2], [0.0; 3], ptx::UNIT, &lines));
    assert_eq!(
        names(&path),
        ["intensity", "red", "green", "blue", "scanner"]
    );
    let found = values(&bench, &path, "blue,red,intensity");
    assert_eq!(found[1], [3.0, 20.0, 0.225f32.into()]);
    assert_eq!(found.len(), 4);
    // The decimals of other numbers are not those of the lattice.
    let (spool, _) = read(&bench, &[path], "intensity", false);
    assert_eq!(spool.choose_lattice(0).unwrap().step, 1.0);
    let gray: Vec<String> = ["1 2 3 0.5", "4 5 6", "7 8 9 0.25", "0 0 0 0.5"]
        .map(str::to_owned)
        .into();
    let path = bench.write("b.ptx", ptx::scan([1, 4], [0.0; 3], ptx::UNIT, &gray));
    assert_eq!(names(&path), ["intensity", "scanner"]);
    let found = values(&bench, &path, "intensity");
    assert_eq!((found.len(), found[0][0], found[2][0]), (3, 0.5, 0.25));
    assert!(found[1][0].is_nan());
}

#[test]
fn six_numbers_in_a_line_of_ptx_are_coordinates_and_a_colour() {
    let bench = Bench::new();
    let colored = ["1 0 0 255 20 3", "2 0 0 7 8 9"].map(str::to_owned);
    let path = bench.write("a.ptx", ptx::scan([1, 2], [0.0; 3], ptx::UNIT, &colored));
    assert_eq!(names(&path), ["red", "green", "blue", "scanner"]);
    let found = values(&bench, &path, "color");
    assert_eq!(found, [[255.0, 20.0, 3.0], [7.0, 8.0, 9.0]]);
}

/// Whatever the first scan has: a later one has a colour, also behind more lines than are looked at in advance.
#[test]
fn colours_of_a_later_scan_of_ptx_are_read() {
    let bench = Bench::new();
    for (name, count) in [("few.ptx", 5), ("many.ptx", 60_000)] {
        let gray: Vec<String> = (0..count).map(|i| format!("{i} 1 1 0.5")).collect();
        let colored = ["1 0 0 0.25 255 20 3", "2 0 0 7 8 9", "0 0 0 0.5 1 1 1"].map(str::to_owned);
        let first = ptx::scan([1, count], [0.0; 3], ptx::UNIT, &gray);
        let text = first.clone() + &ptx::scan([3, 1], [-9.0, 0.0, 0.0], ptx::UNIT, &colored);
        let path = bench.write(name, text);
        let (spool, carried) = read(
            &bench,
            std::slice::from_ref(&path),
            "color,intensity",
            false,
        );
        let found = rows(&bench, &spool, &carried);
        assert_eq!(found[0].1, [255.0, 20.0, 3.0, 0.25], "{name}");
        assert_eq!(found[1].1[..3], [7.0, 8.0, 9.0], "{name}");
        assert!(found[1].1[3].is_nan());
        assert_eq!(found[2].1, [0.0, 0.0, 0.0, 0.5], "{name}");
        let stats = spool.stats();
        assert_eq!(
            stats.files[0].columns,
            ["intensity", "red", "green", "blue", "scanner"]
        );
        assert!(
            stats.warnings[0].contains("no colour"),
            "{:?}",
            stats.warnings
        );
        // Of one without any there are none, though its beginning cannot tell.
        let path = bench.write(name, first);
        let (spool, carried) = read(&bench, std::slice::from_ref(&path), "auto", false);
        assert_eq!(spool.stats().files[0].columns, ["intensity", "scanner"]);
        assert!(carried.columns.is_empty(), "{:?}", carried.columns);
        let selection = Selection {
            attributes: "red".parse().unwrap(),
            ..Selection::default()
        };
        let refused = ingest_selected(&[path], &selection, &bench.workspace).map(|_| ());
        assert!(refused.unwrap_err().to_string().contains("red"));
    }
}

#[test]
fn text_has_the_columns_of_its_header_and_of_pts() {
    let bench = Bench::new();
    let pts = "2\n1 2 3 -1035.25 10 20 30\n4 5 6 7 40 50 60\n1\n7 8 9 0 0 0 0\n";
    let path = bench.write("a.pts", pts);
    assert_eq!(names(&path), ["intensity", "red", "green", "blue"]);
    let found = values(&bench, &path, "red,intensity");
    assert_eq!(found, [[10.0, -1035.25], [40.0, 7.0], [0.0, 0.0]]);
    let (spool, _) = read(&bench, &[path], "intensity", false);
    assert_eq!(spool.choose_lattice(0).unwrap().step, 1.0);
    assert_eq!(
        names(&bench.write("b.pts", "1\n1 2 3 4 5 6\n")),
        ["red", "green", "blue"]
    );
    assert_eq!(names(&bench.write("c.pts", "1\n1 2 3 4\n")), ["intensity"]);
    assert_eq!(names(&bench.write("d.xyz", "1 2 3 4\n")), [""; 0]);
    let csv = "Id;Z;X;Y;Scalar_Depth;R\n7;1,5;2;3;0,25;255\n8;1;4;3;none;0\n";
    let path = bench.write("a.csv", csv);
    assert_eq!(names(&path), ["id", "depth", "red"]);
    let found = values(&bench, &path, "depth,id");
    assert_eq!(found[0], [0.25, 7.0]);
    assert!(found[1][0].is_nan() && found[1][1] == 8.0);
}

/// A scan on a grid, with an intensity that is not always valid, a colour and a time.
fn e57_scan(from: u32, color: bool) -> Scan {
    let points: Vec<[f64; 3]> = (from..from + 3000).map(|i| [i.into(), 0.0, 5.0]).collect();
    let mut scan = cartesian(&scaled(0, 10_000, 0.5, 10.0), &points);
    let field = |name, data_type| Record { name, data_type };
    let flag = RecordDataType::Integer { min: 0, max: 1 };
    let mut more = vec![
        field(RecordName::IsIntensityInvalid, flag),
        field(RecordName::TimeStamp, scaled(0, 99_999, 0.25, 100.0)),
        field(
            RecordName::RowIndex,
            RecordDataType::Integer {
                min: 0,
                max: 70_000,
            },
        ),
    ];
    if color {
        more.extend([
            Record::COLOR_RED_U8,
            Record::COLOR_GREEN_U8,
            Record::COLOR_BLUE_U8,
        ]);
    }
    scan.fields.extend(more);
    for (i, row) in scan.rows.iter_mut().enumerate() {
        let i = i as i64;
        row.push(RecordValue::Integer(i64::from(i % 5 == 1)));
        row.push(RecordValue::ScaledInteger(i));
        row.push(RecordValue::Integer(i * 3));
        if color {
            row.extend([i % 256, 7, 255].map(RecordValue::Integer));
        }
    }
    scan
}

#[test]
fn parts_of_e57_records_are_columns() {
    let bench = Bench::new();
    let path = write(&bench, "a.e57", &[e57_scan(0, true), e57_scan(3000, false)]);
    let all = [
        "intensity",
        "time_stamp",
        "row",
        "red",
        "green",
        "blue",
        "scanner",
    ];
    assert_eq!(names(&path), all);
    let found = values(&bench, &path, "time_stamp,blue,red,intensity,row");
    assert_eq!(found.len(), 6000);
    for (i, values) in found.iter().enumerate() {
        let (colored, i) = (i < 3000, (i % 3000) as f64);
        let [blue, red] = if colored {
            [255.0, i % 256.0]
        } else {
            [0.0; 2]
        };
        let intensity = if i % 5.0 == 1.0 { 0.0 } else { i % 500.0 };
        assert_eq!(*values, [100.0 + 0.25 * i, blue, red, intensity, 3.0 * i]);
    }
    let (spool, _) = read(&bench, &[path], "row", false);
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.5, true));
}

/// Its description is behind the points, where the beginning of a compressed file does not reach.
#[test]
fn a_compressed_e57_has_an_estimate_and_columns() {
    let bench = Bench::new();
    let mut random = oorandom::Rand64::new(3);
    let places: Vec<[f64; 3]> = (0..120_000)
        .map(|i| [f64::from(i), random.rand_float(), random.rand_float()])
        .collect();
    let mut scan = cartesian(&RecordDataType::F64, &places);
    scan.fields.push(Record {
        name: RecordName::Intensity,
        data_type: RecordDataType::F32,
    });
    for (n, row) in scan.rows.iter_mut().enumerate() {
        row.push(RecordValue::Single(n as f32));
    }
    let plain = write(&bench, "a.e57", &[scan]);
    let bytes = std::fs::read(&plain).unwrap();
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut encoder, &bytes).unwrap();
    let path = bench.write("b.e57.gz", encoder.finish().unwrap());
    let known = probe(&path).unwrap();
    assert!(!known.is_described && probe(&plain).unwrap().is_described);
    let likely = known.points_likely as f64 / 120_000.0;
    assert!((0.5..4.0).contains(&likely), "{likely}");
    assert_eq!(
        values(&bench, &path, "intensity"),
        values(&bench, &plain, "intensity")
    );
    // A column that is in no file is found when all were read.
    let selection = Selection {
        attributes: "depth".parse().unwrap(),
        ..Selection::default()
    };
    let refused = ingest_selected(&[path], &selection, &bench.workspace).err();
    let said = refused.unwrap().to_string();
    assert!(
        said.contains("depth") && said.contains("intensity"),
        "{said}"
    );
}
