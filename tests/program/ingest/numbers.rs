//! Unusual text and numbers, and their outcomes.

use crate::ingest::bench::{Bench, positions};
use outcrop::Error;
use outcrop_points::Spool;
use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;

const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\n\
                      property double y\nproperty double z\nend_header\n";

/// The lines as text and as the body of a PLY file.
fn both(bench: &Bench, lines: &str) -> [PathBuf; 2] {
    [
        bench.write("a.xyz", lines),
        bench.write("a.ply", format!("{HEADER}{lines}")),
    ]
}

/// Numbers of points left out and kept.
fn counts(spool: &Spool) -> (u64, u64) {
    (spool.stats().dropped_non_finite, spool.points())
}

fn bounds(spool: &Spool) -> [[f64; 3]; 2] {
    let file = &spool.stats().files[0];
    [file.min.unwrap(), file.max.unwrap()]
}

#[test]
fn numbers_beyond_all_bounds_are_left_out_and_counted() {
    let bench = Bench::new();
    let digits = "9".repeat(10_000);
    for number in [
        "1e999",
        "-1e999",
        "nan",
        "-nan",
        "NaN",
        "inf",
        "-Infinity",
        &digits,
    ] {
        let lines = format!("{number} 0 0\n1 2 3\n");
        for path in both(&bench, &lines) {
            let seen = bench.read(std::slice::from_ref(&path));
            match seen {
                Ok(spool) => assert_eq!(counts(&spool), (1, 1), "{number} in {path:?}"),
                // A sign before a word that is no number.
                Err(error) => assert!(number == "-nan" && error.to_string().contains("-nan")),
            }
        }
    }
}

#[test]
fn numbers_of_any_length_and_sign_are_read() {
    let bench = Bench::new();
    let long = format!("0.{}1", "0".repeat(10_000));
    let exact = format!("2.5{}", "0".repeat(10_000));
    for (number, value) in [
        ("-0", 0.0),
        ("-0.0e5", 0.0),
        ("1e-999", 0.0),
        (&long, 0.0),
        (&exact, 2.5),
        ("+2.5", 2.5),
        (".25e1", 2.5),
        ("2500000000e-9", 2.5),
    ] {
        let lines = format!("{number} {number} {number}\n1 2 3\n");
        for path in both(&bench, &lines) {
            let spool = bench.read(std::slice::from_ref(&path)).unwrap();
            assert_eq!(counts(&spool), (0, 2), "{path:?}");
            let low = [1.0, 2.0, 3.0].map(|c: f64| c.min(value));
            assert_eq!(bounds(&spool)[0], low, "{path:?}");
            let lattice = spool.choose_lattice(0).unwrap();
            assert!(lattice.exact, "{path:?}: {lattice:?}");
        }
    }
}

#[test]
fn the_largest_and_smallest_numbers_fit_one_lattice() {
    let bench = Bench::new();
    let spool = bench.read(&[bench.write("a.xyz", "1.7e308 5e-324 0\n-1.7e308 0 1\n")]);
    let spool = spool.unwrap();
    let lattice = spool.choose_lattice(10).unwrap();
    assert!(!lattice.exact && lattice.step.is_finite());
    assert_eq!(positions(&bench, &spool, &lattice)[0], [0, 0, 0]);
}

#[test]
fn a_decimal_comma_takes_numbers_of_sensible_length_only() {
    let bench = Bench::new();
    let text = format!("1,5;2;3\n2,5;2;3\n0,{};2;3\n", "1".repeat(100));
    let error = bench.error(bench.write("a.csv", text));
    assert!(error.contains("line 3: found \"0,111"), "{error}");
    assert!(error.len() < 300, "{error}");
}

#[test]
fn words_that_are_no_numbers_are_refused_with_the_line() {
    let bench = Bench::new();
    for word in [
        "0x10", "1_000", "1.2.3", "--1", "1e", "\u{663}", "1;2", "\u{0}",
    ] {
        let text = format!("1 2 3\n4 5 6\n7 8 9\n{word} 2 3\n");
        let error = bench.error(bench.write("a.xyz", &text));
        let said = error.contains("line 4: found") || error.contains("binary data");
        assert!(said && error.contains("expected"), "{word}: {error}");
        let error = bench.error(bench.write("a.ply", format!("{HEADER}1 2 3\n{word} 2 3\n")));
        assert!(
            error.contains("vertex 1") && error.contains("3 numbers"),
            "{error}"
        );
    }
}

