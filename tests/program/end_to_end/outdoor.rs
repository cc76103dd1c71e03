//! Outdoor worlds with known ground: open ground faces up and has no boundary, and there are no sails over
//! it.

use crate::end_to_end::util::{self, Bench};
use outcrop::Params;
use outcrop_cloudgen::{Cloud, GroundReport, Kind, NoiseMode, Objects};

/// A world of many blocks with a noise of half a spacing, reconstructed and measured.
fn measured(seed: u64, objects: Objects, outliers: f64) -> GroundReport {
    let bench = Bench::new();
    let cloud = Cloud::new(Kind::Outdoor)
        .points(1_000_000)
        .seed(seed)
        .noise(0.19)
        .noise_mode(NoiseMode::Isotropic)
        .outliers(outliers)
        .objects(objects);
    let input = bench.cloud("world.ply", &cloud);
    let mesh = bench.path("mesh.ply");
    let params = Params {
        block: 16_384,
        ..Params::default()
    };
    util::reconstruct(&input, &mesh, &params);
    let report = cloud.measure_mesh(&mesh).unwrap();
    assert!(report.open_area > 60_000.0, "{report:?}");
    report
}

/// Walls and trees make the surface non-orientable at their ends; the ground is not cut for that.
#[test]
fn open_ground_is_whole_and_faces_up() {
    let objects = Objects {
        trees: 1200,
        ..Objects::default()
    };
    let report = measured(3, objects, 0.0);
    assert!(report.open_boundary_edges <= 5, "{report:?}");
    assert!(report.open_down_share <= 0.003, "{report:?}");
}

/// Birds and wires are not connected with each other or the ground.
#[test]
fn nothing_hangs_over_the_ground() {
    let objects = Objects {
        wires: 4,
        ..Objects::default()
    };
    let report = measured(5, objects, 0.0005);
    assert!(report.open_boundary_edges <= 5, "{report:?}");
    assert!(report.open_down_share <= 0.003, "{report:?}");
    // Without limits of length the area is 2000.
    // Sparse walls may have long triangles at their feet.
    assert!(report.open_sail_area <= 500.0, "{report:?}");
}
