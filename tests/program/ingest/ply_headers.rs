//! PLY headers with wrong counts, repetitions or without an end, and their outcomes.

use crate::ingest::bench::Bench;
use std::fs::File;
use std::io::Write as _;

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

fn header(body: &str, elements: &str) -> String {
    format!("ply\nformat {body} 1.0\n{elements}end_header\n")
}

/// Checks that a file with this header and body is refused with these words.
fn refused(bench: &Bench, header: &str, body: &[u8], words: &[&str]) {
    let bytes = [header.as_bytes(), body].concat();
    let error = bench.error(bench.write("bad.ply", bytes));
    assert_eq!(error.lines().count(), 1, "{error}");
    for word in ["bad.ply: ", ": found ", ", expected "].iter().chain(words) {
        assert!(error.contains(word), "no {word:?} in {error}");
    }
}

#[test]
fn counts_that_no_file_holds() {
    let bench = Bench::new();
    let points = [0u8; 36];
    for count in [4, 1 << 31, 1 << 32, 1 << 63, u64::MAX] {
        let elements = format!("element vertex {count}\n{XYZ}");
        let words = [
            &*format!("{count} vertices"),
            "at most the 3 records of 12 bytes",
        ];
        refused(
            &bench,
            &header("binary_little_endian", &elements),
            &points,
            &words,
        );
        let words = [
            "vertex 2 at byte",
            "the end of the file",
            &*format!("{count} lines"),
        ];
        refused(
            &bench,
            &header("ascii", &elements),
            b"1 2 3\n4 5 6\n",
            &words,
        );
        // Elements before the vertices, of fixed and of variable size.
        let before = format!("element a {count}\nproperty double b\nelement vertex 1\n{XYZ}");
        let words = ["element a at byte", &*format!("{count} records of 8 bytes")];
        refused(
            &bench,
            &header("binary_big_endian", &before),
            &points[..24],
            &words,
        );
        let lists = before.replace("property double b", "property list uchar int b");
        let words = ["a 36 at byte", "the end of the file"];
        if count > 36 {
            refused(
                &bench,
                &header("binary_big_endian", &lists),
                &points,
                &words,
            );
        }
    }
    for count in [
        "18446744073709551616",
        "-1",
        "-9223372036854775808",
        "1e3",
        "3.0",
        "x",
        "٣",
    ] {
        let elements = format!("element vertex {count}\n{XYZ}");
        let words = ["line 3", &*format!("element vertex {count}"), "0 or more"];
        refused(&bench, &header("ascii", &elements), b"1 2 3\n", &words);
    }
    // Elements without properties take no time, whatever their number: there is nothing to read.
    let nothing = format!("element a {}\nelement vertex 1\n{XYZ}", u64::MAX);
    let path = bench.write(
        "nothing.ply",
        [
            header("binary_big_endian", &nothing).as_bytes(),
            &points[..12],
        ]
        .concat(),
    );
    assert_eq!(bench.read(&[path]).unwrap().points(), 1);
}

#[test]
fn lists_of_absurd_length() {
    let bench = Bench::new();
    for (count, bytes) in [
        ("uint", u32::MAX.to_le_bytes()),
        ("int", i32::MAX.to_le_bytes()),
        ("int", (-1i32).to_le_bytes()),
    ] {
        let before =
            format!("element a 1\nproperty list {count} double b\nelement vertex 1\n{XYZ}");
        let found = match i32::from_le_bytes(bytes) {
            -1 if count == "int" => "a list of -1 items",
            _ => "the end of the file",
        };
        let body = [&bytes[..], &[0; 12]].concat();
        refused(
            &bench,
            &header("binary_little_endian", &before),
            &body,
            &["a 0 at byte", found],
        );
        let among = format!("element vertex 1\nproperty list {count} double b\n{XYZ}");
        refused(
            &bench,
            &header("binary_little_endian", &among),
            &body,
            &["vertex 0 at byte", found],
        );
    }
    for length in ["99999999999999999999", "1e300", "-3", "1.5", "nan", "7"] {
        let among = format!("element vertex 1\nproperty list uchar int b\n{XYZ}");
        let body = format!("{length} 1 2 3\n");
        let words = ["vertex 0", "expected 4 numbers"];
        refused(&bench, &header("ascii", &among), body.as_bytes(), &words);
    }
    for kind in ["float", "double", "quad"] {
        let among = format!("element vertex 1\nproperty list {kind} int b\n{XYZ}");
        refused(
            &bench,
            &header("ascii", &among),
            b"0 1 2 3\n",
            &["line 4", "an integer type"],
        );
    }
}

