//! Options that leave points out: by class, by thinning, and outliers.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// Runs `reconstruct` with `more` arguments; returns the report.
fn report(bench: &Bench, input: &Path, more: &[&str]) -> Value {
    let path = bench.path("report.json");
    let mut command = util::program(["reconstruct", "--memory", "192MiB"]);
    command.arg(input).args(more).arg("-o");
    command
        .arg(bench.path("mesh.ply"))
        .arg("--report")
        .arg(&path);
    let said = Said::from(command.output().unwrap());
    assert_eq!(said.code, Some(0), "{said:?}");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A wavy height field with points of the classes 2, 6 and 7 in turn.
fn classified(path: &Path, format: u8) {
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(format).unwrap();
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for i in 0..9000u32 {
        let (x, y) = (f64::from(i % 90), f64::from(i / 90));
        let class = [2, 6, 7][(i % 3) as usize];
        let point = las::Point {
            x,
            y,
            z: (x / 9.0).sin(),
            classification: las::point::Classification::new(class).unwrap(),
            gps_time: (format >= 6).then_some(0.0),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn classes_are_kept_and_dropped() {
    let bench = Bench::new();
    for (name, format) in [("a.las", 0), ("a.laz", 0), ("b.las", 6), ("b.laz", 6)] {
        let input = bench.path(name);
        classified(&input, format);
        for (flag, classes, dropped) in [
            ("--drop-classes", "7,18", 3000),
            ("--keep-classes", "6,2", 3000),
            ("--keep-classes", "6", 6000),
        ] {
            let json = report(&bench, &input, &[flag, classes]);
            assert_eq!(
                json["input"]["dropped_by_class"], dropped,
                "{name} {classes}"
            );
            assert_eq!(json["points"], 9000 - dropped);
            assert!(json["warnings"].as_array().unwrap().is_empty());
        }
        let json = report(&bench, &input, &[]);
        assert_eq!(json["input"]["dropped_by_class"], 0);
    }
    let info = ["info", "--keep-classes", "2"].map(String::from);
    let path = bench.path("b.laz").display().to_string();
    let said = util::run(info.into_iter().chain([path]));
    assert!(said.out.contains("3000 distinct of 9000 read"), "{said:?}");
    assert!(said.out.contains("6000 of other classes"), "{said:?}");
}

#[test]
fn a_cloud_without_classes_is_kept_and_it_is_said() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.ply", &Cloud::new(Kind::Sphere).points(3000));
    let json = report(&bench, &input, &["--keep-classes", "2"]);
    assert_eq!(json["points"], 3000);
    let warnings = json["warnings"].as_array().unwrap();
    let warning = warnings[0].as_str().unwrap();
    assert!(
        warnings.len() == 1 && warning.contains("no class"),
        "{warning}"
    );
}

#[test]
fn thinning_leaves_a_point_in_every_cell() {
    let bench = Bench::new();
    let grid = Cloud::new(Kind::Grid)
        .points(40_000)
        .rotated(true)
        .offset([-311.0, 5000.0, 12.0]);
    let input = bench.cloud("cloud.laz", &grid);
    let points: Vec<_> = grid.generator().unwrap().iter().collect();
    for side in [7.3, 20.0, 55.5] {
        let cells: BTreeSet<[i64; 3]> = points
            .iter()
            .map(|p| p.map(|c| (c / side).floor() as i64))
            .collect();
        let json = report(&bench, &input, &["--thin", &side.to_string()]);
        assert_eq!(json["points"], cells.len());
        assert_eq!(json["thin"]["dropped"], 40_000 - cells.len());
        assert_eq!(json["duplicates_folded"], 0);
    }
    // Cells no wider than a step of the lattice change nothing.
    let json = report(&bench, &input, &["--thin", "0.0009"]);
    assert_eq!(
        (&json["points"], &json["thin"]["dropped"]),
        (&40_000.into(), &0.into())
    );
}

#[test]
fn copies_of_a_point_are_told_from_points_thinned() {
    let bench = Bench::new();
    let cloud = Cloud::new(Kind::Torus).points(20_000).duplicates(0.2);
    let input = bench.cloud("cloud.ply", &cloud);
    let plain = report(&bench, &input, &[]);
    let json = report(&bench, &input, &["--thin", "9"]);
    assert_eq!(json["duplicates_folded"], plain["duplicates_folded"]);
    let number = |key: &str| json[key].as_u64().unwrap();
    let left = number("points") + number("duplicates_folded");
    assert_eq!(left + json["thin"]["dropped"].as_u64().unwrap(), 20_000);
}

#[test]
fn without_outliers_the_surface_is_closed() {
    let bench = Bench::new();
    let cloud = Cloud::new(Kind::Torus).points(40_000).outliers(0.01);
    let input = bench.cloud("cloud.laz", &cloud);
    let json = report(&bench, &input, &["--drop-outliers"]);
    assert_eq!(json["parameters"]["drop_outliers"], 5.0);
    let dropped = json["outliers"]["dropped"].as_u64().unwrap();
    assert!((300..450).contains(&dropped), "{dropped}");
    assert_eq!(json["points"].as_u64().unwrap() + dropped, 40_000);
    assert_eq!(json["mesh"]["boundary_edges"], 0);
    assert!(util::verdict(&bench.path("mesh.ply")).manifold);
    let json = report(&bench, &input, &["--drop-outliers=50"]);
    assert!(json["outliers"]["dropped"].as_u64().unwrap() < dropped);
    // Without the option nothing is dropped.
    assert_eq!(report(&bench, &input, &[])["outliers"]["dropped"], 0);
}

#[test]
fn the_library_takes_the_same_options() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.ply", &Cloud::new(Kind::Sphere).points(30_000));
    let params = Params {
        thin: Some(12.0),
        drop_outliers: Some(5.0),
        ..Params::default()
    };
    let report = util::reconstruct(&input, &bench.path("mesh.ply"), &params);
    assert_eq!(report.points + report.thin.dropped, 30_000);
    assert!(report.thin.dropped > 15_000);
    assert_eq!((report.outliers.dropped, report.outliers.rounds), (0, 1));
    assert_eq!(report.mesh.boundary_edges, 0);
}

#[test]
fn bad_values_are_refused_in_one_line() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.ply", &Cloud::new(Kind::Sphere).points(300));
    let input = input.to_str().unwrap();
    let mesh = bench.path("mesh.ply").display().to_string();
    for bad in [
        &["--thin", "0"][..],
        &["--thin=-1"],
        &["--thin", "nan"],
        &["--thin", "inf"],
        &["--drop-outliers=0.5"],
        &["--drop-outliers=x"],
        &["--drop-classes", "256"],
        &["--keep-classes", "2,x"],
        &["--keep-classes", "2", "--drop-classes", "7"],
        &["--facing", "sideways"],
        &["--facing=1,2"],
        &["--facing=1,2,inf"],
    ] {
        let said = util::run(["reconstruct", input, "-o", &mesh].iter().chain(bad));
        assert_eq!(said.code, Some(2), "{bad:?}: {said:?}");
        let told = said.err.lines().next().unwrap_or_default();
        let flag = bad[0].split('=').next().unwrap();
        assert!(told.contains(flag), "{bad:?}: {said:?}");
    }
}
