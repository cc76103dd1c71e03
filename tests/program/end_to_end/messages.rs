//! What the program says, and when: warnings, the summary, and what explains an error.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use outcrop_ply::Header;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;

/// A wavy square as text with more columns behind the coordinates.
fn square(more: impl Fn(usize) -> String) -> String {
    let line = |i: usize| {
        let (x, y) = ((i % 30) as f64, (i / 30) as f64);
        format!(
            "{x} {y} {:.3} {}\n",
            (x * 0.4).sin() + (y * 0.3).cos(),
            more(i)
        )
    };
    (0..900).map(line).collect()
}

fn ply(properties: &str, count: usize, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\nproperty double y\n\
         property double z\n{properties}end_header\n{body}"
    )
}

fn run(command: &str, input: &Path, mesh: Option<&Path>, more: &[&str]) -> Said {
    let mut words = vec![command.as_ref(), input.as_os_str()];
    if let Some(mesh) = mesh {
        words.extend(["-o".as_ref(), mesh.as_os_str()]);
    }
    words.extend(more.iter().map(OsStr::new));
    util::run(words)
}

const COLORS: &str = "property ushort red\nproperty ushort green\nproperty ushort blue\n";

#[test]
fn warnings_stay_with_quiet_and_go_with_more_of_it() {
    let bench = Bench::new();
    let colors = |i: usize| format!("{} {} 7", i % 200, i / 9);
    let input = bench.write("a.ply", ply(COLORS, 900, &square(colors)));
    let mesh = bench.path("a-mesh.ply");
    let warning = "outcrop: warning: colours 8 bits\n";
    for (flags, wanted) in [
        (&[][..], warning),
        (&["-q"], warning),
        (&["--quiet"], warning),
        (&["-qq"], ""),
        (&["-q", "--quiet"], ""),
    ] {
        let more = [&["--attributes", "color"][..], flags].concat();
        let said = run("reconstruct", &input, Some(&mesh), &more);
        assert_eq!(
            (said.code, said.err.as_str(), said.out.as_str()),
            (Some(0), wanted, ""),
            "{flags:?}"
        );
    }
    // Errors are told whatever is quiet.
    let said = run(
        "reconstruct",
        &bench.path("none.ply"),
        Some(&mesh),
        &["-qq"],
    );
    assert_eq!(said.code, Some(2));
    assert_eq!(said.err.lines().count(), 1, "{said:?}");
}

#[test]
fn warnings_come_before_the_error_that_they_explain() {
    let bench = Bench::new();
    let points = "ply\nformat ascii 1.0\nelement point 1\nproperty float x\nend_header\n1\n";
    let odd = bench.write("odd.ply", points);
    let broken = bench.write("broken.ply", "ply\nformat");
    let mesh = bench.path("mesh.ply");
    let why = "the header has no element \"vertex\", so there are no points";
    for (inputs, command) in [
        (vec![&odd], "reconstruct"),
        (vec![&odd], "info"),
        (vec![&odd, &broken], "reconstruct"),
        (vec![&odd, &broken], "info"),
    ] {
        let mut words = vec![command.as_ref()];
        words.extend(inputs.iter().map(|path| path.as_os_str()));
        if command == "reconstruct" {
            words.extend(["-o".as_ref(), mesh.as_os_str()]);
        }
        let said = util::run(words);
        let lines: Vec<&str> = said.err.lines().collect();
        assert_eq!((said.code, lines.len()), (Some(2), 2), "{said:?}");
        assert!(
            lines[0].starts_with("outcrop: warning: ") && lines[0].ends_with(why),
            "{said:?}"
        );
        assert!(!lines[1].contains("warning"), "{said:?}");
    }
}

/// Positions of a wide grid in doubles, none of which is on a lattice that fits.
fn odd_grid(count: usize, copies: usize, far: bool) -> String {
    let side = (count as f64).sqrt() as usize;
    let mut lines = String::new();
    for i in 0..side * side {
        let (x, y) = ((i % side) as f64 / 3.0, (i / side) as f64 / 7.0);
        let line = format!("{x} {y} {}\n", (x * 0.3).sin() / 3.0);
        let more = if i % 5 == 0 { copies } else { 1 };
        (0..more).for_each(|_| lines += &line);
    }
    if far {
        // Too many to be strewn.
        for i in 0..side * side / 50 {
            lines += &format!(
                "{}.1 {}.3 0.7\n",
                3e13 + i as f64 * 1e11,
                i * 100_000_000_000usize
            );
        }
    }
    lines
}

