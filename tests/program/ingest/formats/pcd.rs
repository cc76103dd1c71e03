//! PCD.

use crate::ingest::bench::{Bench, cloud};
use std::fmt::Write as _;
use std::path::PathBuf;

pub const BODIES: [&str; 3] = ["ascii", "binary", "binary_compressed"];
const KINDS: [(&str, &str); 10] = [
    ("F", "4"),
    ("F", "8"),
    ("I", "1"),
    ("I", "2"),
    ("I", "4"),
    ("I", "8"),
    ("U", "1"),
    ("U", "2"),
    ("U", "4"),
    ("U", "8"),
];

fn number((letter, size): (&str, &str), value: f64) -> Vec<u8> {
    match (letter, size) {
        ("F", "4") => (value as f32).to_le_bytes().to_vec(),
        ("F", _) => value.to_le_bytes().to_vec(),
        // Two's complement: the lowest bytes of the widest type.
        _ => (value as i128).to_le_bytes()[..size.parse().unwrap()].to_vec(),
    }
}

/// Sequences of bytes as they are, and copies of what is one, two or 8192 bytes before.
fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let same = |back: usize| {
            let limit = (bytes.len() - at).min(264);
            let equal = (0..limit).take_while(|i| bytes[at + i] == bytes[at + i - back]);
            (equal.count(), back)
        };
        let all = [1, 2, 4, 8192].into_iter().filter(|back| *back <= at);
        let (count, back) = all.map(same).max().unwrap_or((0, 1));
        if count >= 3 {
            let (more, low) = (count - 2, back - 1);
            packed.push((more.min(7) as u8) << 5 | (low >> 8) as u8);
            packed.extend((more >= 7).then(|| (more - 7) as u8));
            packed.push(low as u8);
            at += count;
        } else {
            let count = (bytes.len() - at).min(2);
            packed.push(count as u8 - 1);
            packed.extend_from_slice(&bytes[at..at + count]);
            at += count;
        }
    }
    packed
}

/// The body of a compressed file.
pub fn compressed(content: &[u8]) -> Vec<u8> {
    let packed = pack(content);
    let sizes = [packed.len(), content.len()].map(|size| (size as u32).to_le_bytes());
    [&sizes.concat()[..], &packed].concat()
}

/// A file with other fields between the coordinates.
pub fn file(body: &str, kind: (&str, &str), points: &[[f64; 3]]) -> Vec<u8> {
    let (letter, size) = kind;
    let count = points.len();
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS histogram z _ x rgb y\n\
         SIZE 1 {size} 1 {size} 4 {size}\nTYPE U {letter} U {letter} F {letter}\nCOUNT 3 1 2 1 1 1\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 1 2 3 0.5 0.5 0.5 0.5\nPOINTS {count}\nDATA {body}\n"
    );
    let mut out = header.into_bytes();
    if body == "ascii" {
        let mut text = String::new();
        for [x, y, z] in points {
            writeln!(text, "1 2 3 {z} 0 0 {x} 4.2108e+06 {y}").unwrap();
        }
        out.extend_from_slice(text.as_bytes());
        return out;
    }
    let field = |axis: usize| points.iter().map(|p| number(kind, p[axis])).collect();
    let same = |bytes: &[u8]| vec![bytes.to_vec(); count];
    let fields: [Vec<Vec<u8>>; 6] = [
        same(&[1, 2, 3]),
        field(2),
        same(&[0, 0]),
        field(0),
        same(&[9, 8, 7, 0]),
        field(1),
    ];
    if body == "binary" {
        for row in 0..count {
            fields.iter().for_each(|field| out.extend(&field[row]));
        }
    } else {
        // The library that made the format leaves padding out.
        let wanted = fields.iter().enumerate().filter(|(number, _)| *number != 2);
        let content: Vec<u8> = wanted.flat_map(|(_, field)| field.concat()).collect();
        out.extend(compressed(&content));
    }
    out
}

fn points() -> Vec<[f64; 3]> {
    cloud(100, 4).iter().map(|p| p.map(f64::from)).collect()
}

pub fn bodies(bench: &Bench) -> Vec<PathBuf> {
    BODIES
        .map(|body| bench.write(&format!("{body}.pcd"), file(body, ("F", "4"), &points())))
        .into()
}

pub fn types(bench: &Bench) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for body in BODIES {
        for kind in KINDS {
            let name = format!("{body}-{}{}", kind.0, kind.1);
            let points = [[1.0, 2.0, 3.0], [4.0, 5.0, 100.0]];
            files.push(bench.write(&name, file(body, kind, &points)));
        }
    }
    files
}

/// A text file with another header.
pub fn header(bench: &Bench, from: &str, to: &str) -> PathBuf {
    let text = String::from_utf8(file("ascii", ("F", "4"), &[[1.0; 3]; 2])).unwrap();
    assert!(text.contains(from));
    let number = std::fs::read_dir(bench.path("")).unwrap().count();
    bench.write(&format!("{number}.pcd"), text.replace(from, to))
}

