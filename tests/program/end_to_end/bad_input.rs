//! Invalid input ends with one clear line and exit code 2, and leaves no files behind.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::{Path, PathBuf};

/// Asserts one line `outcrop: ...` that contains each of `words`, and exit code 2.
pub fn refused(said: &Said, words: &[&str]) {
    assert_eq!(said.code, Some(2), "{said:?}");
    assert_eq!(said.out, "", "{said:?}");
    assert!(
        said.err.starts_with("outcrop: ") && said.err.ends_with('\n'),
        "{said:?}"
    );
    assert_eq!(said.err.lines().count(), 1, "{said:?}");
    for word in words {
        assert!(said.err.contains(word), "no {word:?} in {said:?}");
    }
}

/// Runs with `more` arguments beside input and output; an existing output stays unchanged.
fn refuses_with(inputs: &[&Path], more: &[&str], words: &[&str]) {
    let folder = Bench::new();
    let mesh = folder.path("mesh.ply");
    for existing in [false, true] {
        if existing {
            folder.write("mesh.ply", "something dear");
        }
        let before = util::listing(folder.folder());
        let mut command = util::program(["reconstruct"]);
        command.args(inputs).arg("-o").arg(&mesh).args(more);
        refused(&command.output().unwrap().into(), words);
        assert_eq!(
            util::listing(folder.folder()),
            before,
            "leftovers of {inputs:?}"
        );
        if existing {
            assert_eq!(std::fs::read(&mesh).unwrap(), b"something dear");
        }
    }
}

fn refuses(input: &Path, words: &[&str]) {
    refuses_with(&[input], &[], words);
}

pub fn good(bench: &Bench, name: &str) -> PathBuf {
    bench.cloud(name, &Cloud::new(Kind::Sphere).points(2000))
}

fn ply_of(points: &[[f32; 3]]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    points
        .iter()
        .flatten()
        .for_each(|x| bytes.extend_from_slice(&x.to_le_bytes()));
    bytes
}

#[test]
fn empty_files() {
    let bench = Bench::new();
    for name in ["empty.las", "empty.laz", "empty.ply", "empty.xyz", "empty"] {
        refuses(&bench.write(name, ""), &[name, "empty"]);
    }
    refuses(&bench.subfolder("folder"), &["folder"]);
    refuses(&bench.path("absent.las"), &["absent.las"]);
}

#[test]
fn clouds_without_points() {
    let bench = Bench::new();
    for name in ["none.las", "none.laz", "none.ply"] {
        refuses(
            &bench.cloud(name, &Cloud::new(Kind::Sphere).points(0)),
            &["point"],
        );
    }
    let nan = [f32::NAN; 3];
    refuses(&bench.write("nan.ply", ply_of(&[nan; 100])), &["point"]);
    refuses(
        &bench.write("infinite.ply", ply_of(&[[0.0, f32::INFINITY, 0.0]; 100])),
        &["point"],
    );
    refuses(
        &bench.write("nan.xyz", "nan nan nan\n".repeat(100)),
        &["point"],
    );
}

#[test]
fn clouds_too_small_for_a_triangle() {
    let bench = Bench::new();
    let (a, b) = ([1.0, 2.0, 3.0], [4.0, 5.0, 7.0]);
    refuses(
        &bench.points("one.xyz", &[a]),
        &["one distinct point", "three"],
    );
    refuses(
        &bench.points("same.xyz", &[a; 1000]),
        &["one distinct point", "three"],
    );
    refuses(
        &bench.points("two.xyz", &[a, b]),
        &["2 distinct points", "three"],
    );
    refuses(
        &bench.points("two-often.xyz", &[a, b, b, a, a]),
        &["2 distinct points", "three"],
    );
}

#[test]
fn clouds_on_one_line() {
    let bench = Bench::new();
    for (number, step) in [[1.0, 0.0, 0.0], [0.0, 0.0, 0.5], [3.0, -1.0, 2.0]]
        .iter()
        .enumerate()
    {
        for count in [3, 4, 50, 5000] {
            let points: Vec<[f64; 3]> = (0..count)
                .map(|i| step.map(|s| 100.0 + s * f64::from(i)))
                .collect();
            let input = bench.points(&format!("line-{number}-{count}.xyz"), &points);
            refuses(&input, &["all on one line", &count.to_string()]);
        }
    }
}

#[test]
fn points_that_carry_no_triangle() {
    let bench = Bench::new();
    let cloud = good(&bench, "cloud.ply");
    refuses_with(&[&cloud], &["--min-component", "1000000"], &["no triangle"]);
    refuses_with(&[&cloud], &["--radius", "0.0001"], &["no triangle"]);
}

