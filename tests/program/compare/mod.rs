//! `compare` on shapes whose distances are known, against brute force on random ones, and under
//! different limits.

mod brute;

use brute::Mesh;
use outcrop::Error;
use outcrop::inspect::compare::{Comparison, Kind, Options, compare, distances};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn workspace(budget: u64, threads: usize) -> Workspace {
    let memory = MemoryPool::new(budget).unwrap();
    let parent = std::env::temp_dir();
    Workspace::new(&parent, memory, threads, Arc::new(Silent), Cancel::new()).unwrap()
}

fn small() -> Workspace {
    workspace(MINIMUM_BUDGET, 2)
}

/// A folder for the files of one test.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn mesh(&self, name: &str, mesh: &Mesh) -> PathBuf {
        self.write(name, mesh.ply())
    }

    fn points(&self, name: &str, points: &[[f64; 3]]) -> PathBuf {
        let mesh = Mesh {
            positions: points.to_vec(),
            triangles: Vec::new(),
        };
        self.write(name, mesh.ply())
    }
}

fn between(a: &Path, b: &Path, samples: u64) -> Comparison {
    let workspace = small();
    let options = Options { samples, seed: 7 };
    let found = compare(a, b, &options, &workspace).unwrap();
    assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    found
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

fn square(z: f64) -> Mesh {
    Mesh {
        positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| [x, y, z])
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn cube() -> Mesh {
    let positions = (0..8u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from));
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh {
        positions: positions.collect(),
        triangles: halves.collect(),
    }
}

#[test]
fn squares_one_above_the_other() {
    let bench = Bench::new();
    let a = bench.mesh("a.ply", &square(0.0));
    let b = bench.mesh("b.ply", &square(0.25));
    let found = between(&a, &b, 5000);
    assert_eq!(
        (found.a.kind, found.a.triangles, found.a.points),
        (Kind::Mesh, 2, 4)
    );
    assert!(near(found.a.area, 1.0));
    assert!(near(found.diagonal, 2f64.sqrt()));
    for way in [found.a_to_b, found.b_to_a] {
        assert_eq!((way.samples, way.vertex_samples), (5000, 4));
    }
    assert_eq!(
        (found.symmetric.samples, found.symmetric.vertex_samples),
        (10_000, 8)
    );
    for way in [found.a_to_b, found.b_to_a, found.symmetric] {
        for (name, value) in way.figures.named() {
            assert!(near(value, 0.25), "{name} {value}");
        }
        for (name, value) in way.percent.unwrap().named() {
            assert!(near(value, 25.0 / 2f64.sqrt()), "{name} {value}");
        }
    }
}

#[test]
fn squares_side_by_side() {
    let bench = Bench::new();
    let a = bench.mesh("a.ply", &square(0.0));
    let mut shifted = square(0.0);
    shifted.positions.iter_mut().for_each(|p| p[0] += 1.0);
    let b = bench.mesh("b.ply", &shifted);
    let samples = 200_000;
    let found = between(&a, &b, samples);
    // The distance of (x, y) is 1 − x: uniform, and the samples are evenly distributed.
    let figures = found.a_to_b.figures;
    assert!(near(figures.max, 1.0), "{figures:?}");
    assert_eq!(found.a_to_b.max_at[0], 0.0);
    let close = |value: f64, want: f64| assert!((value - want).abs() < 3e-3, "{value} {want}");
    close(figures.mean, 0.5);
    close(figures.rms, (1f64 / 3.0).sqrt());
    close(figures.p50, 0.5);
    close(figures.p90, 0.9);
    close(figures.p99, 0.99);
    close(figures.p99_9, 0.999);
    close(found.b_to_a.figures.mean, 0.5);
}

#[test]
fn a_cube_and_its_corners() {
    let bench = Bench::new();
    let mesh = bench.mesh("cube.ply", &cube());
    let corners = bench.points("corners.ply", &cube().positions);
    let found = between(&mesh, &corners, 100_000);
    assert_eq!(
        (found.b.kind, found.b.points, found.b.triangles),
        (Kind::Cloud, 8, 0)
    );
    assert!(near(found.a.area, 6.0));
    // All corners are on the cube.
    assert_eq!(found.b_to_a.samples, 8);
    assert!(
        found
            .b_to_a
            .figures
            .named()
            .iter()
            .all(|(_, value)| *value == 0.0)
    );
    // The middle of a side is the farthest from any corner; the mean is that of a square's quarter: (√2 +
    // ln(1 + √2)) / 3 for a unit square, half of that here.
    let figures = found.a_to_b.figures;
    let middle = 0.5f64.sqrt();
    assert!(
        figures.max <= middle && figures.max > middle - 0.02,
        "{figures:?}"
    );
    let mean = (2f64.sqrt() + (1.0 + 2f64.sqrt()).ln()) / 6.0;
    assert!((figures.mean - mean).abs() < 2e-3, "{figures:?} {mean}");
    // The only sample is a vertex, and then vertices count.
    let found = between(&mesh, &corners, 1);
    assert_eq!((found.a_to_b.samples, found.a_to_b.vertex_samples), (1, 0));
    assert_eq!(found.a_to_b.figures.max, 0.0);
}

#[test]
fn a_sphere_and_its_centre() {
    let bench = Bench::new();
    let sphere = bench.mesh("sphere.ply", &brute::sphere(60));
    let centre = bench.write("centre.xyz", "0 0 0\n");
    let found = between(&sphere, &centre, 50_000);
    assert!(near(found.a_to_b.figures.max, 1.0), "{found:?}");
    assert!(found.a_to_b.figures.p50 > 0.997, "{found:?}");
    let inner = found.b_to_a.figures.max;
    assert!((0.997..1.0).contains(&inner), "{inner}");
}

#[test]
fn a_shape_and_itself() {
    let bench = Bench::new();
    let mesh = bench.mesh("mesh.ply", &brute::sphere(40));
    let found = between(&mesh, &mesh, 20_000);
    assert!(found.symmetric.figures.max < 1e-14, "{found:?}");
    let points = bench.points("points.ply", &brute::sphere(40).positions);
    let found = between(&points, &points, 20_000);
    assert_eq!(found.symmetric.figures.max, 0.0);
    assert_eq!(found.a.points, found.a_to_b.samples);
    // A cloud of one point has no diagonal.
    let one = bench.write("one.xyz", "1 2 3\n1 2 3\n");
    let found = between(&one, &one, 10);
    assert_eq!((found.a.points, found.a_to_b.percent), (1, None));
}

#[test]
fn unused_vertices_and_empty_triangles() {
    let bench = Bench::new();
    let mut odd = square(0.0);
    // These two vertices are unused; a point and a segment are triangles without area.
    odd.positions
        .extend([[9.0, 9.0, 9.0], [f64::NAN, 0.0, 0.0]]);
    odd.positions.push([3.0, 0.0, 0.0]);
    odd.triangles.extend([[6, 6, 6], [1, 6, 1]]);
    let a = bench.mesh("a.ply", &odd);
    let b = bench.mesh("b.ply", &square(0.0));
    let found = between(&a, &b, 1000);
    assert_eq!((found.a.points, found.a.triangles), (5, 4));
    assert_eq!(
        (found.a.max, found.a_to_b.figures.max),
        ([3.0, 1.0, 0.0], 2.0)
    );
    assert!(found.b_to_a.figures.max < 1e-15);
    // A mesh without area is sampled at its vertices, and they count.
    odd.triangles.drain(..2);
    let a = bench.mesh("flat.ply", &odd);
    let found = between(&a, &b, 1000);
    assert_eq!((found.a_to_b.samples, found.a_to_b.vertex_samples), (2, 0));
    assert_eq!((found.a_to_b.figures.mean, found.a.area), (1.0, 0.0));
}

#[test]
fn a_subset_has_the_size_asked_for() {
    let bench = Bench::new();
    let sphere = brute::sphere(40);
    let mesh = bench.mesh("mesh.ply", &sphere);
    let cloud = bench.points("points.ply", &sphere.positions);
    for samples in [1, 2, 7, 500, 1000] {
        let found = between(&mesh, &cloud, samples);
        assert_eq!(found.most_samples, samples);
        assert_eq!(found.a_to_b.samples, samples);
        let vertices = if samples == 1 { 0 } else { samples.div_ceil(2) };
        assert_eq!(found.a_to_b.vertex_samples, vertices);
        assert_eq!(
            (found.b_to_a.samples, found.b_to_a.vertex_samples),
            (samples, 0)
        );
    }
    let workspace = small();
    let with = |seed| {
        let options = Options { samples: 100, seed };
        compare(&mesh, &cloud, &options, &workspace).unwrap()
    };
    assert_eq!(with(3), with(3));
    assert_ne!(with(3).a_to_b, with(4).a_to_b);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]
    #[test]
    fn as_brute_force(
        positions in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 3..60),
        picks in prop::collection::vec([0usize..60, 0usize..60, 0usize..60], 1..400),
        points in prop::collection::vec(prop::array::uniform3(-2.0..2.0f64), 1..400),
        scale in 0.01..1.0f64,
    ) {
        let bench = Bench::new();
        // Some triangles are small, some as large as the box.
        let mut soup = Mesh::default();
        for (n, pick) in picks.iter().enumerate() {
            let shrink = if n % 3 == 0 { 1.0 } else { scale };
            let [a, b, c] = pick.map(|v| positions[v % positions.len()]);
            let towards = |p: [f64; 3]| [0, 1, 2].map(|i| a[i] + shrink * (p[i] - a[i]));
            let first = soup.positions.len() as u32;
            soup.positions.extend([a, towards(b), towards(c)]);
            soup.triangles.push([first, first + 1, first + 2]);
        }
        let mesh = bench.mesh("soup.ply", &soup);
        let cloud = bench.points("points.ply", &points);
        let workspace = small();
        let mut seen = Vec::new();
        let count = distances(&cloud, &mesh, &workspace, |m| { seen.push(m); Ok(()) }).unwrap();
        prop_assert_eq!(count as usize, seen.len());
        prop_assert!(seen.iter().zip(0..).all(|(m, i)| m.index == i));
        for m in &seen {
            let want = soup.distance(m.position);
            prop_assert!((m.distance - want).abs() < 1e-9, "{m:?} {want}");
        }
        let mut all: Vec<_> = seen.iter().map(|m| m.distance).collect();
        all.sort_by(f64::total_cmp);
        let found = between(&cloud, &mesh, 1_000_000).a_to_b;
        let rank = |share: f64| all[((all.len() as f64 * share).ceil() as usize).max(1) - 1];
        prop_assert_eq!(found.samples as usize, all.len());
        prop_assert_eq!(found.figures.max, all[all.len() - 1]);
        prop_assert_eq!([found.figures.p50, found.figures.p90], [rank(0.5), rank(0.9)]);
        prop_assert_eq!(found.figures.p99, rank(0.99));
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        prop_assert!((found.figures.mean - mean).abs() < 1e-12);
        // And to the points themselves.
        let corners = bench.points("corners.ply", &soup.positions);
        distances(&cloud, &corners, &workspace, |m| {
            let want = brute::nearest(&soup.positions, m.position);
            // Random doubles are not multiples of a step: a cloud keeps 30 bits of its extent.
            assert!((m.distance - want).abs() < 1e-8, "{m:?} {want}");
            Ok(())
        }).unwrap();
    }
}

