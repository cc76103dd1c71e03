//! Pages: reports of runs, descriptions of clouds, checks and comparisons of meshes.

mod inspected;
mod page;

use crate::end_to_end::util::{self, Bench, Said};
use outcrop::params::Params;
use outcrop::report::Report;
use outcrop_cloudgen::{Cloud, Kind};
use page::{Page, decoded};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A terrain with noise and outliers, so that there are small pieces, holes, and points that are left out.
fn land() -> Cloud {
    let mut cloud = Cloud::new(Kind::Terrain).points(30_000).noise(0.6);
    cloud.outliers = 0.002;
    cloud
}

fn run(arguments: &[&str], paths: &[&Path]) -> Said {
    let mut command = util::program(arguments);
    Said::from(command.args(paths).output().unwrap())
}

/// Reads a page, and the report beside it.
fn read(bench: &Bench) -> (Page, Value) {
    let html = std::fs::read_to_string(bench.path("report.html")).unwrap();
    let json = std::fs::read_to_string(bench.path("report.json")).unwrap();
    (Page::of(&html), serde_json::from_str(&json).unwrap())
}

/// Runs `reconstruct` with both reports.
fn reported(bench: &Bench, input: &Path, mesh: &Path, more: &[&str]) -> (Page, Value) {
    let reports = [bench.path("report.html"), bench.path("report.json")];
    let said = Said::from(
        util::program(["reconstruct", "--block-points", "4096", "--threads", "2"])
            .args([
                input,
                Path::new("-o"),
                mesh,
                Path::new("--report"),
                &reports[0],
            ])
            .args([Path::new("--report"), &reports[1]])
            .args(more)
            .output()
            .unwrap(),
    );
    assert_eq!(said.code, Some(0), "{said:?}");
    read(bench)
}

#[test]
fn a_report_is_a_page_that_stands_alone_and_has_the_figures_of_the_other() {
    let bench = Bench::new();
    let input = bench.cloud("a<b>&\"c' \u{1b}[31m.laz", &land());
    let mesh = bench.path("x<script>alert(1)<script>&amp;.ply");
    let (page, json) = reported(
        &bench,
        &input,
        &mesh,
        &[
            "--memory",
            "192MiB",
            "--max-edge",
            "2x",
            "--max-hole-edges",
            "0",
        ],
    );
    assert_eq!(page.heading, "x<script>alert(1)<script>&amp;.ply");
    assert!(page.text.contains("a<b>&\"c' \u{fffd}[31m.laz"));
    let n = |key: &str| json.pointer(key).and_then(Value::as_u64).unwrap();
    for (row, key) in [
        ("points read", "/input/read"),
        ("points kept", "/input/kept"),
        ("duplicates", "/duplicates_folded"),
        ("distinct points used", "/points"),
        ("vertices", "/mesh/vertices"),
        ("triangles", "/mesh/triangles"),
        ("boundary edges", "/mesh/boundary_edges"),
        ("points that are vertices", "/mesh/points_used"),
        ("copies of pinched vertices", "/mesh/pinched_copies"),
        ("boundary loops", "/details/loops/count"),
        ("components found", "/repair/components_found"),
        ("small components removed", "/repair/components_removed"),
        ("boundary loops found", "/repair/holes_found"),
        ("holes filled", "/repair/holes_filled"),
        ("points off the surface", "/cells/off_surface"),
    ] {
        assert_eq!(page.number(row), n(key), "{row}");
    }
    // Edges are found block by block, and must be all of the mesh.
    let verdict = util::verdict(&mesh);
    assert_eq!(n("/details/edges/count"), verdict.edges);
    assert_eq!(n("/details/components/count"), verdict.components);
    let loops = n("/details/loops/count");
    assert!(loops > 3 && loops <= verdict.boundary_loops, "{loops}");
    for name in ["edges", "loops", "components", "spacings"] {
        let bins = json["details"][name]["bins"].as_array().unwrap();
        let sum: u64 = bins.iter().map(|bin| bin["count"].as_u64().unwrap()).sum();
        assert_eq!(sum, n(&format!("/details/{name}/count")), "{name}");
    }
    let stages = json["stages"].as_array().unwrap();
    for stage in stages {
        let name = stage["name"].as_str().unwrap();
        let row = page
            .table
            .iter()
            .find(|row| row.len() == 8 && row[0] == name)
            .unwrap();
        assert_eq!(row[2], format!("{:.2}", stage["seconds"].as_f64().unwrap()));
    }
    let course = json["details"]["course"].as_array().unwrap();
    assert!(course.len() > 1 && course.len() <= 512);
    assert!(
        course
            .iter()
            .any(|sample| sample["scratch"].as_u64().unwrap() > 0)
    );
    // Pictures: three of the mesh, one of points that are left out.
    let pixels = page.pixels();
    assert_eq!(pixels.len(), 4);
    for picture in &pixels {
        assert!(picture.width == 880 && picture.filled() > 0.1);
    }
    assert!(pixels[..3].iter().all(|picture| picture.reddish() > 50));
    assert!(pixels[3].of([222, 92, 0]) > 0 && pixels[3].of([176, 178, 182]) > 1000);
    // The budget holds with pictures, which are reserved by name.
    assert!(n("/peak_resident_bytes") < 192 << 20, "{json:#}");
    assert!(json["reserved_at_peak"]["draw: pictures"].as_u64().unwrap() > 10 << 20);
}

