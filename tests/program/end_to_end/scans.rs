//! Real scans become manifold meshes.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::Params;
use std::path::Path;

/// Checks that the mesh has no defect and agrees with the report.
fn manifold(scan: &Path, params: &Params) {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let report = util::reconstruct(scan, &mesh, params);
    let verdict = util::verdict(&mesh);
    println!(
        "{} (smooth {}, repair {}): {} points, {} triangles, T3 {}, T12 {}, {} global fallbacks",
        scan.display(),
        params.smooth,
        params.repair,
        report.points,
        verdict.triangles,
        report.triples.t3,
        report.triples.t2 + report.triples.t1,
        report.cells.global_fallbacks,
    );
    assert!(verdict.manifold, "{}: {verdict}", scan.display());
    assert_eq!(verdict.triangles, report.mesh.triangles);
    assert_eq!(verdict.vertices, report.mesh.vertices);
    assert_eq!(verdict.boundary_edges, report.mesh.boundary_edges);
    assert_eq!(verdict.zero_area_triangles, 0, "{}", scan.display());
    // A surface, and not only some fragments of it.
    assert!(report.mesh.points_used * 4 > report.points, "{report:?}");
}

fn all_ways(name: &str) {
    let Some(scan) = util::scan(name) else { return };
    manifold(&scan, &Params::default());
    manifold(
        &scan,
        &Params {
            repair: false,
            ..Params::default()
        },
    );
}

#[test]
fn facades() {
    all_ways("facades.laz");
}

#[test]
fn pine() {
    all_ways("pine.laz");
}

#[test]
fn topography() {
    all_ways("topography.laz");
}

#[test]
fn lion() {
    all_ways("lion.laz");
}

#[test]
fn bunny_range() {
    all_ways("bunny-range.ply");
}

#[test]
fn bunny() {
    all_ways("bunny-100k.ply");
}

#[test]
fn lone_star() {
    all_ways("lone-star.laz");
}

#[test]
fn lone_star_split() {
    all_ways("lone-star-split");
}

#[test]
fn forest() {
    all_ways("forest-1.laz");
    all_ways("forest-2.laz");
}

#[test]
fn smoothed_scans() {
    for name in ["lion.laz", "bunny-range.ply"] {
        let Some(scan) = util::scan(name) else {
            continue;
        };
        manifold(
            &scan,
            &Params {
                smooth: outcrop::Smooth::Rounds(1),
                ..Params::default()
            },
        );
    }
}
