//! Measures of meshes that are known.

use outcrop_cloudgen::{Cloud, Kind, Scene};
use outcrop_ply::Mesh;
use outcrop_truth::{Measures, Options, Truth, read_mesh, read_seen};

/// The truth of a uniform sample of the edged body, and its surface.
fn truth() -> (Truth, Mesh) {
    let folder = tempfile::tempdir().unwrap();
    let [surface, seen] = ["truth.ply", "seen.ply"].map(|name| folder.path().join(name));
    let cloud = Cloud::new(Kind::Scene(Scene::Edged)).points(8000);
    let points = cloud.generator().unwrap();
    points.write_reference(&surface, 1e-3).unwrap();
    points.write_seen(&seen).unwrap();
    let surface = read_mesh(&surface).unwrap();
    let options = Options {
        samples: 20_000,
        ..Options::default()
    };
    (
        Truth::new(&surface, &read_seen(&seen).unwrap(), options),
        surface,
    )
}

fn moved(mesh: &Mesh, by: [f64; 3]) -> Mesh {
    let move_one = |v: &[f64; 3]| std::array::from_fn(|k| v[k] + by[k]);
    Mesh {
        vertices: mesh.vertices.iter().map(move_one).collect(),
        ..mesh.clone()
    }
}

#[test]
fn the_truth_itself_is_right_in_all_measures() {
    let (truth, surface) = truth();
    let found = truth.measure(&surface);
    assert!(found.accuracy[3] < 1e-9 && found.completeness[3] < 1e-9);
    assert!(found.seen > 0.99 && found.f > 0.9999, "{found:?}");
    let Measures {
        complete,
        sided,
        wrong,
        spurious,
        bent,
        ..
    } = found;
    assert_eq!((complete, sided, wrong, spurious), (1.0, 1.0, 0.0, 0.0));
    // Samples on an edge are as near to the other side of it.
    assert!(found.angle < 0.1 && bent < 0.01, "{found:?}");
    assert_eq!((found.boundary, found.nonmanifold, found.turned), (0, 0, 0));
    assert_eq!((found.components, found.euler), (1, 2));
}

#[test]
fn what_is_wrong_with_a_mesh_is_in_its_measure() {
    let (truth, surface) = truth();
    let turned = surface.triangles.iter().map(|[a, b, c]| [*a, *c, *b]);
    let turned = Mesh {
        triangles: turned.collect(),
        ..surface.clone()
    };
    let found = truth.measure(&turned);
    assert!(found.wrong > 0.99 && found.sided < 0.01 && found.angle < 0.1);
    assert_eq!(found.complete, 1.0);

    let far = moved(&surface, [0.0, 0.0, 1000.0]);
    let found = truth.measure(&far);
    assert_eq!((found.f, found.complete, found.spurious), (0.0, 0.0, 1.0));

    // Twice, the second far away: half of the mesh is spurious.
    let mut twice = surface.clone();
    let first = twice.vertices.len() as u32;
    twice.vertices.extend(&far.vertices);
    twice
        .triangles
        .extend(far.triangles.iter().map(|t| t.map(|v| v + first)));
    let found = truth.measure(&twice);
    assert!((found.spurious - 0.5).abs() < 0.02, "{found:?}");
    assert_eq!((found.complete, found.components, found.euler), (1.0, 2, 4));

    let near = moved(&surface, [0.0, 0.0, 0.5 * truth.spacing()]);
    let found = truth.measure(&near);
    assert!((found.accuracy[3] - 0.5).abs() < 0.01, "{found:?}");

    let mut open = surface;
    open.triangles.truncate(open.triangles.len() / 2);
    let found = truth.measure(&open);
    assert!(found.boundary > 0 && found.complete < 0.9, "{found:?}");
    assert!(found.accuracy[3] < 1e-9);
}

#[test]
fn a_mesh_without_triangles_has_measures() {
    let (truth, _) = truth();
    let found = truth.measure(&Mesh::default());
    assert_eq!((found.f, found.complete, found.triangles), (0.0, 0.0, 0));
}
