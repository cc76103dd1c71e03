//! The program from the user's view: output and exit codes.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

fn ply(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    vertices
        .iter()
        .for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    faces
        .iter()
        .for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    text
}

const CORNERS: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
];
const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

fn run(arguments: &[&OsStr]) -> Said {
    util::run(arguments)
}

#[test]
fn verify_says_yes_no_or_why_not() {
    let bench = Bench::new();
    let verify = |path: &Path, more: &[&str]| {
        let mut arguments = vec![OsStr::new("verify"), path.as_os_str()];
        arguments.extend(more.iter().map(OsStr::new));
        run(&arguments)
    };
    let good = bench.write("good.ply", ply(&CORNERS[..4], &TETRAHEDRON));
    let said = verify(&good, &[]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    assert!(said.out.contains('4'), "{said:?}");

    let json: Value = serde_json::from_str(&verify(&good, &["--json"]).out).unwrap();
    assert_eq!(json["manifold"], true);
    assert_eq!(
        (&json["vertices"], &json["triangles"], &json["edges"]),
        (&4.into(), &4.into(), &6.into())
    );
    assert_eq!(
        (&json["euler_characteristic"], &json["boundary_loops"]),
        (&2.into(), &0.into())
    );

    // An edge with three triangles.
    let bad = [&TETRAHEDRON[..], &[[0, 1, 4]]].concat();
    let bad = bench.write("bad.ply", ply(&CORNERS, &bad));
    let said = verify(&bad, &[]);
    assert_eq!((said.code, said.err.as_str()), (Some(1), ""), "{said:?}");
    let json: Value = serde_json::from_str(&verify(&bad, &["--json"]).out).unwrap();
    assert_eq!(
        (&json["manifold"], &json["non_manifold_edges"]),
        (&false.into(), &1.into())
    );

    let loose = bench.write("loose.ply", ply(&CORNERS, &TETRAHEDRON));
    assert_eq!(verify(&loose, &[]).code, Some(1));
    assert_eq!(verify(&loose, &["--allow-unreferenced"]).code, Some(0));

    for broken in [
        bench.write("broken.ply", "ply\nformat"),
        bench.path("absent.ply"),
    ] {
        let said = verify(&broken, &["--json"]);
        assert_eq!((said.code, said.out.as_str()), (Some(2), ""), "{said:?}");
        assert!(
            said.err.starts_with("outcrop: ") && said.err.lines().count() == 1,
            "{said:?}"
        );
    }
}

#[test]
fn info_tells_what_is_there() {
    let bench = Bench::new();
    let cloud = Cloud::new(Kind::Torus)
        .points(20_000)
        .duplicates(0.1)
        .offset([4e5, 5e6, 0.0]);
    let input = bench.cloud("cloud.laz", &cloud);
    let said = util::run(["info".as_ref(), "--json".as_ref(), input.as_os_str()]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    let json: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(json["input"]["read"], 20_000);
    let number = |key: &str| {
        json.pointer(key)
            .and_then(Value::as_f64)
            .unwrap_or_else(|| panic!("{key}"))
    };
    assert_eq!(number("/points") + number("/duplicates"), 20_000.0);
    for key in [
        "/spacing/p50",
        "/auto_radius/p50",
        "/noise/p50",
        "/memory_minimum",
        "/scratch_bytes",
        "/output_bytes",
        "/seconds",
        "/lattice_step",
    ] {
        assert!(number(key) > 0.0, "{key}: {json:#}");
    }
    assert!(number("/spacing/p50") < number("/auto_radius/p50"));
    assert!(number("/min/0") < 4e5 && number("/max/1") > 5e6);
    let said = util::run(["info".as_ref(), input.as_os_str()]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    assert!(
        said.out.contains("points") && said.out.contains("memory"),
        "{said:?}"
    );
    assert_eq!(util::listing(bench.folder()), ["cloud.laz"]);
}

#[test]
fn info_tells_where_the_scanners_were() {
    let bench = Bench::new();
    let head = "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2.5 -3 1\n";
    let scan = format!("{head}1 2 3 0.5\n4 5 6 0.5\n0 0 0 0.5\n7 8 0 0.5\n");
    let input = bench.write("two.ptx", scan.clone() + &scan.replace("2.5 -3", "9 9"));
    let said = util::run(["info".as_ref(), input.as_os_str()]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    for part in ["2 scanner positions: 1 2.5 -3; 1 9 9", "2 invalid"] {
        assert!(said.out.contains(part), "{said:?}");
    }
    let said = util::run(["info".as_ref(), "--json".as_ref(), input.as_os_str()]);
    let json: Value = serde_json::from_str(&said.out).unwrap();
    let places = serde_json::json!([[1.0, 2.5, -3.0], [1.0, 9.0, 9.0]]);
    assert_eq!(json["input"]["files"][0]["scanners"], places);
    assert_eq!(
        (&json["input"]["invalid"], &json["input"]["kept"]),
        (&2.into(), &6.into())
    );
}

#[test]
fn the_estimate_of_the_minimum_is_accepted() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", &Cloud::new(Kind::Torus).points(5000));
    let said = util::run(["info".as_ref(), "--json".as_ref(), input.as_os_str()]);
    let json: Value = serde_json::from_str(&said.out).unwrap();
    let minimum = json["memory_minimum"].as_u64().unwrap();
    assert!(minimum <= 256 << 20);
    let mesh = bench.path("mesh.ply");
    let with = |bytes: u64| {
        let mut command = util::program(["reconstruct", "--memory", &bytes.to_string(), "-o"]);
        Said::from(command.arg(&mesh).arg(&input).output().unwrap())
    };
    assert_eq!(with(minimum).code, Some(0));
    assert_eq!(with(minimum - 1).code, Some(2));
}

#[test]
fn nothing_is_said_where_nobody_reads() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", &Cloud::new(Kind::Torus).points(5000));
    let mesh = bench.path("mesh.ply");
    for more in [&[][..], &["--quiet"]] {
        let mut command = util::program(["reconstruct", "-o"]);
        let said = Said::from(command.arg(&mesh).arg(&input).args(more).output().unwrap());
        assert_eq!(
            (said.code, said.out.as_str(), said.err.as_str()),
            (Some(0), "", ""),
            "{said:?}"
        );
    }
}

#[test]
fn progress_is_shown_on_a_terminal_unless_quiet() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", &Cloud::new(Kind::Torus).points(5000));
    let mesh = bench.path("mesh.ply");
    let on_a_terminal = |more: &str| {
        let line = format!(
            "'{}' reconstruct '{}' -o '{}' {more}",
            env!("CARGO_BIN_EXE_outcrop"),
            input.display(),
            mesh.display()
        );
        let mut command = Command::new("script");
        command.args(["--quiet", "--return", "--command", &line, "/dev/null"]);
        command.output().map(Said::from)
    };
    let Ok(said) = on_a_terminal("") else {
        util::skip("no `script` to make a terminal");
        return;
    };
    assert_eq!(said.code, Some(0), "{said:?}");
    for stage in [
        "ingest", "order", "cells", "triples", "stitch", "repair", "export",
    ] {
        assert!(said.out.contains(stage), "no {stage} in {said:?}");
    }
    assert!(said.out.contains("triangles"), "{said:?}");
    let said = on_a_terminal("--quiet").unwrap();
    assert_eq!((said.code, said.out.as_str()), (Some(0), ""), "{said:?}");
}

#[test]
fn every_command_explains_itself() {
    for command in ["reconstruct", "info", "verify", "demo"] {
        let said = util::run([command, "--help"]);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
        assert!(
            said.out.contains("Usage: outcrop ") && said.out.contains("--memory"),
            "{said:?}"
        );
    }
    let said = util::run(["--help"]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    for word in ["reconstruct", "info", "verify", "demo", "Exit codes"] {
        assert!(said.out.contains(word), "no {word} in {said:?}");
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let wrong: [&[&str]; 8] = [
        &[],
        &["frobnicate"],
        &["reconstruct"],
        &["reconstruct", "cloud.laz"],
        &[
            "reconstruct",
            "cloud.laz",
            "-o",
            "mesh.ply",
            "--memory",
            "lots",
        ],
        &[
            "reconstruct",
            "cloud.laz",
            "-o",
            "mesh.ply",
            "--radius",
            "-5%",
        ],
        &[
            "reconstruct",
            "cloud.laz",
            "-o",
            "mesh.ply",
            "--threads",
            "0",
        ],
        &["verify"],
    ];
    for arguments in wrong {
        let said = util::run(arguments);
        assert_eq!(
            (said.code, said.out.as_str()),
            (Some(2), ""),
            "{arguments:?}: {said:?}"
        );
        assert!(!said.err.is_empty());
    }
}

#[test]
fn the_demo_makes_a_closed_mesh() {
    let bench = Bench::new();
    let folder = bench.path("demo");
    let said = util::run([
        "demo".as_ref(),
        "--points".as_ref(),
        "3e4".as_ref(),
        folder.as_os_str(),
    ]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    assert_eq!(
        util::listing(&folder),
        ["bumpy.laz", "bumpy.ply", "report.json"]
    );
    let verdict = util::verdict(&folder.join("bumpy.ply"));
    assert!(verdict.manifold);
    assert_eq!(
        (verdict.boundary_edges, verdict.euler_characteristic),
        (0, -8)
    );
}

#[test]
fn the_mesh_of_the_program_is_that_of_the_library() {
    let bench = Bench::new();
    let input = bench.cloud(
        "cloud.laz",
        &Cloud::new(Kind::Room).points(30_000).noise(0.5),
    );
    let (a, b) = (bench.path("a.ply"), bench.path("b.ply"));
    util::reconstruct(&input, &a, &Default::default());
    let mut command = util::program(["reconstruct", "--tile-points", "3000", "-o"]);
    let said = Said::from(command.arg(&b).arg(&input).output().unwrap());
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(util::hash(&a), util::hash(&b));
}

#[test]
fn compare_answers_in_words_and_json() {
    let bench = Bench::new();
    let a = bench.write("a.ply", ply(&CORNERS[..4], &TETRAHEDRON));
    let b = bench.points("b.xyz", &CORNERS);
    let compare = |more: &[&str]| {
        let mut arguments = vec![OsStr::new("compare"), a.as_os_str(), b.as_os_str()];
        arguments.extend(more.iter().map(OsStr::new));
        run(&arguments)
    };
    let said = compare(&[]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    assert!(said.out.contains("99.9 %"), "{said:?}");

    let said = compare(&["--json", "--samples", "1e3", "--seed", "5"]);
    let json: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(
        (&json["a"]["kind"], &json["b"]["kind"]),
        (&"mesh".into(), &"cloud".into())
    );
    assert_eq!(
        (&json["most_samples"], &json["seed"]),
        (&1000.into(), &5.into())
    );
    assert_eq!(
        (&json["a_to_b"]["samples"], &json["b_to_a"]["samples"]),
        (&1000.into(), &5.into())
    );
    // From (1, 1, 1) to the slanted side.
    let far = json["b_to_a"]["max"].as_f64().unwrap();
    assert!((far - 2.0 / 3f64.sqrt()).abs() < 1e-12, "{json}");
    let limited = [
        "--json",
        "--samples",
        "1e3",
        "--seed",
        "5",
        "--threads",
        "1",
        "--memory",
        "192MiB",
    ];
    assert_eq!(compare(&limited).out, said.out);

    assert_eq!(compare(&["--samples", "0"]).code, Some(2));
    let absent = bench.path("absent.ply");
    let said = run(&[OsStr::new("compare"), a.as_os_str(), absent.as_os_str()]);
    assert_eq!(
        (said.code, said.err.lines().count()),
        (Some(2), 1),
        "{said:?}"
    );
}
