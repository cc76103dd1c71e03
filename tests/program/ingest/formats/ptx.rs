//! PTX.

use crate::ingest::bench::Bench;
use std::fmt::Write as _;
use std::path::PathBuf;

/// A scan with this number of columns and rows, a scanner at `origin`, axes in rows, and these lines.
pub fn scan(shape: [usize; 2], origin: [f64; 3], axes: [[f64; 3]; 3], lines: &[String]) -> String {
    let mut text = format!("{}\n{}\n", shape[0], shape[1]);
    let row = |p: [f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
    writeln!(text, "{}", row(origin)).unwrap();
    axes.iter()
        .for_each(|axis| writeln!(text, "{}", row(*axis)).unwrap());
    axes.iter()
        .for_each(|axis| writeln!(text, "{} 0", row(*axis)).unwrap());
    writeln!(text, "{} 1", row(origin)).unwrap();
    lines
        .iter()
        .for_each(|line| writeln!(text, "{line}").unwrap());
    text
}

pub const UNIT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn lines(count: usize, more: &str) -> Vec<String> {
    let line = |i: usize| format!("{}.5 {} -{}.25{more}", i, i % 7, i % 3);
    (1..=count).map(line).collect()
}

/// Two scans of 12 and 10 points.
fn two() -> String {
    scan([3, 4], [0.0; 3], UNIT, &lines(12, " 0.5"))
        + &scan([5, 2], [100.0, -50.0, 3.5], UNIT, &lines(10, " 0.5 1 2 3"))
}

pub fn scans(bench: &Bench) -> Vec<PathBuf> {
    let one = scan([2, 3], [0.0; 3], UNIT, &lines(6, ""));
    vec![
        bench.write("one.ptx", &one),
        bench.write("two.ptx", two()),
        bench.write("crlf.ptx", two().replace('\n', "\r\n")),
        bench.write("cr", two().replace('\n', "\r")),
        bench.write("end.ptx", two().trim_end()),
    ]
}

pub fn empty(bench: &Bench) -> Vec<PathBuf> {
    let none = scan([0, 3], [1.0; 3], UNIT, &[]);
    let mut some = lines(6, " 0.5");
    some[1] = "0 0 0 0.5".into();
    some[5] = "0.000 -0.0 0 0.5 0 0 0".into();
    let some = scan([3, 2], [1.0; 3], UNIT, &some);
    vec![
        bench.write("a.ptx", &some),
        bench.write("b.ptx", none.clone() + &some + &none),
    ]
}

pub fn cut(bench: &Bench) -> Vec<PathBuf> {
    let text = two();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.pop();
    vec![
        bench.write("a.ptx", lines.join("\n")),
        bench.write("b.ptx", lines[..15].join("\n")),
        bench.write(
            "c.ptx",
            text.replacen("3\n4\n", "4000000000\n4000000000\n", 1),
        ),
    ]
}

pub fn no_header(bench: &Bench) -> Vec<PathBuf> {
    let text = two();
    let lines: Vec<&str> = text.lines().collect();
    vec![
        // A point too many and too few, a header that is cut off, a number of columns that is none.
        bench.write("a.ptx", text.replacen("3\n4\n", "3\n3\n", 1)),
        bench.write("e.ptx", text.replacen("3\n4\n", "4\n5\n", 1)),
        bench.write("b.ptx", lines[..25].join("\n")),
        bench.write("c.ptx", text.replace("5\n2\n", "5.5\n2\n")),
        bench.write("d.ptx", text.replace("100 -50 3.5 1", "inf -50 3.5 1")),
    ]
}

pub fn columns(bench: &Bench) -> Vec<PathBuf> {
    let text = two().replace("1 0 0 0\n", "1 0 0 7\n");
    vec![bench.write("a.ptx", text)]
}

pub fn bad_line(bench: &Bench) -> Vec<PathBuf> {
    vec![
        bench.write(
            "a.ptx",
            two()
                .replacen("3.5 3 -0.25", "3.5 3", 1)
                .replace("3.5 3 0.5", "3.5 three 1 0.5"),
        ),
        bench.write("b.ptx", two().replacen("3.5 3 -0.25 0.5\n", "3.5 3\n", 1)),
    ]
}
