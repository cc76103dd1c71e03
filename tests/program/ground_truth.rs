//! Meshes of generated clouds against the surfaces of which the points are measurements: small clouds, the
//! program's own settings, and bounds that must hold. `scripts/ground-truth` prints all measures.

use outcrop_cloudgen::{Cloud, Generator, Kind, Measuring, Scene};
use outcrop_truth::{Measures, Options, Truth, read_mesh, read_seen};
use std::path::Path;
use std::process::Command;

/// What must be true of a mesh.
#[derive(Debug, Clone, Copy)]
enum Bound {
    /// Mean angle to the true normal, in degrees, at most.
    Angle(f64),
    /// The same, at most this much more than with `--smooth 0`.
    AngleOverUnsmoothed(f64),
    /// Number of boundary edges.
    Boundary(u64),
    /// Share of the seen surface that has mesh beside it, at least.
    Complete(f64),
    /// Number of pieces.
    Components(u64),
    /// Euler characteristic.
    Euler(i64),
    /// Share that faces the wrong way, at most.
    Wrong(f64),
}

use Bound::{Angle, AngleOverUnsmoothed, Boundary, Complete, Components, Euler, Wrong};

/// A cloud, and the bounds of its mesh.
struct Case {
    name: &'static str,
    scene: Scene,
    points: u64,
    /// Noise in spacings.
    noise: f64,
    ratio: Option<f64>,
    bounds: &'static [Bound],
}

/// A case of a scene without a ratio.
const fn case(
    name: &'static str,
    scene: Scene,
    points: u64,
    noise: f64,
    bounds: &'static [Bound],
) -> Case {
    Case {
        name,
        scene,
        points,
        noise,
        ratio: None,
        bounds,
    }
}

/// A case without noise, of a scene with a ratio.
const fn shape(
    name: &'static str,
    scene: Scene,
    points: u64,
    ratio: f64,
    bounds: &'static [Bound],
) -> Case {
    Case {
        name,
        scene,
        points,
        noise: 0.0,
        ratio: Some(ratio),
        bounds,
    }
}

/// The bounds: all of them are here.
const CASES: &[Case] = &[
    case(
        "noise 0.25",
        Scene::Edged,
        40_000,
        0.25,
        &[Angle(8.0), Boundary(0), Euler(2)],
    ),
    case(
        "noise 0.5",
        Scene::Edged,
        40_000,
        0.5,
        &[Angle(9.0), Boundary(0), Euler(2)],
    ),
    case(
        "noise 1.0",
        Scene::Edged,
        40_000,
        1.0,
        &[Angle(10.0), Boundary(0), Euler(2)],
    ),
    case(
        "clean edged body",
        Scene::Edged,
        40_000,
        0.0,
        &[AngleOverUnsmoothed(0.1), Boundary(0), Euler(2)],
    ),
    shape(
        "clean round body",
        Scene::SparseCap,
        20_000,
        1.0,
        &[AngleOverUnsmoothed(0.1), Boundary(0), Euler(2)],
    ),
    shape(
        "sparse cap, ratio 5",
        Scene::SparseCap,
        6_156,
        5.0,
        &[Boundary(0)],
    ),
    shape(
        "density jump, ratio 7",
        Scene::DensityJump,
        29_192,
        7.0,
        &[Components(1), Complete(0.995)],
    ),
    shape(
        "thin plate of 3 spacings",
        Scene::ThinPlate,
        20_000,
        3.0,
        &[Boundary(0), Euler(2)],
    ),
    shape(
        "thin plate of 2.5 spacings",
        Scene::ThinPlate,
        20_000,
        2.5,
        &[Boundary(0)],
    ),
    shape(
        "voxel slab of 2 steps",
        Scene::VoxelSlab,
        12_642,
        2.0,
        &[Boundary(0), Euler(2)],
    ),
    case(
        "voxel cube",
        Scene::VoxelCube,
        9_602,
        0.0,
        &[Boundary(0), Euler(2)],
    ),
    case(
        "mobile scanner's lines",
        Scene::MobileScan,
        50_000,
        0.11,
        &[Wrong(0.01)],
    ),
];

/// The points of a case.
fn points(case: &Case) -> Generator {
    let measuring = Measuring {
        noise: case.noise,
        ratio: case.ratio,
        ..Measuring::EXACT
    };
    let cloud = Cloud::new(Kind::Scene(case.scene)).points(case.points);
    cloud.measuring(measuring).generator().unwrap()
}

/// The mesh of a cloud, measured.
fn measured(folder: &Path, truth: &Truth, more: &[&str]) -> Measures {
    let [cloud, mesh] = ["cloud.ply", "mesh.ply"].map(|name| folder.join(name));
    let done = Command::new(env!("CARGO_BIN_EXE_outcrop"))
        .arg("reconstruct")
        .arg(&cloud)
        .arg("-o")
        .arg(&mesh)
        .args(["--quiet", "--threads", "2", "--memory", "192MiB"])
        .args(more)
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let measures = truth.measure(&read_mesh(&mesh).unwrap());
    std::fs::remove_file(&mesh).unwrap();
    measures
}

/// What the mesh of a case violates.
fn violations(case: &Case) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let [surface, seen] = ["truth.ply", "seen.ply"].map(|name| folder.join(name));
    let points = points(case);
    points
        .write(folder.join("cloud.ply"), "ply".parse().unwrap())
        .unwrap();
    points.write_reference(&surface, 1e-4).unwrap();
    points.write_seen(&seen).unwrap();
    let options = Options {
        samples: 20_000,
        neighbors: if case.scene == Scene::MobileScan {
            40
        } else {
            12
        },
        local: case.scene.is_uneven(),
        ..Options::default()
    };
    let truth = Truth::new(
        &read_mesh(&surface).unwrap(),
        &read_seen(&seen).unwrap(),
        options,
    );
    let m = measured(folder, &truth, &[]);
    println!("{}: {m:?}", case.name);
    let broken = |bound: &Bound| {
        let (holds, found) = match *bound {
            Angle(most) => (m.angle <= most, format!("{:.1}", m.angle)),
            AngleOverUnsmoothed(most) => {
                let plain = measured(folder, &truth, &["--smooth", "0"]).angle;
                let found = format!("{:.2} after {plain:.2}", m.angle);
                (m.angle <= plain + most, found)
            }
            Boundary(count) => (m.boundary == count, m.boundary.to_string()),
            Complete(least) => (m.complete >= least, format!("{:.4}", m.complete)),
            Components(count) => (m.components == count, m.components.to_string()),
            Euler(number) => (m.euler == number, m.euler.to_string()),
            Wrong(most) => (m.wrong <= most, format!("{:.4}", m.wrong)),
        };
        (!holds).then(|| format!("{}: {found}, expected {bound:?}", case.name))
    };
    case.bounds.iter().filter_map(broken).collect()
}

#[test]
fn meshes_are_as_near_to_the_truth_as_they_must_be() {
    let wrong: Vec<String> = CASES.iter().flat_map(violations).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