#[test]
fn limits_do_not_change_the_answer() {
    let bench = Bench::new();
    let mesh = bench.write("mesh.ply", brute::sphere(710).binary());
    let mut points = brute::sphere(500);
    points.triangles.clear();
    points.positions.iter_mut().for_each(|p| p[0] += 0.01);
    let cloud = bench.write("cloud.ply", points.binary());
    let options = Options {
        samples: 100_000,
        seed: 1,
    };
    let run = |budget, threads, less: u64| {
        let workspace = workspace(budget, threads);
        let held = workspace.reserve("test", less).unwrap();
        let found = [
            compare(&mesh, &cloud, &options, &workspace).unwrap(),
            compare(&mesh, &mesh, &options, &workspace).unwrap(),
        ];
        drop(held);
        assert_eq!(workspace.memory.available(), workspace.memory.capacity());
        serde_json::to_string(&found).unwrap()
    };
    let large = run(4 << 30, 2, 0);
    assert_eq!(large, run(MINIMUM_BUDGET, 1, 0));
    // 1 M triangles with 504 100 vertices: in 44 MiB all data go to disk, vertices too.
    assert_eq!(large, run(MINIMUM_BUDGET, 3, 100 << 20));
}

#[test]
fn faces_before_vertices() {
    let bench = Bench::new();
    let mesh = brute::sphere(30);
    let usual = bench.mesh("usual.ply", &mesh);
    let turned = bench.write("turned.ply", mesh.ply_faces_first());
    let cloud = bench.points("cloud.ply", &cube().positions);
    let (one, other) = (
        between(&usual, &cloud, 3000),
        between(&turned, &cloud, 3000),
    );
    assert_eq!((one.a_to_b, one.b_to_a), (other.a_to_b, other.b_to_a));
    assert_eq!(one.a.points, other.a.points);
}