#[test]
fn of_a_hundred_thousand_columns_the_first_three_count() {
    let bench = Bench::new();
    let more = " 7".repeat(100_000);
    let lines = format!("1 2 3{more}\n4 5 6{more}\n");
    for path in both(&bench, &lines) {
        let spool = bench.read(&[path]).unwrap();
        assert_eq!(bounds(&spool), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }
}

#[test]
fn a_line_of_a_million_columns_is_refused() {
    let bench = Bench::new();
    let lines = format!("1 2 3{}\n4 5 6\n", " 7".repeat(1_000_000));
    let [text, ply] = both(&bench, &lines);
    let error = bench.error(text);
    assert!(
        error.contains("no line end in the first 1048576 bytes"),
        "{error}"
    );
    let error = bench.error(ply);
    assert!(
        error.contains("vertex 0") && error.contains("a line of more than 1 MiB"),
        "{error}"
    );
}

/// A file of 4 GiB: `start`, then digits, then a hole in the file.
fn endless(bench: &Bench, name: &str, start: &str) -> PathBuf {
    let path = bench.path(name);
    let mut file = File::create(&path).unwrap();
    file.write_all(start.as_bytes()).unwrap();
    file.write_all("7".repeat(3 << 20).as_bytes()).unwrap();
    file.set_len(4 << 30).unwrap();
    path
}

#[test]
fn a_line_of_four_gigabytes_is_not_read() {
    let bench = Bench::new();
    let begin = std::time::Instant::now();
    let error = bench.error(endless(&bench, "a.xyz", ""));
    assert!(
        error.contains("no line end in the first 1048576 bytes"),
        "{error}"
    );
    let error = bench.error(endless(&bench, "b.xyz", "1 2 3\n4 5 6\n"));
    assert!(error.contains("b.xyz: line around byte"), "{error}");
    assert!(
        error.contains("expected lines of at most 1048576 bytes"),
        "{error}"
    );
    let error = bench.error(endless(&bench, "c.ply", &format!("{HEADER}1 2 3\n")));
    assert!(
        error.contains("vertex 1") && error.contains("a line of more than 1 MiB"),
        "{error}"
    );
    let error = bench.error(endless(&bench, "d.ply", "ply\nformat ascii 1.0\ncomment "));
    assert!(error.contains("no end in 1 MiB"), "{error}");
    assert!(begin.elapsed().as_secs() < 20);
}

#[test]
fn comments_may_come_first_but_not_for_ever() {
    let bench = Bench::new();
    let comments = "# a note on the licence of these points, repeated\n";
    let some = bench.write("a.xyz", comments.repeat(5000) + "1 2 3\n4 5 6\n");
    assert_eq!(bench.read(&[some]).unwrap().points(), 2);
    let many = bench.write("b.xyz", comments.repeat(50_000) + "1 2 3\n4 5 6\n");
    let error = bench.error(many);
    assert!(
        error.contains("no line with numbers in the first 1048576 bytes"),
        "{error}"
    );
    let only = bench.error(bench.write("c.xyz", comments));
    assert!(only.contains("no line with numbers, expected"), "{only}");
}

#[test]
fn text_of_other_encodings_is_told() {
    let bench = Bench::new();
    let wide = |text: &str, mark: bool| -> Vec<u8> {
        let mark = mark.then_some(0xfeffu16);
        let words = mark.into_iter().chain(text.encode_utf16());
        words.flat_map(u16::to_le_bytes).collect()
    };
    let error = bench.error(bench.write("a.xyz", wide("1 2 3\n4 5 6\n", true)));
    assert!(error.contains("UTF-16 text"), "{error}");
    let error = bench.error(bench.write("a.xyz", wide("1 2 3\n4 5 6\n", false)));
    assert!(error.contains("binary data"), "{error}");
    let marked = bench.write("a.xyz", "\u{feff}1\t2\t3\r\n4\t5\t6\r\n");
    assert_eq!(bench.read(&[marked]).unwrap().points(), 2);
    let error = bench.error(bench.write("a.ply", format!("\u{feff}{HEADER}1 2 3\n4 5 6\n")));
    assert!(error.contains("PLY behind a byte order mark"), "{error}");
}

#[test]
fn a_file_that_is_no_file_is_refused() {
    let bench = Bench::new();
    let error = bench
        .read(&[PathBuf::from("/dev/zero")])
        .map(|_| ())
        .unwrap_err();
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
}
