//! Surfaces with known topology are reconstructed with it.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::{MaxWidth, Params, Radius};
use outcrop_cloudgen::{Cloud, Kind, LasOptions};
use std::path::Path;

/// Checks that the mesh is one closed component of the right genus that uses every point.
fn closed(input: &Path, params: &Params, points: u64, euler: i64) {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let report = util::reconstruct(input, &mesh, params);
    let verdict = util::verdict(&mesh);
    assert!(verdict.manifold, "{verdict}");
    assert_eq!(verdict.components, 1, "{verdict}");
    assert_eq!(verdict.boundary_edges, 0, "{verdict}");
    assert_eq!(verdict.euler_characteristic, euler, "{verdict}");
    assert_eq!(report.points + report.duplicates_folded, points);
    assert_eq!(report.mesh.points_used, report.points, "unused points");
    assert_eq!(report.mesh.triangles, verdict.triangles);
    assert_eq!(report.mesh.vertices, verdict.vertices);
    assert_eq!(report.mesh.boundary_edges, 0);
    assert_eq!(report.holes_left, 0);
}

fn closed_surface(kind: Kind) {
    let bench = Bench::new();
    for seed in [1, 2] {
        let cloud = Cloud::new(kind).points(100_000).seed(seed);
        let input = bench.cloud("cloud.ply", &cloud);
        let euler = cloud.euler_characteristic().unwrap();
        closed(&input, &Params::default(), cloud.points, euler);
    }
}

#[test]
fn sphere() {
    closed_surface(Kind::Sphere);
}

#[test]
fn torus() {
    closed_surface(Kind::Torus);
}

#[test]
fn surface_of_genus_five() {
    closed_surface(Kind::Bumpy);
}

#[test]
fn closed_surfaces_on_a_coarse_grid() {
    let bench = Bench::new();
    for kind in [Kind::Sphere, Kind::Torus, Kind::Bumpy] {
        let cloud = Cloud::new(kind)
            .points(100_000)
            .seed(3)
            .offset([4e5, 5e6, 100.0]);
        let path = bench.path("cloud.laz");
        let options = LasOptions {
            scale: Some(0.05),
            ..LasOptions::default()
        };
        cloud
            .write(&path, outcrop_cloudgen::Format::Laz(options))
            .unwrap();
        closed(
            &path,
            &Params::default(),
            cloud.points,
            cloud.euler_characteristic().unwrap(),
        );
    }
}

#[test]
fn closed_surfaces_with_many_blocks() {
    let bench = Bench::new();
    let params = Params {
        block: 1500,
        ..Params::default()
    };
    for kind in [Kind::Sphere, Kind::Torus, Kind::Bumpy] {
        let cloud = Cloud::new(kind).points(50_000).seed(4);
        let input = bench.cloud("cloud.ply", &cloud);
        closed(
            &input,
            &params,
            cloud.points,
            cloud.euler_characteristic().unwrap(),
        );
    }
}

/// The bunny is closed except at its base, and closed if there are no limits of length; it has at most
/// `holes` holes before repair. The paper's method uses all points; when points are relaxed, some on the
/// sharpest ridges are not used.
fn bunny(name: &str, holes: u64) {
    let lid = Params {
        max_edge: MaxWidth::None,
        max_fill: MaxWidth::None,
        ..Params::default()
    };
    let params = [Params::paper(), lid];
    for (params, unused) in params.iter().zip([0, 5]) {
        bunny_with(name, holes, params, unused);
    }
}

fn bunny_with(name: &str, holes: u64, params: &Params, unused: u64) {
    let Some(scan) = util::scan(name) else { return };
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let report = util::reconstruct(&scan, &mesh, params);
    let verdict = util::verdict(&mesh);
    assert!(verdict.manifold, "{verdict}");
    assert_eq!(
        (verdict.components, verdict.boundary_edges),
        (1, 0),
        "{verdict}"
    );
    assert_eq!(verdict.euler_characteristic, 2, "{verdict}");
    assert!(report.mesh.points_used + unused >= report.points);
    util::reconstruct(
        &scan,
        &mesh,
        &Params {
            repair: false,
            ..params.clone()
        },
    );
    let verdict = util::verdict(&mesh);
    println!(
        "{name}: {} boundary loops before repair",
        verdict.boundary_loops
    );
    assert!(verdict.manifold, "{verdict}");
    assert!(verdict.boundary_loops <= holes, "{verdict}");
}

