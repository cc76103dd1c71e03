//! The keys of `--report`, and their values.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use serde_json::Value;

/// Every key that a user may rely on.
const KEYS: &[&str] = &[
    "/version",
    "/method_version",
    "/parameters/classes",
    "/parameters/columns",
    "/parameters/skip_lines",
    "/parameters/crop",
    "/parameters/crop_margin",
    "/parameters/split",
    "/parameters/close",
    "/parameters/lossy",
    "/parameters/attributes",
    "/parameters/wide_colors",
    "/parameters/thin",
    "/parameters/drop_outliers",
    "/parameters/neighbors",
    "/parameters/smooth",
    "/parameters/radius",
    "/parameters/max_angle",
    "/parameters/max_hole_edges",
    "/parameters/min_component",
    "/parameters/repair",
    "/parameters/origin",
    "/parameters/keep_far",
    "/parameters/facing",
    "/parameters/ignore_scanners",
    "/parameters/input_normals",
    "/parameters/ignore_crs",
    "/parameters/crs",
    "/parameters/normals",
    "/parameters/compress_glb",
    "/memory_budget",
    "/threads",
    "/input/read",
    "/input/kept",
    "/input/dropped_non_finite",
    "/input/withheld",
    "/input/invalid",
    "/input/dropped_by_class",
    "/input/dropped_by_crop",
    "/input/skipped_by_crop",
    "/input/dropped_far",
    "/input/far_example",
    "/input/crs",
    "/input/left_out",
    "/input/files/0/path",
    "/input/files/0/format",
    "/input/files/0/bytes",
    "/input/files/0/columns",
    "/input/files/0/taken",
    "/input/files/0/guessed",
    "/input/files/0/claimed",
    "/input/files/0/points",
    "/input/files/0/kept",
    "/input/files/0/invalid",
    "/input/files/0/scanners",
    "/input/files/0/dropped_far",
    "/input/files/0/crs",
    "/scanners",
    "/normals",
    "/attributes",
    "/duplicates_folded",
    "/thin/dropped",
    "/outliers/dropped",
    "/outliers/rounds",
    "/points",
    "/origin",
    "/lattice/step",
    "/lattice/exact",
    "/radius",
    "/cells/global_fallbacks",
    "/cells/no_plane",
    "/cells/off_surface",
    "/cells/raw_triples",
    "/triples/triples",
    "/triples/t3",
    "/triples/t2",
    "/triples/t1",
    "/triples/crossing",
    "/relax/rounds",
    "/relax/moved",
    "/relax/median",
    "/relax/most",
    "/relax/largest",
    "/base/flagged",
    "/base/unfit",
    "/base/mobius",
    "/base/triangles",
    "/insertion/accepted",
    "/insertion/unconnected",
    "/insertion/full_edge",
    "/insertion/excess",
    "/insertion/angle",
    "/insertion/orientation",
    "/insertion/unfit",
    "/insertion/merges_reverted",
    "/repair/bridges_removed",
    "/repair/components_found",
    "/repair/components_removed",
    "/repair/component_triangles_removed",
    "/repair/holes_found",
    "/repair/holes_filled",
    "/repair/holes_clipped",
    "/repair/holes_outline",
    "/repair/holes_too_long",
    "/repair/holes_not_filled",
    "/repair/hole_triangles",
    "/holes_left",
    "/cut/triangles_outside",
    "/cut/squares",
    "/mesh/vertices",
    "/mesh/points_used",
    "/mesh/pinched_copies",
    "/mesh/triangles",
    "/mesh/boundary_edges",
    "/closed",
    "/tiles",
    "/uploaded",
    "/coordinates",
    "/peak_resident_bytes",
    "/resident_file_bytes",
    "/peak_held_bytes",
    "/peak_reserved_bytes",
    "/peak_scratch_bytes",
    "/seconds",
    "/warnings",
];

const STAGES: [&str; 10] = [
    "ingest", "order", "smooth", "smooth", "relax", "cells", "triples", "stitch", "repair",
    "export",
];

