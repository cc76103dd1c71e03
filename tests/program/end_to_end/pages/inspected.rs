//! Pages of `info`, `verify` and `compare`.

use super::page::Page;
use super::{land, run};
use crate::end_to_end::util::{self, Bench};
use outcrop_cloudgen::{Cloud, Kind};
use std::fmt::Write;
use std::path::Path;

const MAGENTA: [u8; 3] = [225, 0, 225];

fn page_of(command: &str, bench: &Bench, inputs: &[&Path], code: i32) -> (Page, serde_json::Value) {
    let html = bench.path("page.html");
    let mut all = vec![Path::new("--json"), Path::new("--html"), &html];
    all.extend(inputs);
    let said = run(&[command, "--memory", "192MiB"], &all);
    assert_eq!(said.code, Some(code), "{said:?}");
    let page = Page::of(&std::fs::read_to_string(&html).unwrap());
    (page, serde_json::from_str(&said.out).unwrap())
}

#[test]
fn a_cloud_is_described() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let (page, json) = page_of("info", &bench, &[&input], 0);
    assert_eq!(
        page.number("points read"),
        json["input"]["read"].as_u64().unwrap()
    );
    assert_eq!(
        page.number("distinct points"),
        json["points"].as_u64().unwrap()
    );
    assert_eq!(
        page.number("duplicates"),
        json["duplicates"].as_u64().unwrap()
    );
    assert!(page.text.contains("No file names a reference system"));
    let pixels = page.pixels();
    assert_eq!(pixels.len(), 2);
    assert!(pixels.iter().all(|picture| picture.filled() > 0.1));
    // Generated clouds have no classes of their own: all are of one.
    let all = json["input"]["kept"].to_string();
    let classes: Vec<_> = page
        .table
        .iter()
        .filter(|row| row.len() == 3 && row[1] == all)
        .collect();
    assert_eq!(classes.len(), 1, "{:?}", page.table);
    let text = bench.cloud("land.xyz", &Cloud::new(Kind::Torus).points(3000));
    let (page, _) = page_of("info", &bench, &[&text], 0);
    assert!(page.pixels().iter().all(|picture| picture.filled() > 0.05));
    let (page, _) = page_of("info", &bench, &[&input, &text], 0);
    assert_eq!(page.heading, "2 files or folders");
}

/// An ASCII mesh.
fn ascii(vertices: &[[f64; 3]], faces: &[&[u32]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    for [x, y, z] in vertices {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for face in faces {
        let corners: Vec<_> = face.iter().map(u32::to_string).collect();
        writeln!(text, "{} {}", face.len(), corners.join(" ")).unwrap();
    }
    text
}

#[test]
fn defects_are_shown_where_they_are() {
    let bench = Bench::new();
    let mut vertices = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.5, 0.0, 1.0],
        [5.0, 5.0, 0.0],
        [6.0, 5.0, 0.0],
        [5.0, 6.0, 0.0],
        [f64::NAN, 0.0, 0.0],
        [4.0, 5.0, 0.0],
        [5.0, 4.0, 0.0],
    ];
    // Three triangles at the edge 0 1, two that run alike at 5 6, and fans that meet at 5.
    let faces: Vec<&[u32]> = vec![
        &[0, 1, 2],
        &[1, 0, 3],
        &[0, 1, 4],
        &[5, 6, 7],
        &[5, 9, 10],
        // What cannot be drawn does not keep the rest from being drawn.
        &[0, 1, 77],
        &[8, 1, 2],
        &[6, 6, 7],
    ];
    let mesh = bench.write("bad.ply", ascii(&vertices, &faces));
    let (page, json) = page_of("verify", &bench, &[&mesh], 1);
    assert_eq!(json["non_manifold_edges"], 1);
    assert_eq!(page.number("non-manifold edges"), 1);
    assert_eq!(page.number("degenerate triangles"), 1);
    let rows = page
        .table
        .iter()
        .filter(|row| row.len() == 3 && row[1].parse::<u32>().is_ok());
    let found: Vec<_> = rows
        .map(|row| (row[0].as_str(), row[1].as_str(), row[2].as_str()))
        .collect();
    assert!(
        found.contains(&("non-manifold edge", "1", "1  0  0")),
        "{found:?}"
    );
    assert!(
        found.contains(&("pinched vertex", "5", "5  5  0")),
        "{found:?}"
    );
    assert!(
        found.contains(&("degenerate triangle", "6", "6  5  0")),
        "{found:?}"
    );
    let pixels = page.pixels();
    assert_eq!(pixels.len(), 2);
    assert!(
        pixels
            .iter()
            .all(|picture| picture.filled() > 0.01 && picture.of(MAGENTA) > 30)
    );
    // A sound mesh has no marks, one without a triangle no picture.
    vertices.truncate(5);
    let mesh = bench.write("good.ply", ascii(&vertices[..3], &[&[0, 1, 2]]));
    let (page, _) = page_of("verify", &bench, &[&mesh], 0);
    assert!(page.pixels().iter().all(|picture| picture.of(MAGENTA) == 0));
    let mesh = bench.write("none.ply", ascii(&vertices, &[&[0, 0, 1]]));
    let (page, _) = page_of("verify", &bench, &[&mesh], 1);
    assert!(page.pictures.is_empty() && page.text.contains("no sound triangle"));
}

#[test]
fn distances_have_colours() {
    let bench = Bench::new();
    let input = bench.cloud("land.laz", &land());
    let mesh = bench.path("mesh.ply");
    util::reconstruct(&input, &mesh, &outcrop::params::Params::default());
    let (page, json) = page_of("compare", &bench, &[&mesh, &input], 0);
    assert_eq!(page.pictures.len(), 4);
    for (picture, least) in page.pixels().iter().zip([0.2, 0.1, 0.1, 0.05]) {
        assert!(picture.filled() > least, "{}", picture.filled());
        let blue = picture
            .rgba
            .chunks_exact(4)
            .filter(|p| p[3] == 255 && p[2] > p[0].max(p[1]))
            .count();
        assert!(blue > 1000, "{blue}");
    }
    let samples = page.table.iter().find(|row| row[0] == "samples").unwrap();
    for (cell, way) in samples[1..].iter().zip(["a_to_b", "b_to_a", "symmetric"]) {
        assert_eq!(*cell, json[way]["samples"].to_string());
    }
    // The same shape twice: no distance, and no scale.
    let (page, json) = page_of("compare", &bench, &[&input, &input], 0);
    assert_eq!(json["symmetric"]["max"], 0.0);
    assert_eq!(page.pictures.len(), 4);
}