#[test]
fn duplicates_are_told_from_points_that_fell_together() {
    let bench = Bench::new();
    let write = |name: &str, body: String| bench.write(name, ply("", body.lines().count(), &body));
    let mesh = bench.path("mesh.ply");
    let twice = write("twice.ply", odd_grid(2500, 2, false));
    let said = run("reconstruct", &twice, Some(&mesh), &[]);
    let wanted =
        "outcrop: warning: 500 points are duplicates of others: one at each position is kept\n";
    assert_eq!((said.code, said.err.as_str()), (Some(0), wanted));
    // Three of each are two duplicates.
    let thrice = write("thrice.ply", odd_grid(900, 3, false));
    let said = run("reconstruct", &thrice, Some(&mesh), &[]);
    assert!(said.err.contains("360 points are duplicates"), "{said:?}");
    let wide = write("wide.ply", odd_grid(2500, 1, true));
    let said = run("reconstruct", &wide, Some(&mesh), &["--keep-far"]);
    assert!(
        said.err.contains("points were merged by rounding"),
        "{said:?}"
    );
    assert!(!said.err.contains("duplicates"), "{said:?}");
}

#[test]
fn a_column_named_like_a_coordinate_gives_a_valid_mesh() {
    let bench = Bench::new();
    let own = |i: usize| (i % 5).to_string();
    let input = bench.write("a.ply", ply("property int X\n", 900, &square(own)));
    let mesh = bench.path("mesh.ply");
    let said = run("reconstruct", &input, Some(&mesh), &["--attributes", "x"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let bytes = std::fs::read(&mesh).unwrap();
    let header = Header::read(&mut &bytes[..]).unwrap();
    let names: Vec<&str> = header.elements[0]
        .properties
        .iter()
        .map(|p| &*p.0)
        .collect();
    assert_eq!(names, ["x", "y", "z", "extra_x"]);
    assert!(util::verdict(&mesh).manifold);
}

#[test]
fn info_tells_the_scale_of_colours() {
    let bench = Bench::new();
    let colors = |factor: usize| {
        move |i: usize| format!("{} {} {}", i % 200 * factor, 9 * factor, 7 * factor)
    };
    let eight = bench.write("a.ply", ply(COLORS, 900, &square(colors(1))));
    let wide = bench.write(
        "b.ply",
        ply(COLORS, 900, &square(colors(257)).replace("1.000", "0.900")),
    );
    let said = run("info", &eight, None, &[]);
    assert!(said.out.contains("\ncolours      8 bits\n"), "{said:?}");
    let said = run(
        "info",
        &eight,
        None,
        &["--json", &wide.display().to_string()],
    );
    let json: Value = serde_json::from_str(&said.out).unwrap();
    let depth = |n: usize| {
        json["input"]["files"][n]["colors"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    assert_eq!([depth(0), depth(1)], ["8 bits", "16 bits"]);
    let plain = bench.cloud("plain.laz", &Cloud::new(Kind::Torus).points(2000));
    let said = run("info", &plain, None, &[]);
    assert!(!said.out.contains("colours"), "{said:?}");
}

#[test]
fn a_cloud_in_an_archive_gives_the_mesh_of_the_cloud() {
    let bench = Bench::new();
    let cloud = square(|_| String::new());
    let plain = bench.write("a.xyz", &cloud);
    let mut archive = rawzip::ZipArchiveWriter::new(Vec::new());
    let (mut entry, config) = archive.new_file("in/a.xyz").start().unwrap();
    let mut writer = config.wrap(&mut entry);
    std::io::Write::write_all(&mut writer, cloud.as_bytes()).unwrap();
    let descriptor = writer.finish().unwrap().1;
    entry.finish(descriptor).unwrap();
    let packed = bench.write("a.zip", archive.finish().unwrap());
    let meshes = [plain, packed].map(|input| {
        let mesh = bench.path("mesh.ply");
        let said = run("reconstruct", &input, Some(&mesh), &[]);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
        util::hash(&mesh)
    });
    assert_eq!(meshes[0], meshes[1]);
    let said = run(
        "compare",
        &bench.path("a.zip"),
        None,
        &[&bench.path("a.xyz").display().to_string()],
    );
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
}