fn report(cloud: &Cloud, more: &[&str]) -> (Bench, Value) {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", cloud);
    let path = bench.path("report.json");
    let mut command = util::program(["reconstruct", "--memory", "192MiB", "--threads", "2"]);
    command
        .arg(&input)
        .arg("-o")
        .arg(bench.path("mesh.ply"))
        .arg("--report")
        .arg(&path);
    let said = Said::from(command.args(more).output().unwrap());
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    let text = std::fs::read_to_string(path).unwrap();
    (bench, serde_json::from_str(&text).unwrap())
}

/// The reasons for which a candidate is not inserted.
const INSERTION: [&str; 6] = [
    "unconnected",
    "full_edge",
    "excess",
    "angle",
    "orientation",
    "unfit",
];

fn nasty() -> Cloud {
    Cloud::new(Kind::Room)
        .points(80_000)
        .noise(2.0)
        .outliers(0.02)
        .duplicates(0.05)
        .falloff(true)
}

#[test]
fn every_key_is_there() {
    let (_bench, json) = report(&nasty(), &["--smooth", "2", "--radius", "2%"]);
    let missing: Vec<_> = KEYS
        .iter()
        .filter(|key| json.pointer(key).is_none())
        .collect();
    assert!(missing.is_empty(), "{missing:?} not in {json:#}");
    let stages = json["stages"].as_array().unwrap();
    let names: Vec<_> = stages.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, STAGES);
    for stage in stages {
        assert!(stage["seconds"].as_f64().unwrap() >= 0.0, "{stage}");
        assert!(stage["bytes_read"].as_u64().unwrap() > 0, "{stage}");
        assert!(stage["bytes_written"].as_u64().unwrap() > 0, "{stage}");
        parts_add_up(stage);
    }
    assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["parameters"]["smooth"], 2);
    assert_eq!(json["memory_budget"], 192 << 20);
    assert!(json["radius"].as_f64().unwrap() > 0.0);
}

/// Checks that the parts of a stage take no more time than the stage.
fn parts_add_up(stage: &Value) {
    let parts = stage["parts"].as_array().unwrap();
    let names: Vec<_> = parts.iter().map(|p| p["name"].as_str().unwrap()).collect();
    let sum: f64 = parts.iter().map(|p| p["seconds"].as_f64().unwrap()).sum();
    if stage["name"] == "stitch" {
        assert_eq!(names, ["base", "orient", "insert", "cross"]);
    }
    assert!(sum <= stage["seconds"].as_f64().unwrap(), "{stage}");
}