#[test]
fn small_bunny() {
    bunny("bunny-100k.ply", 84);
}

#[test]
fn large_bunny() {
    bunny("bunny-1m.ply", 177);
}

/// All cells of a regular grid agree with their neighbours: there are only T3, and no hole.
fn grid(columns: i64, [u, v]: [[i64; 3]; 2], params: &Params) {
    let bench = Bench::new();
    let mut points = Vec::new();
    for row in 0..columns {
        for column in 0..columns {
            points.push(std::array::from_fn(|k| (row * u[k] + column * v[k]) as f64));
        }
    }
    let input = bench.points("grid.xyz", &points);
    let mesh = bench.path("mesh.ply");
    let report = util::reconstruct(&input, &mesh, params);
    let verdict = util::verdict(&mesh);
    assert!(report.lattice.exact);
    assert_eq!(
        (report.triples.t2, report.triples.t1),
        (0, 0),
        "{u:?} {v:?}: {report:#?}"
    );
    let squares = ((columns - 1) * (columns - 1)) as u64;
    assert_eq!(report.triples.t3, 2 * squares, "{u:?} {v:?}");
    assert_eq!(report.base.flagged + report.base.mobius, 0);
    assert!(verdict.manifold, "{verdict}");
    assert_eq!(verdict.triangles, 2 * squares);
    assert_eq!(
        (verdict.boundary_loops, verdict.euler_characteristic),
        (1, 1),
        "{verdict}"
    );
    assert_eq!(verdict.vertices, (columns * columns) as u64);
}

#[test]
fn regular_grids_at_any_rotation() {
    let frames = [
        [[1, 0, 0], [0, 1, 0]],
        [[0, 0, 7], [7, 0, 0]],
        [[3, 4, 0], [-4, 3, 0]],
        [[2, 1, 2], [-2, 2, 1]],
        [[1, 2, -2], [2, 1, 2]],
        [[6, 2, 3], [-3, 6, 2]],
    ];
    for frame in frames {
        for block in [700, 1 << 16] {
            grid(
                60,
                frame,
                &Params {
                    block,
                    ..Params::default()
                },
            );
        }
    }
}

#[test]
fn large_regular_grids() {
    let bench = Bench::new();
    for rotated in [false, true] {
        let cloud = Cloud::new(Kind::Grid).points(100_000).rotated(rotated);
        let input = bench.cloud("grid.laz", &cloud);
        let mesh = bench.path("mesh.ply");
        let report = util::reconstruct(&input, &mesh, &Params::default());
        assert_eq!(
            (report.triples.t2, report.triples.t1),
            (0, 0),
            "{:?}",
            report.triples
        );
        let verdict = util::verdict(&mesh);
        assert!(verdict.manifold, "{verdict}");
        assert_eq!(
            (verdict.boundary_loops, verdict.euler_characteristic),
            (1, 1),
            "{verdict}"
        );
        assert_eq!(verdict.vertices, 100_000);
    }
}

/// T3 with the automatic radius and with 5 % of the diagonal.
fn t3_by_radius(cloud: &Cloud) -> (u64, u64) {
    let bench = Bench::new();
    let input = bench.cloud("cloud.ply", cloud);
    let run = |radius| {
        let params = Params {
            radius,
            ..Params::default()
        };
        util::reconstruct(&input, &bench.path("mesh.ply"), &params)
    };
    let (auto, large) = (run(Radius::Auto), run(Radius::Percent(5.0)));
    (auto.triples.t3, large.triples.t3)
}

#[test]
fn the_automatic_radius_finds_what_a_large_one_finds() {
    // Open surfaces too: a large disk contains even the flattest triangles of an outline.
    for kind in [
        Kind::Sphere,
        Kind::Torus,
        Kind::Bumpy,
        Kind::Plane,
        Kind::Terrain,
    ] {
        let (found, wanted) = t3_by_radius(&Cloud::new(kind).points(50_000).seed(5));
        assert!(
            found as f64 >= 0.999 * wanted as f64,
            "{kind}: {found} of {wanted}"
        );
    }
}