/// Reports of two runs that must not differ, but for times and memory.
fn drawn(bench: &Bench, input: &Path, params: &Params, budget: u64, threads: usize) -> Report {
    let mesh = bench.path(&format!("{budget}-{threads}.ply"));
    util::builder(&[input.to_path_buf()], &mesh, params)
        .memory(budget)
        .threads(threads)
        .tile_points(1500 * threads as u32)
        .pictures(true)
        .build()
        .unwrap()
        .run()
        .unwrap()
}

#[test]
fn pictures_do_not_depend_on_threads_and_memory() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let params = Params {
        block: 4096,
        ..Params::default()
    };
    let one = drawn(&bench, &input, &params, 192 << 20, 1);
    let other = drawn(&bench, &input, &params, 1 << 30, 3);
    assert_eq!(one.pictures.len(), 4);
    assert_eq!(one.pictures, other.pictures);
    let figures = |report: Report| {
        let details = report.details.unwrap();
        (
            details.edges,
            details.loops,
            details.components,
            details.spacings,
        )
    };
    assert_eq!(figures(one), figures(other));
}

#[test]
fn without_a_page_nothing_is_drawn() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let report = util::reconstruct(&input, &bench.path("mesh.ply"), &Params::default());
    assert!(report.pictures.is_empty() && report.details.is_none());
    assert!(report.stages.iter().all(|stage| stage.name != "draw"));
    let json = serde_json::to_value(&report).unwrap();
    assert!(json.get("details").is_none() && json.get("pictures").is_none());
    let page = Page::of(&outcrop::page::report(&report, Path::new("mesh.ply")));
    assert_eq!(page.number("triangles"), report.mesh.triangles);
    assert!(page.pictures.is_empty());
}

#[test]
fn a_cut_mesh_is_drawn_without_its_seams() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let mesh = bench.path("mesh.ply");
    let (page, json) = reported(&bench, &input, &mesh, &["--crop", "-50,-50,60,40"]);
    let verdict = util::verdict(&mesh);
    assert_eq!(json["details"]["edges"]["count"], verdict.edges);
    assert_eq!(page.pictures.len(), 3);
    let red: Vec<_> = page.pixels().iter().map(|p| p.reddish()).collect();
    // The third picture is a detail of the middle.
    assert!(red[..2].iter().all(|pixels| *pixels > 50), "{red:?}");
    // The edges between squares have two triangles.
    let whole = bench.path("whole.ply");
    let (_, of_whole) = reported(&bench, &input, &whole, &[]);
    let (page, split) = reported(&bench, &input, &mesh, &["--split", "60"]);
    assert!(split["cut"]["squares"].as_u64().unwrap() > 3);
    assert_eq!(split["details"]["edges"], of_whole["details"]["edges"]);
    assert_eq!(split["details"]["loops"], of_whole["details"]["loops"]);
    assert_eq!(page.pictures.len(), 3);
}