fn refused(a: &Path, b: &Path) -> String {
    let workspace = small();
    let error = compare(a, b, &Options::default(), &workspace).unwrap_err();
    assert!(
        matches!(error, Error::Input { .. } | Error::Io { .. }),
        "{error:?}"
    );
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let bench = Bench::new();
    let good = bench.mesh("good.ply", &square(0.0));
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                  property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let body = |faces: &str| format!("{header}{vertices}{faces}\n");
    let cases = [
        ("index.ply", body("3 0 1 4"), "a corner that is no vertex"),
        ("below.ply", body("3 0 1 -1"), "a corner that is no vertex"),
        ("cut.ply", format!("{header}{vertices}"), "face"),
        (
            "huge.ply",
            body("3 0 1 2")
                .replace("1 1 0", "1e38 1 0")
                .replace("float", "double")
                .replace("1e38", "1e99"),
            "a position",
        ),
        (
            "nan.ply",
            body("3 0 1 2").replace("1 1 0", "nan 1 0"),
            "vertex 2",
        ),
        (
            "empty.ply",
            header
                .replace("vertex 4", "vertex 0")
                .replace("face 1", "face 0"),
            "points",
        ),
        ("nothing", String::new(), "empty file"),
        ("words.txt", "what is this\n".into(), "words.txt"),
    ];
    for (name, text, message) in cases {
        let bad = bench.write(name, text);
        for error in [refused(&bad, &good), refused(&good, &bad)] {
            assert!(error.contains(message) && error.contains(name), "{error}");
        }
    }
    let absent = bench.0.path().join("absent.ply");
    assert!(refused(&absent, &good).contains("absent.ply"));
    let none = Options {
        samples: 0,
        seed: 0,
    };
    let error = compare(&good, &good, &none, &small()).unwrap_err();
    assert!(matches!(error, Error::Parameter { .. }), "{error}");
}

#[test]
fn stops_when_asked() {
    let bench = Bench::new();
    let mesh = bench.mesh("mesh.ply", &brute::sphere(40));
    let workspace = small();
    workspace.cancel.cancel();
    let outcome = compare(&mesh, &mesh, &Options::default(), &workspace);
    assert!(matches!(outcome, Err(Error::Cancelled)));
}
