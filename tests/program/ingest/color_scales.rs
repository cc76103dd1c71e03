//! The scale of colours is that of each file: its depth, the limits that it gives, and mixtures of these.

use crate::ingest::bench::Bench;
use crate::ingest::columns::{read, rows};
use crate::ingest::formats::e57::{Scan, cartesian, edited};
use e57::{Record, RecordDataType, RecordName, RecordValue};
use outcrop_formats::ingest_selected;
use outcrop_points::{Depth, Selection};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

type Color = [u8; 3];

/// A way to write colours of 8 bits.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// LAS, times this.
    Las(u16),
    /// PLY with this type, times this.
    Ply(&'static str, f64),
    /// Text with names, times this.
    Text(f64),
    /// E57 with whole numbers up to this, and limits up to that.
    E57(i64, Option<&'static str>),
    /// E57 with floating-point numbers up to this.
    Floats(f64),
}

const WAYS: [Way; 18] = [
    Way::Las(1),
    Way::Las(256),
    Way::Las(257),
    Way::Ply("uchar", 1.0),
    Way::Ply("ushort", 1.0),
    Way::Ply("ushort", 256.0),
    Way::Ply("ushort", 257.0),
    Way::Ply("float", 1.0),
    Way::Ply("float", 1.0 / 255.0),
    Way::Ply("double", 1.0 / 255.0),
    Way::Text(1.0),
    Way::Text(257.0),
    Way::E57(255, None),
    Way::E57(1023, None),
    Way::E57(65535, Some("4095")),
    Way::E57(65535, Some("65535")),
    Way::Floats(1.0),
    Way::Floats(100.0),
];

fn las(path: &Path, at: f64, colors: &[[u16; 3]]) {
    let mut builder = las::Builder::from((1, 2));
    builder.point_format = las::point::Format::new(2).unwrap();
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for (i, [r, g, b]) in colors.iter().enumerate() {
        let point = las::Point {
            x: at + i as f64,
            color: Some(las::Color::new(*r, *g, *b)),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

const COLORS: [RecordName; 3] = [
    RecordName::ColorRed,
    RecordName::ColorGreen,
    RecordName::ColorBlue,
];

/// A scan with colours of a type.
fn scan(at: f64, kind: &RecordDataType, colors: impl Iterator<Item = [RecordValue; 3]>) -> Scan {
    let colors: Vec<_> = colors.collect();
    let points: Vec<[f64; 3]> = (0..colors.len())
        .map(|i| [at + i as f64, 0.0, 0.0])
        .collect();
    let mut scan = cartesian(&RecordDataType::F64, &points);
    scan.fields.extend(COLORS.map(|name| Record {
        name,
        data_type: kind.clone(),
    }));
    let rows = scan.rows.iter_mut().zip(colors);
    rows.for_each(|(row, color)| row.extend(color));
    scan
}

/// A file of whole numbers up to `most`, and limits.
fn whole(
    bench: &Bench,
    name: &str,
    at: f64,
    most: i64,
    limit: Option<&str>,
    c: &[Color],
) -> PathBuf {
    let reach = limit.map_or(most, |limit| limit.parse().unwrap());
    let of = |c: u8| RecordValue::Integer((i64::from(c) * reach + 127) / 255);
    let kind = RecordDataType::Integer { min: 0, max: most };
    let scan = scan(at, &kind, c.iter().map(|c| c.map(of)));
    edited(bench, name, &[scan], |xml| {
        limited(&without_limits(&xml), "Integer", limit)
    })
}

/// A description without limits of colours.
fn without_limits(xml: &str) -> String {
    let mut rest = xml;
    let mut all = String::new();
    while let Some((before, after)) = rest.split_once("<colorLimits") {
        all += before;
        rest = after.split_once("</colorLimits>").unwrap().1;
    }
    all + rest
}

/// A description with limits from 0 on, if any, before the points of each scan.
fn limited(xml: &str, kind: &str, most: Option<&str>) -> String {
    let Some(most) = most else {
        return xml.to_owned();
    };
    let limits: String = ["Red", "Green", "Blue"]
        .map(|c| {
            format!(
                "<color{c}Minimum type=\"{kind}\"/><color{c}Maximum type=\"{kind}\">{most}</color{c}Maximum>"
            )
        })
        .concat();
    let limits = format!("<colorLimits type=\"Structure\">{limits}</colorLimits><points ");
    xml.replace("<points ", &limits)
}

impl Way {
    fn write(self, bench: &Bench, number: usize, colors: &[Color]) -> PathBuf {
        let at = number as f64 * 1000.0;
        let name = |kind: &str| format!("{number}.{kind}");
        let line = |(i, c): (usize, &Color), factor: f64, between: char| {
            let c = c.map(|c| (f64::from(c) * factor).to_string());
            let x = at + i as f64;
            format!("{x}_0_0_{}_{}_{}\n", c[0], c[1], c[2]).replace('_', &between.to_string())
        };
        let lines = |factor, between| -> String {
            let lines = colors.iter().enumerate();
            lines.map(|row| line(row, factor, between)).collect()
        };
        match self {
            Self::Las(factor) => {
                let path = bench.path(&name("las"));
                let all = colors.iter().map(|c| c.map(|c| u16::from(c) * factor));
                las(&path, at, &all.collect::<Vec<_>>());
                path
            }
            Self::Ply(kind, factor) => {
                let names = ["red", "green", "blue"].map(|c| format!("property {kind} {c}\n"));
                let head = format!(
                    "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
                     property float z\n{}end_header\n",
                    colors.len(),
                    names.concat()
                );
                bench.write(&name("ply"), head + &lines(factor, ' '))
            }
            Self::Text(factor) => bench.write(
                &name("csv"),
                "X,Y,Z,R,G,B\n".to_owned() + &lines(factor, ','),
            ),
            Self::E57(most, limit) => whole(bench, &name("e57"), at, most, limit, colors),
            Self::Floats(most) => {
                let of = |c: u8| RecordValue::Double(f64::from(c) * most / 255.0);
                let scan = scan(at, &RecordDataType::F64, colors.iter().map(|c| c.map(of)));
                let limit = most.to_string();
                edited(bench, &name("e57"), &[scan], |xml| {
                    limited(&without_limits(&xml), "Float", Some(&limit))
                })
            }
        }
    }
}

/// The colours of the points of all files, in the order of their positions; and what is said.
fn seen(bench: &Bench, files: &[PathBuf]) -> (Vec<Vec<f64>>, Vec<String>) {
    let (spool, carried) = read(bench, files, "color", false);
    let found = rows(bench, &spool, &carried);
    spool.release(&bench.workspace).unwrap();
    (
        found.into_iter().map(|row| row.1).collect(),
        carried.warnings,
    )
}

fn wanted(colors: &[Color]) -> Vec<Vec<f64>> {
    let one = |c: &Color| c.iter().map(|c| f64::from(*c)).collect();
    colors.iter().map(one).collect()
}

fn some(count: usize) -> Vec<Color> {
    (0..count)
        .map(|i| [(i * 7 % 256) as u8, 255 - (i % 200) as u8, 40])
        .collect()
}

#[test]
fn every_way_to_write_colours_gives_the_same() {
    let colors = some(300);
    for way in WAYS {
        let bench = Bench::new();
        let file = way.write(&bench, 0, &colors);
        assert_eq!(seen(&bench, &[file]).0, wanted(&colors), "{way:?}");
    }
}

#[test]
fn tiles_of_8_and_16_bits_are_alike_in_any_order() {
    let colors = some(250);
    let bench = Bench::new();
    let mut files: Vec<PathBuf> = [Way::Las(1), Way::Las(257), Way::Las(256)]
        .iter()
        .enumerate()
        .map(|(n, way)| way.write(&bench, n, &colors))
        .collect();
    let all = [&colors[..], &colors, &colors].concat();
    let (found, said) = seen(&bench, &files);
    assert_eq!(found, wanted(&all));
    assert_eq!(said, ["colours 8 bits in 1 file, 16 bits in 2 files"]);
    files.reverse();
    assert_eq!(seen(&bench, &files), (found, said));
}

#[test]
fn stray_points_of_16_bits_do_not_decide() {
    let colors = some(400);
    let bench = Bench::new();
    for (strays, kind) in [(1, "las"), (20, "laz")] {
        let mut wide: Vec<[u16; 3]> = colors.iter().map(|c| c.map(u16::from)).collect();
        let mut all = colors.clone();
        wide.extend(vec![[65535; 3]; strays]);
        all.extend(vec![[255; 3]; strays]);
        let path = bench.path(&format!("a.{kind}"));
        las(&path, 0.0, &wide);
        let (found, said) = seen(&bench, &[path]);
        assert_eq!(found, wanted(&all));
        assert_eq!(said.len(), 1);
        assert!(
            said[0].starts_with(&format!("colours 8 bits; {strays} point")),
            "{said:?}"
        );
    }
    // The other way round: black points say nothing, dark ones of 16 bits are few.
    let mut wide: Vec<[u16; 3]> = colors
        .iter()
        .map(|c| c.map(|c| u16::from(c) * 256 + 3))
        .collect();
    let mut all = colors.clone();
    wide.extend([[0; 3], [200, 3, 7], [0; 3]]);
    all.extend([[0; 3]; 3]);
    let path = bench.path("dark.las");
    las(&path, 0.0, &wide);
    assert_eq!(seen(&bench, &[path]).0, wanted(&all));
}

#[test]
fn limits_of_scans_that_differ_are_those_of_each() {
    let colors = some(200);
    let bench = Bench::new();
    let part = |at: f64, most: i64| {
        let of = |c: u8| RecordValue::Integer(i64::from(c) * (most + 1) / 256);
        let kind = RecordDataType::Integer { min: 0, max: most };
        scan(at, &kind, colors.iter().map(|c| c.map(of)))
    };
    let scans = [part(0.0, 255), part(1000.0, 1023), part(2000.0, 65535)];
    let file = edited(&bench, "a.e57", &scans, |xml| without_limits(&xml));
    let all = [&colors[..], &colors, &colors].concat();
    assert_eq!(seen(&bench, &[file]).0, wanted(&all));
    // A dark scan stays dark, for its limits say so.
    let kind = RecordDataType::Integer { min: 0, max: 65535 };
    let few = || (0..5).map(|_| [200; 3].map(RecordValue::Integer));
    for (limit, wanted) in [(Some("65535"), 0.0), (Some("255"), 200.0), (None, 200.0)] {
        let dark = edited(&bench, "b.e57", &[scan(0.0, &kind, few())], |xml| {
            limited(&without_limits(&xml), "Integer", limit)
        });
        assert_eq!(seen(&bench, &[dark]).0, [[wanted; 3]; 5], "{limit:?}");
    }
}

#[test]
fn the_scale_is_known_without_the_columns() {
    let colors = some(100);
    let selection = Selection {
        depths: true,
        ..Selection::default()
    };
    for (way, wanted) in [
        (Way::Las(1), Depth::Eight),
        (Way::Las(256), Depth::Sixteen),
        (Way::Ply("float", 1.0 / 255.0), Depth::One),
        (Way::Ply("uchar", 1.0), Depth::Eight),
        (Way::E57(1023, None), Depth::Given),
        (Way::E57(65535, None), Depth::Sixteen),
        (Way::Floats(1.0), Depth::One),
    ] {
        let bench = Bench::new();
        let file = way.write(&bench, 0, &colors);
        let spool = ingest_selected(&[file], &selection, &bench.workspace).unwrap();
        assert_eq!(spool.stats().files[0].colors, Some(wanted), "{way:?}");
        let carried = spool.carried(&"none".parse().unwrap(), false);
        assert!(carried.is_empty(), "{way:?}");
    }
    let bench = Bench::new();
    let plain = bench.write("a.xyz", "1 2 3\n4 5 6\n");
    let spool = ingest_selected(&[plain], &selection, &bench.workspace).unwrap();
    assert_eq!(spool.stats().files[0].colors, None);
}

#[test]
fn coefficients_of_splats_are_colours() {
    let bench = Bench::new();
    let names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names
        .split(' ')
        .map(|n| format!("property float {n}\n"))
        .collect();
    let points: Vec<[f32; 3]> = vec![[0.0, 1.0, -1.0], [1.7, -1.8, 40.0], [-9.0, 0.5, f32::NAN]];
    let value = |name: &str, i: usize| match name {
        "x" => i as f32,
        "f_dc_0" => points[i][0],
        "f_dc_1" => points[i][1],
        "f_dc_2" => points[i][2],
        _ => 0.25,
    };
    let all = [[128, 199, 56], [250, 0, 255], [0, 163, 0]];
    for body in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for list in [false, true] {
            let list = if list {
                "property list uchar int more\n"
            } else {
                ""
            };
            let mut bytes =
                format!("ply\nformat {body} 1.0\nelement vertex 3\n{list}{properties}end_header\n")
                    .into_bytes();
            for i in 0..3 {
                if !list.is_empty() {
                    bytes.extend(if body == "ascii" { b"0 " } else { &b"\0"[..] });
                }
                for name in names.split(' ') {
                    let value = value(name, i);
                    bytes.extend(match body {
                        "ascii" => format!("{value} ").into_bytes(),
                        "binary_little_endian" => value.to_le_bytes().into(),
                        _ => value.to_be_bytes().into(),
                    });
                }
                bytes.extend((body == "ascii").then_some(b'\n'));
            }
            let path = bench.write("a.ply", bytes);
            let (found, said) = seen(&bench, std::slice::from_ref(&path));
            assert_eq!(found, wanted(&all), "{body} {list}");
            assert_eq!(said, [""; 0]);
            let spool = bench.read(&[path]).unwrap();
            let said = &spool.stats().warnings[0];
            assert!(
                said.contains("; drop_outliers leaves out floaters"),
                "{said}"
            );
            assert_eq!(spool.stats().files[0].colors, Some(Depth::One));
            spool.release(&bench.workspace).unwrap();
        }
    }
    // With colours of their own they are these.
    let own =
        properties.clone() + "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let head = format!("ply\nformat ascii 1.0\nelement vertex 1\n{own}end_header\n");
    let path = bench.write("own.ply", head + &"0.5 ".repeat(18) + "7 8 9\n");
    assert_eq!(seen(&bench, &[path]).0, [[7.0, 8.0, 9.0]]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Depth × limits × mixtures: files in any ways, in any order, have the colours that were written.
    #[test]
    fn mixtures_of_files_have_their_colours(
        ways in prop::collection::vec(prop::sample::select(WAYS.to_vec()), 1..5),
        colors in prop::collection::vec(prop::array::uniform3(2u8..), 30..90),
        turn in 0usize..5,
    ) {
        let bench = Bench::new();
        let write = |(number, way): (usize, &Way)| way.write(&bench, number, &colors);
        let mut files: Vec<PathBuf> = ways.iter().enumerate().map(write).collect();
        let turn = turn % files.len();
        files.rotate_left(turn);
        let all = vec![colors.clone(); ways.len()].concat();
        let (found, said) = seen(&bench, &files);
        prop_assert_eq!(found, wanted(&all));
        prop_assert!(said.len() <= 1, "{:?}", said);
    }
}