#[test]
fn a_killed_run_is_resumed_to_the_same_pictures() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let (mesh, html) = (bench.path("mesh.ply"), bench.path("report.html"));
    let attempt = |fault: &str, more: &[&str]| {
        let arguments = [
            "reconstruct",
            "--block-points",
            "4096",
            "--threads",
            "2",
            "--report",
        ];
        let mut command = util::program(arguments);
        command
            .args([&html, &input, Path::new("-o"), &mesh])
            .args(more);
        command.env("OUTCROP_FAULT", fault).output().unwrap()
    };
    let counts = bench.path("counts");
    assert!(
        attempt(&format!("count:{}", counts.display()), &[])
            .status
            .success()
    );
    let pictures = || Page::of(&std::fs::read_to_string(&html).unwrap()).pictures;
    let expected = pictures();
    let hash = util::hash(&mesh);
    let counts = std::fs::read_to_string(counts).unwrap();
    let events = |kind: &str| -> u64 {
        let mut lines = counts.lines().filter_map(|line| line.split_once(' '));
        lines
            .find(|line| line.0 == kind)
            .unwrap()
            .1
            .parse()
            .unwrap()
    };
    // The last events are those of the mesh and the pictures.
    let mut kills = 0;
    for kind in ["recorded", "write"] {
        for before in 0..6 {
            let fault = format!("{kind}:{}", events(kind) - before);
            for path in [&mesh, &html] {
                let _ = std::fs::remove_file(path);
            }
            attempt(&fault, &[]);
            if bench.path("mesh.ply.outcrop-scratch").exists() {
                let again = attempt("", &["--resume", "--memory", "192MiB"]);
                assert!(again.status.success(), "{fault}: {again:?}");
                kills += 1;
            }
            assert_eq!(util::hash(&mesh), hash, "{fault}");
            assert!(pictures() == expected, "{fault}");
        }
    }
    assert!(kills > 3, "{kills}");
}

#[test]
fn tasks_that_share_a_run_have_the_same_pictures() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let mesh = bench.path("mesh.ply");
    let (alone, _) = reported(&bench, &input, &mesh, &[]);
    let html = bench.path("shared.html");
    let fixed = [
        "plan",
        "--block-points",
        "4096",
        "--shards",
        "3",
        "--submit",
        "local",
        "--workers",
        "2",
    ];
    let shared = bench.path("shared.ply");
    let paths = [
        &*input,
        Path::new("-o"),
        &shared,
        Path::new("--report"),
        &html,
    ];
    let said = run(&fixed, &paths);
    assert_eq!(said.code, Some(0), "{said:?}");
    let page = Page::of(&std::fs::read_to_string(&html).unwrap());
    assert_eq!(util::hash(&mesh), util::hash(&shared));
    assert!(page.pictures == alone.pictures);
    assert!(page.text.contains("tasks shared the run"));
    assert_eq!(page.number("triangles"), alone.number("triangles"));
}

#[test]
fn a_page_that_cannot_be_written_is_an_error_before_the_work() {
    let bench = Bench::new();
    let input = bench.cloud("land.xyz", &Cloud::new(Kind::Torus).points(2000));
    let mesh = bench.path("mesh.ply");
    let missing = bench.path("no-folder/report.html");
    let arguments = [
        &*input,
        Path::new("-o"),
        &mesh,
        Path::new("--report"),
        &missing,
    ];
    let said = run(&["reconstruct"], &arguments);
    assert!(
        said.code == Some(2) && said.err.contains("cannot write the report"),
        "{said:?}"
    );
    assert!(!mesh.exists());
    let before = std::fs::read(&input).unwrap();
    for command in ["info", "verify", "compare"] {
        let files: Vec<PathBuf> = vec![input.clone(); if command == "compare" { 2 } else { 1 }];
        let mut all = vec![Path::new("--html"), &*input];
        all.extend(files.iter().map(PathBuf::as_path));
        let said = run(&[command], &all);
        assert!(
            said.code == Some(2) && said.err.contains("ends in .html"),
            "{said:?}"
        );
    }
    assert!(
        std::fs::read(&input).unwrap() == before,
        "an input was overwritten"
    );
    // Failed work leaves no empty page.
    let (html, nothing) = (bench.path("page.html"), bench.path("nothing.laz"));
    let said = run(&["info", "--html"], &[&html, &nothing]);
    assert!(said.code == Some(2) && !html.exists(), "{said:?}");
}

#[test]
fn the_library_draws_as_the_program_does() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let params = Params {
        block: 4096,
        ..Params::default()
    };
    let report = drawn(&bench, &input, &params, 256 << 20, 2);
    let (page, _) = reported(&bench, &input, &bench.path("mesh.ply"), &[]);
    let own: Vec<_> = report
        .pictures
        .iter()
        .map(|picture| picture.png.clone())
        .collect();
    assert!(own == page.pictures);
    let scale = report.pictures[0].scale;
    assert!(scale > 0.0 && scale.is_finite());
    assert!(own.iter().all(|png| decoded(png).filled() > 0.05));
}