pub fn headers(bench: &Bench) -> Vec<PathBuf> {
    vec![
        header(bench, "VERSION 0.7\nFIELDS", "COLUMNS"),
        header(bench, "VIEWPOINT 1 2 3 0.5 0.5 0.5 0.5\nPOINTS 2\n", ""),
        header(bench, "_ x rgb y", "_ X rgb Y"),
        header(bench, "\n", "\r\n"),
        bench.write(
            "short.pcd",
            "VERSION .5\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n1 2 3\n",
        ),
    ]
}

pub fn padded(bench: &Bench) -> Vec<PathBuf> {
    let head = "VERSION 0.7\nFIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\n\
                WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA";
    let with = compressed(&[0; 32]);
    let without = compressed(&[0; 24]);
    vec![
        bench.write(
            "a.pcd",
            [format!("{head} binary\n").into_bytes(), vec![0; 32]].concat(),
        ),
        bench.write(
            "b.pcd",
            [format!("{head} binary_compressed\n").into_bytes(), with].concat(),
        ),
        bench.write(
            "c.pcd",
            [format!("{head} binary_compressed\n").into_bytes(), without].concat(),
        ),
    ]
}

pub fn not_finite(bench: &Bench) -> Vec<PathBuf> {
    let points = [[f64::NAN; 3], [1.0, f64::INFINITY, 2.0], [1.0, 2.0, 3.0]];
    BODIES
        .map(|body| bench.write(body, file(body, ("F", "4"), &points)))
        .into()
}

pub fn separators(bench: &Bench) -> Vec<PathBuf> {
    [("2 3 1", "2\t3\t1"), ("2 3 1", "2,3,1")]
        .map(|(from, to)| header(bench, from, to))
        .into()
}

pub fn cut(bench: &Bench, body: &str) -> Vec<PathBuf> {
    let bytes = file(body, ("F", "4"), &points());
    let cut = |left: usize| bench.write(&format!("{left}.pcd"), &bytes[..bytes.len() - left]);
    let end = bytes.iter().rposition(|b| *b == b'\n').unwrap();
    match body {
        // A whole line.
        "ascii" => vec![cut(bytes.len()
            - 1
            - bytes[..end].iter().rposition(|b| *b == b'\n').unwrap())],
        _ => vec![cut(1), cut(100)],
    }
}

/// Files with these compressed data, and two points.
fn with_data(bench: &Bench, data: &[u8], content: u32) -> PathBuf {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary_compressed\n";
    let sizes = [data.len() as u32, content].map(u32::to_le_bytes).concat();
    let number = std::fs::read_dir(bench.path("")).unwrap().count();
    let bytes = [head.as_bytes(), &sizes, data].concat();
    bench.write(&format!("{number}.pcd"), bytes)
}

pub fn damaged(bench: &Bench) -> Vec<PathBuf> {
    vec![
        // A copy from before the start, data that end inside a copy, too little content.
        with_data(bench, &[0, 1, 0xe0, 200, 9], 24),
        with_data(bench, &[0, 1, 0xe0, 200], 24),
        with_data(bench, &[11, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], 24),
    ]
}

pub fn other_sizes(bench: &Bench) -> Vec<PathBuf> {
    [0, 23, 36]
        .map(|content| with_data(bench, &[11; 12], content))
        .into()
}

pub fn bombs(bench: &Bench) -> Vec<PathBuf> {
    vec![with_data(bench, &[11; 12], u32::MAX)]
}

pub fn no_z(bench: &Bench) -> Vec<PathBuf> {
    vec![header(bench, "histogram z", "histogram w")]
}

pub fn twice(bench: &Bench) -> Vec<PathBuf> {
    vec![
        header(bench, "x rgb y", "x x y"),
        header(bench, "COUNT 3 1", "COUNT 3 2"),
    ]
}

pub fn unknown(bench: &Bench) -> Vec<PathBuf> {
    vec![
        header(bench, "TYPE U F", "TYPE U Q"),
        header(bench, "SIZE 1 4", "SIZE 1 2"),
        header(bench, "SIZE 1 4", "SIZE 4"),
        header(bench, "COUNT 3", "COUNT three"),
        header(bench, "POINTS 2", "POINTS -2"),
        header(bench, "DATA ascii", "DATA zip"),
    ]
}

pub fn other_case(bench: &Bench) -> Vec<PathBuf> {
    let lower = "FIELDS x y z rgb\nSIZE 4 8 4 4\nTYPE f i f u\nPOINTS 1\nDATA ";
    let point = [
        &1f32.to_le_bytes()[..],
        &2i64.to_le_bytes(),
        &3f32.to_le_bytes(),
        &[0; 4],
    ];
    let binary = |head: String| [head.as_bytes(), &point.concat()].concat();
    vec![
        bench.write("a.pcd", format!("{lower}ascii\n1 2 3 0\n")),
        bench.write("b.pcd", binary(format!("{lower}binary\n"))),
        bench.write(
            "c.pcd",
            format!("{}ASCII\n1 2 3 0\n", lower.to_ascii_uppercase()),
        ),
        bench.write("d.pcd", binary(format!("{lower}Binary\n"))),
    ]
}

pub fn endless(bench: &Bench) -> Vec<PathBuf> {
    let start = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n";
    vec![
        bench.write("cut.pcd", start),
        bench.write(
            "flood.pcd",
            start.to_owned() + &"# and no end\n".repeat(100_000),
        ),
    ]
}
