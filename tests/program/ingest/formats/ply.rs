//! PLY.

use crate::ingest::bench::{Bench, cloud, ply};
use std::path::PathBuf;

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const BODIES: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

fn points() -> Vec<[f64; 3]> {
    cloud(100, 4).iter().map(|p| p.map(f64::from)).collect()
}

fn made(bench: &Bench, kinds: &[&str], list: bool) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for body in BODIES {
        for kind in kinds {
            let bytes = ply(body, kind, list, &points());
            files.push(bench.write(&format!("{body}-{kind}.ply"), bytes));
        }
    }
    files
}

pub fn bodies(bench: &Bench) -> Vec<PathBuf> {
    made(bench, &["float"], false)
}

pub fn types(bench: &Bench) -> Vec<PathBuf> {
    made(bench, &["float", "double", "int"], false)
}

pub fn lists(bench: &Bench) -> Vec<PathBuf> {
    made(bench, &["double"], true)
}

/// An origin in comments, in all bodies.
pub fn origins(bench: &Bench) -> Vec<PathBuf> {
    let mut files = lists(bench);
    files.extend(bodies(bench));
    for path in &files {
        let bytes = std::fs::read(path).unwrap();
        let line = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
        let (first, rest) = bytes.split_at(line);
        let comments =
            b"comment offsetx 5e5\ncomment offsety 4e6\ncomment offsetz 0\ncomment epsg 25832\n";
        std::fs::write(path, [first, comments, rest].concat()).unwrap();
    }
    files
}

pub fn splats(bench: &Bench) -> Vec<PathBuf> {
    let names = "f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let more: String = names
        .split(' ')
        .map(|n| format!("property float {n}\n"))
        .collect();
    let head = format!("ply\nformat ascii 1.0\nelement vertex 1\n{XYZ}{more}end_header\n");
    vec![bench.write("a.ply", head + &"0.5 ".repeat(14) + "\n")]
}

/// A text file with this number of vertices in its header.
pub fn text(count: &str, body: &str) -> String {
    format!("ply\nformat ascii 1.0\nelement vertex {count}\n{XYZ}end_header\n{body}")
}

pub fn counted(bench: &Bench, count: &str, body: &str) -> Vec<PathBuf> {
    vec![bench.write(&format!("{count}.ply"), text(count, body))]
}

/// A text file with these elements.
pub fn header(bench: &Bench, elements: &str, body: &str) -> Vec<PathBuf> {
    let text = format!("ply\nformat ascii 1.0\n{elements}end_header\n{body}");
    vec![bench.write("header.ply", text)]
}

pub fn line_ends(bench: &Bench) -> Vec<PathBuf> {
    let text = text("2", "1 2 3\n4 5 6\n");
    let ends = ["\n", "\r\n", "\r"].into_iter().enumerate();
    ends.map(|(number, end)| bench.write(&format!("{number}.ply"), text.replace('\n', end)))
        .collect()
}

pub fn not_finite(bench: &Bench) -> Vec<PathBuf> {
    counted(bench, "4", "nan 1 2\n1 -inf 3\n1e999 0 0\n1 2 3\n")
}

pub fn twice(bench: &Bench) -> Vec<PathBuf> {
    let vertex = format!("element vertex 1\n{XYZ}");
    let elements = header(bench, &format!("{vertex}{vertex}"), "1 2 3\n1 2 3\n");
    std::fs::rename(&elements[0], bench.path("two.ply")).unwrap();
    let properties = header(bench, &format!("{vertex}property float x\n"), "1 2 3 4\n");
    vec![bench.path("two.ply"), properties[0].clone()]
}

pub fn bad_counts(bench: &Bench) -> Vec<PathBuf> {
    let counts = ["-1", "18446744073709551616"];
    counts
        .iter()
        .flat_map(|count| counted(bench, count, "1 2 3\n"))
        .collect()
}

pub fn short_binary(bench: &Bench) -> Vec<PathBuf> {
    let file = |count: &str, bytes: usize| {
        let head = text(count, "").replace("ascii", "binary_little_endian");
        bench.write(
            &format!("{count}.ply"),
            [head.as_bytes(), &vec![0; bytes]].concat(),
        )
    };
    vec![file("4", 47), file("9223372036854775808", 120)]
}

pub fn long_list(bench: &Bench) -> Vec<PathBuf> {
    let elements = format!("element a 1\nproperty list uint double b\nelement vertex 1\n{XYZ}");
    let head = format!("ply\nformat binary_little_endian 1.0\n{elements}end_header\n");
    vec![bench.write("a.ply", [head.as_bytes(), &[0xff; 40]].concat())]
}

pub fn endless_header(bench: &Bench) -> Vec<PathBuf> {
    let start = "ply\nformat ascii 1.0\n";
    let flood = "comment and no end\n".repeat(100_000);
    vec![
        bench.write("cut.ply", start),
        bench.write("flood.ply", start.to_owned() + &flood),
        bench.write("line.ply", start.to_owned() + &"x".repeat(2 << 20)),
    ]
}

pub fn unknown(bench: &Bench) -> Vec<PathBuf> {
    let text = text("1", "1 2 3\n");
    vec![
        bench.write("type.ply", text.replace("float x", "quad x")),
        bench.write("line.ply", text.replace("element", "elements")),
        bench.write("body.ply", text.replace("ascii", "words")),
    ]
}