#[test]
fn headers_that_do_not_end() {
    let bench = Bench::new();
    let start = header("ascii", &format!("element vertex 1\n{XYZ}")).replace("end_header\n", "");
    refused(&bench, &start, b"", &["the end of the file", "end_header"]);
    refused(
        &bench,
        &start,
        b"end_heade",
        &["the end of the file", "end_header"],
    );
    let flood = "comment nothing to see here\n".repeat(50_000);
    refused(
        &bench,
        &start,
        flood.as_bytes(),
        &["no end in 1 MiB", "end_header"],
    );
    let some = "comment nothing to see here\n".repeat(20_000);
    let path = bench.write("comments.ply", format!("{start}{some}end_header\n1 2 3\n"));
    assert_eq!(bench.read(&[path]).unwrap().points(), 1);
    let endless = format!("{start}comment {}", "x".repeat(3 << 20));
    refused(&bench, &endless, b"", &["no end in 1 MiB", "end_header"]);
    // A large file is not searched for the end of the header.
    let path = bench.path("large.ply");
    let mut file = File::create(&path).unwrap();
    file.write_all(start.as_bytes()).unwrap();
    file.set_len(5 << 30).unwrap();
    let error = bench.error(path);
    assert!(error.contains("no end in 1 MiB"), "{error}");
}

#[test]
fn headers_that_repeat_or_leave_out() {
    let bench = Bench::new();
    let vertex = format!("element vertex 1\n{XYZ}");
    let body = b"1 2 3\n1 2 3\n";
    for (elements, words) in [
        (
            format!("{vertex}{vertex}"),
            ["2 elements named vertex", "expected one"],
        ),
        (
            format!("{vertex}property float x\n"),
            ["2 properties named x", "expected one"],
        ),
        (
            vertex.replace("property float y\n", ""),
            ["no property y", "x, y and z"],
        ),
        (
            vertex.replace("float y", "list uchar float y"),
            ["\"y\"", "not a list"],
        ),
        (
            format!("property float x\n{vertex}"),
            ["line 3", "an element before its properties"],
        ),
        (
            vertex.replace("float z", "quad z"),
            ["line 6", "a type such as float"],
        ),
        (format!("{vertex}elements 3\n"), ["line 7", "end_header"]),
        (
            format!("{vertex}property float\n"),
            ["line 7", "end_header"],
        ),
    ] {
        refused(&bench, &header("ascii", &elements), body, &words);
    }
    refused(
        &bench,
        &format!("ply\n{vertex}end_header\n"),
        body,
        &["end_header", "a line \"format\" before it"],
    );
    refused(
        &bench,
        &header("binary_middle_endian", &vertex),
        body,
        &["line 2", "ascii or binary_"],
    );
    let none = bench.write(
        "none.ply",
        header("ascii", "element face 0\nproperty int a\n"),
    );
    let spool = bench.read(&[none]).unwrap();
    assert!(spool.stats().warnings[0].contains("no element \"vertex\""));
}

#[test]
fn line_ends_tabs_and_blanks_do_not_matter() {
    let bench = Bench::new();
    let lists = "element camera 2\nproperty list uchar int ids\n";
    let text = header("ascii", &format!("{lists}element vertex 2\n{XYZ}"))
        + "2 7 8\n0\n1 2 3\n\n  4\t5\t6  \n";
    for text in [
        text.clone(),
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        text.replace(' ', "\t"),
        text.replace("element", "  element"),
        text.trim_end().to_owned(),
    ] {
        let path = bench.write("a.ply", &text);
        assert_eq!(bench.read(&[path]).unwrap().points(), 2, "{text:?}");
    }
}
