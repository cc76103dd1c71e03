//! `--crop`: what is written is the part of the whole mesh that the rules name.

use crate::end_to_end::scanners::read;
use crate::end_to_end::util::{self, Bench};
use outcrop::params::{Params, Region};
use outcrop::report::Report;
use outcrop_cloudgen::{Cloud, Kind, Odd};
use outcrop_ply::Mesh;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A corner, by the bits of its coordinates.
pub type Corner = [u64; 3];

/// All triangles, as positions in their orientation from the smallest on; sorted.
pub fn triangles(mesh: &Mesh) -> Vec<[Corner; 3]> {
    let at = |v: u32| mesh.vertices[v as usize].map(f64::to_bits);
    let from_smallest = |t: &[u32; 3]| {
        let mut t = t.map(at);
        let first = (0..3).min_by_key(|n| t[*n]).unwrap();
        t.rotate_left(first);
        t
    };
    let mut all: Vec<_> = mesh.triangles.iter().map(from_smallest).collect();
    all.sort_unstable();
    all
}

/// Points all through a box: open boundaries, pinched vertices, many blocks.
pub fn volume(bench: &Bench) -> PathBuf {
    bench.cloud(
        "cloud.laz",
        &Cloud::new(Kind::Odd(Odd::Volume)).points(12_000),
    )
}

pub fn params() -> Params {
    // The vertices are where single precision has them exactly.
    Params {
        block: 3000,
        smooth: outcrop::Smooth::Rounds(0),
        ..Params::default()
    }
}

/// Bounds of the vertices.
pub fn bounds(mesh: &Mesh) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for v in &mesh.vertices {
        for axis in 0..3 {
            bounds[0][axis] = bounds[0][axis].min(v[axis]);
            bounds[1][axis] = bounds[1][axis].max(v[axis]);
        }
    }
    bounds
}

/// A place between the lowest and the highest coordinate.
fn between(bounds: &[[f64; 3]; 2], axis: usize, share: f64) -> f64 {
    bounds[0][axis] + share * (bounds[1][axis] - bounds[0][axis])
}

pub fn boundary_edges(mesh: &Mesh) -> u64 {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for [x, y] in [[a, b], [b, c], [c, a]] {
            *edges.entry([*x.min(y), *x.max(y)]).or_default() += 1;
        }
    }
    edges.values().filter(|n| **n == 1).count() as u64
}

fn check(path: &Path, report: &Report) {
    let mesh = read(path);
    let stats = &report.mesh;
    assert_eq!(mesh.triangles.len() as u64, stats.triangles);
    assert_eq!(mesh.vertices.len() as u64, stats.vertices);
    assert_eq!(boundary_edges(&mesh), stats.boundary_edges);
    assert!(util::verdict(path).manifold);
}

#[test]
fn with_a_margin_around_everything_a_crop_is_what_is_inside_of_the_whole_mesh() {
    let bench = Bench::new();
    let (input, whole) = (volume(&bench), bench.path("whole.ply"));
    util::reconstruct(&input, &whole, &params());
    let whole = read(&whole);
    let around = bounds(&whole);
    let at = |axis, share| between(&around, axis, share);
    let (x, y) = (|s| at(0, s), |s| at(1, s));
    let flat = format!("{},{},{},{}", x(0.2), y(0.3), x(0.7), y(0.6));
    let solid = format!(
        "{},{},{},{},{},{}",
        x(-0.5),
        y(0.1),
        at(2, 0.2),
        x(0.8),
        y(2.0),
        at(2, 0.6)
    );
    let star = format!(
        "MULTIPOLYGON((({} {},{} {},{} {},{} {},{} {})),(({} {},{} {},{} {})))",
        x(0.5),
        y(0.9),
        x(0.2),
        y(0.1),
        x(0.9),
        y(0.6),
        x(0.1),
        y(0.6),
        x(0.8),
        y(0.1),
        x(0.0),
        y(0.8),
        x(0.2),
        y(1.0),
        x(0.0),
        y(1.0),
    );
    for text in [flat, solid, star] {
        let region: Region = text.parse().unwrap();
        let area = region.area();
        let inside = |t: &[u32; 3]| t.iter().all(|v| area.contains(whole.vertices[*v as usize]));
        let kept = whole.triangles.iter().filter(|t| inside(t)).copied();
        let expected = Mesh {
            vertices: whole.vertices.clone(),
            triangles: kept.collect(),
            ..Mesh::default()
        };
        let output = bench.path("crop.ply");
        let cropped = Params {
            crop: Some(region.clone()),
            crop_margin: Some(1e9),
            ..params()
        };
        let report = util::reconstruct(&input, &output, &cropped);
        let mesh = read(&output);
        assert!(
            mesh.triangles.len() > 300 && report.mesh.pinched_copies > 0,
            "{text}"
        );
        assert!(triangles(&mesh) == triangles(&expected), "{text}");
        let left = (whole.triangles.len() - mesh.triangles.len()) as u64;
        assert_eq!(report.cut.triangles_outside, left);
        assert_eq!(report.input.dropped_by_crop, 0);
        check(&output, &report);
    }
}