#[test]
fn the_numbers_agree_with_each_other_and_with_the_files() {
    let (bench, json) = report(&nasty(), &[]);
    let n = |key: &str| {
        json.pointer(key)
            .and_then(Value::as_u64)
            .unwrap_or_else(|| panic!("{key}"))
    };
    assert_eq!(n("/input/read"), 80_000);
    let input = std::fs::metadata(bench.path("cloud.laz")).unwrap().len();
    assert_eq!(n("/input/files/0/bytes"), input);
    assert_eq!(
        n("/input/read"),
        n("/input/kept") + n("/input/dropped_non_finite") + n("/input/withheld")
    );
    assert_eq!(n("/points"), n("/input/kept") - n("/duplicates_folded"));
    assert!(n("/duplicates_folded") > 3000);

    let (t3, t2, t1) = (n("/triples/t3"), n("/triples/t2"), n("/triples/t1"));
    assert!(t3 > 0 && t2 > 0 && t1 > 0);
    assert_eq!(n("/triples/triples"), t3 + t2 + t1);
    // Cells count triples with points off the surface, which are no triples later.
    let (raw, counted) = (n("/cells/raw_triples"), 3 * t3 + 2 * t2 + t1);
    assert!(raw == counted || n("/cells/off_surface") > 0 && raw > counted);
    assert_eq!(
        n("/base/triangles"),
        t3 - n("/base/flagged") - n("/base/unfit") - n("/base/mobius")
    );
    let rejected: u64 = INSERTION
        .iter()
        .map(|test| n(&format!("/insertion/{test}")))
        .sum();
    assert_eq!(
        n("/insertion/accepted") + rejected,
        n("/base/flagged") + t2 + t1
    );

    let filled = n("/repair/holes_filled");
    let left = ["clipped", "outline", "too_long", "not_filled"];
    let left: u64 = left
        .iter()
        .map(|why| n(&format!("/repair/holes_{why}")))
        .sum();
    assert_eq!(n("/repair/holes_found"), filled + left);
    assert_eq!(n("/holes_left"), left);
    assert!(n("/repair/components_found") > n("/repair/components_removed"));

    let verdict = util::verdict(&bench.path("mesh.ply"));
    assert!(verdict.manifold, "{verdict}");
    assert_eq!(n("/mesh/vertices"), verdict.vertices);
    assert_eq!(n("/mesh/triangles"), verdict.triangles);
    assert_eq!(n("/mesh/boundary_edges"), verdict.boundary_edges);
    assert_eq!(
        n("/mesh/vertices"),
        n("/mesh/points_used") + n("/mesh/pinched_copies")
    );
    assert!(n("/mesh/points_used") <= n("/points"));

    let stages = json["stages"].as_array().unwrap();
    let ingest = stages.iter().find(|s| s["name"] == "ingest").unwrap();
    assert!(ingest["bytes_read"].as_u64().unwrap() >= input, "{ingest}");
    let export = stages.iter().find(|s| s["name"] == "export").unwrap();
    let mesh = std::fs::metadata(bench.path("mesh.ply")).unwrap().len();
    assert!(
        export["bytes_written"].as_u64().unwrap() >= mesh,
        "{export}"
    );
    let seconds: f64 = stages.iter().map(|s| s["seconds"].as_f64().unwrap()).sum();
    assert!(seconds <= json["seconds"].as_f64().unwrap());

    let budget = n("/memory_budget");
    assert!(n("/peak_reserved_bytes") > 0 && n("/peak_reserved_bytes") <= budget);
    let held = n("/peak_held_bytes");
    let parts = json["held_at_peak"].as_object().unwrap().values();
    assert_eq!(held, parts.map(|v| v.as_u64().unwrap()).sum::<u64>());
    let stages_held = stages.iter().map(|s| s["held_bytes"].as_u64().unwrap());
    assert_eq!(Some(held), stages_held.max());
    assert!(n("/resident_file_bytes") > 0);
    let resident = n("/peak_resident_bytes");
    assert!(
        resident > 1 << 20 && resident < budget,
        "{resident} of {budget}"
    );
    assert!(n("/peak_scratch_bytes") > n("/points") * 12);
    assert_eq!(json["radius"], Value::Null);
}

/// Type of the coordinates in the header of a mesh.
fn coordinates(bench: &Bench) -> &'static str {
    let bytes = std::fs::read(bench.path("mesh.ply")).unwrap();
    let header = String::from_utf8_lossy(&bytes[..200]).into_owned();
    if header.contains("property double x") {
        "double"
    } else {
        assert!(header.contains("property float x"), "{header}");
        "float"
    }
}

#[test]
fn the_report_says_how_coordinates_are_written() {
    let near = Cloud::new(Kind::Torus).points(5000);
    let far = near.clone().offset([500_000.0, 5_400_000.0, 0.0]);
    for (cloud, expected) in [(near, None), (far, Some("double"))] {
        let (bench, json) = report(&cloud, &["--relax", "0"]);
        assert_eq!(json["coordinates"], coordinates(&bench));
        assert!(
            expected.is_none_or(|e| json["coordinates"] == e),
            "{json:#}"
        );
        assert_eq!(json["lattice"]["exact"], true);
        assert_eq!(json["lattice"]["step"], 0.001);
    }
}