#[test]
fn points_that_are_not_finite_are_left_out_and_counted() {
    let bench = Bench::new();
    let clean = good(&bench, "clean.xyz");
    let text = std::fs::read_to_string(&clean).unwrap();
    let dirty = bench.write("dirty.xyz", format!("nan 1 2\n{text}1 inf 2\n3 4 -inf\n"));
    let mesh = |input: &Path, name: &str| {
        let path = bench.path(name);
        let report = util::reconstruct(input, &path, &Default::default());
        (report.input.dropped_non_finite, util::hash(&path))
    };
    let (none, expected) = mesh(&clean, "clean.ply");
    let (three, found) = mesh(&dirty, "dirty.ply");
    assert_eq!((none, three), (0, 3));
    assert_eq!(found, expected);
}

#[test]
fn truncated_files() {
    let bench = Bench::new();
    for name in ["cloud.las", "cloud.laz", "cloud.ply"] {
        let bytes = std::fs::read(good(&bench, name)).unwrap();
        for part in [3, 40, 60, 90, 99] {
            let cut = &bytes[..bytes.len() * part / 100];
            let name = format!("{part}-{name}");
            refuses(&bench.write(&name, cut), &[&name, "found", "expected"]);
        }
        let name = format!("short-{name}");
        refuses(
            &bench.write(&name, &bytes[..bytes.len() - 1]),
            &[&name, "found", "expected"],
        );
    }
}

#[test]
fn text_that_ends_early() {
    let bench = Bench::new();
    let input = bench.write("cloud.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1\n");
    refuses(&input, &["cloud.xyz", "4"]);
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    refuses(
        &bench.write("ascii.ply", text),
        &["ascii.ply", "found", "expected"],
    );
}

#[test]
fn headers_that_claim_more_points() {
    let bench = Bench::new();
    // Number of points in the headers of LAS 1.2.
    for (name, at) in [("cloud.las", 107), ("cloud.laz", 107)] {
        let mut bytes = std::fs::read(good(&bench, name)).unwrap();
        assert_eq!(bytes[at..at + 4], 2000u32.to_le_bytes());
        for claim in [2001u32, 1_000_000, u32::MAX] {
            bytes[at..at + 4].copy_from_slice(&claim.to_le_bytes());
            let name = format!("{claim}-{name}");
            refuses(&bench.write(&name, &bytes), &[&name, "found", "expected"]);
        }
    }
    let mut bytes = ply_of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let digit = bytes.windows(9).position(|w| w == b"vertex 3\n").unwrap() + 7;
    bytes[digit] = b'9';
    refuses(&bench.write("cloud.ply", &bytes), &["cloud.ply", "9", "3"]);
}

#[test]
fn unknown_formats() {
    let bench = Bench::new();
    let noise: Vec<u8> = (0..5000u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    refuses(&bench.write("noise.las", &noise), &["noise.las", "format"]);
    refuses(
        &bench.write("prose.txt", "It was a dark night.\n".repeat(9)),
        &["prose.txt"],
    );
    refuses(
        &bench.write("scan.e57", b"ASTM-E57\x01\0\0\0\0\0\0\0".repeat(9)),
        &["scan.e57", "size of pages at byte 40"],
    );
    refuses(
        &bench.write("cloud.pcd", "# .PCD v.7\nVERSION .7\n"),
        &["cloud.pcd", "PCD header", "a line DATA"],
    );
    let fine = good(&bench, "cloud.ply");
    let bad = bench.write("bad.las", "LASF and no more");
    refuses_with(&[&fine, &bad], &[], &["bad.las"]);
}

#[test]
fn a_failed_run_leaves_no_report() {
    let bench = Bench::new();
    let empty = bench.write("empty.las", "");
    let report = bench.path("report.json");
    let path = report.to_str().unwrap();
    refuses_with(&[&empty], &["--report", path], &["empty.las"]);
    assert!(!report.exists());
    bench.write("report.json", "an older report");
    refuses_with(&[&empty], &["--report", path], &["empty.las"]);
    assert_eq!(std::fs::read(&report).unwrap(), b"an older report");
}

#[test]
fn budgets_below_the_minimum() {
    let bench = Bench::new();
    let cloud = good(&bench, "cloud.ply");
    for size in ["1", "64MiB", "191MiB"] {
        refuses_with(
            &[&cloud],
            &["--memory", size],
            &["memory", "--memory 192MiB"],
        );
    }
    let mesh = bench.path("mesh.ply");
    let said = util::run([
        "reconstruct".as_ref(),
        cloud.as_os_str(),
        "-o".as_ref(),
        mesh.as_os_str(),
        "--memory".as_ref(),
        "192MiB".as_ref(),
    ]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
}

#[test]
fn parameters_out_of_range() {
    let bench = Bench::new();
    let cloud = good(&bench, "cloud.ply");
    for (flag, value) in [
        ("--neighbors", "2"),
        ("--neighbors", "1000"),
        ("--max-angle", "181"),
        ("--smooth", "999"),
    ] {
        refuses_with(&[&cloud], &[flag, value], &[flag, value]);
    }
}