#[test]
fn a_crop_is_the_same_for_any_threads_memory_tiles_pages_and_inputs() {
    let bench = Bench::new();
    let input = volume(&bench);
    let cloud = Cloud::new(Kind::Odd(Odd::Volume)).points(12_000);
    let plain = bench.cloud("cloud.las", &cloud);
    let output = bench.path("crop.ply");
    let first = util::reconstruct(&input, &output, &params());
    let [min, max] = [first.input.files[0].min, first.input.files[0].max].map(Option::unwrap);
    let side = |axis: usize, share: f64| min[axis] + share * (max[axis] - min[axis]);
    let region = [side(0, 0.3), side(1, 0.3), side(0, 0.8), side(1, 0.7)];
    let cropped = Params {
        crop: Some(Region::of_numbers(&region).unwrap()),
        ..params()
    };
    let report = util::reconstruct(&input, &output, &cropped);
    let input_stats = &report.input;
    assert!(input_stats.kept < 9000 && input_stats.kept > 1500);
    assert_eq!(
        input_stats.kept + input_stats.dropped_by_crop,
        input_stats.read
    );
    check(&output, &report);
    let expected = util::hash(&output);
    for (threads, memory, tile, page, input) in [
        (1, 192, 700, 64, &input),
        (3, 512, 3000, 1000, &input),
        (2, 192, 1500, 256, &plain),
    ] {
        let run = util::builder(std::slice::from_ref(input), &output, &cropped)
            .threads(threads)
            .memory(memory << 20)
            .tile_points(tile)
            .page_points(page);
        run.build().unwrap().run().unwrap();
        assert_eq!(
            util::hash(&output),
            expected,
            "{threads} {memory} {tile} {page}"
        );
    }
}

#[test]
fn a_region_without_points_or_triangles_is_an_error_that_tells_where_they_are() {
    let bench = Bench::new();
    let input = bench.points(
        "a.xyz",
        &[[1.0, 2.0, 3.0], [4.0, 2.5, 3.0], [2.0, 9.0, -1.5]],
    );
    let (input, output) = (input.to_str().unwrap(), bench.path("m.ply"));
    let run = |region: &str| {
        let arguments = [
            "reconstruct",
            input,
            "-o",
            output.to_str().unwrap(),
            "--crop",
        ];
        util::run(arguments.iter().copied().chain([region]))
    };
    let said = run("100,100,200,200");
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(
        said.err.contains("no point is in the box 100,100,200,200"),
        "{said:?}"
    );
    assert!(said.err.contains("between 1,2,-1.5 and 4,9,3"), "{said:?}");
    for (region, why) in [
        ("0,0,1", "minx,miny,maxx,maxy"),
        ("5,0,1,1", "lowest x below"),
        ("0,0,nan,1", "NaN"),
        ("nothing.wkt", "neither numbers nor a file"),
        (input, "WKT or GeoJSON"),
    ] {
        let said = run(region);
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(said.err.contains(why), "{region}: {said:?}");
    }
    let outline = bench.write("outline.wkt", "POLYGON((-50 -50, 50 -50, 50 -49, -50 -50))");
    let said = run(outline.to_str().unwrap());
    assert!(said.err.contains("no point is in 1 polygon"), "{said:?}");
    assert!(!output.exists());
    // Points within the margin alone make no triangle.
    let cloud = bench.cloud("grid.las", &Cloud::new(Kind::Terrain).points(3000));
    let inside = Params {
        crop: Some(Region::of_numbers(&[-1e4, -1e4, -9e3, -9e3]).unwrap()),
        crop_margin: Some(1e9),
        ..Params::default()
    };
    let run = util::builder(&[cloud], &output, &inside).build().unwrap();
    let error = run.run().unwrap_err().to_string();
    assert!(error.contains("outside the box"), "{error}");
    assert!(
        util::listing(bench.folder())
            .iter()
            .all(|name| !name.contains("outcrop"))
    );
}
