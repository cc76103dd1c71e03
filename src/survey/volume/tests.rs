//! Closed forms, a slow and obvious oracle, and other threads and memory.

use super::{Above, Options, Volumes, volume};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::V3;
use proptest::prelude::*;
use std::path::{Path, PathBuf};

/// A mesh in memory.
#[derive(Debug, Clone, Default)]
struct Mesh {
    vertices: Vec<V3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A height over a grid of `side` × `side` squares, each divided by the diagonal that `turned` says.
    fn field(
        [low, high]: [[f64; 2]; 2],
        side: u32,
        turned: impl Fn(u32) -> bool,
        height: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let at = |k: u32, axis: usize| {
            low[axis] + (high[axis] - low[axis]) * f64::from(k) / f64::from(side)
        };
        let mut mesh = Self::default();
        for (y, x) in (0..=side).flat_map(|y| (0..=side).map(move |x| (y, x))) {
            let [x, y] = [at(x, 0), at(y, 1)];
            mesh.vertices.push([x, y, height(x, y)]);
        }
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let a = y * (side + 1) + x;
            let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
            mesh.triangles.extend(match turned(y * side + x) {
                true => [[a, b, c], [a, c, d]],
                false => [[a, b, d], [b, c, d]],
            });
        }
        mesh
    }

    fn cube(low: V3, size: f64) -> Self {
        let corner = |k: u32| [0, 1, 2].map(|axis| low[axis] + size * f64::from(k >> axis & 1));
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        Self {
            vertices: (0..8).map(corner).collect(),
            triangles: quads
                .iter()
                .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
                .collect(),
        }
    }

    fn with(mut self, other: &Self) -> Self {
        let first = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        self
    }

    fn turned(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        self
    }

    fn write(&self, path: &Path) -> PathBuf {
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.vertices.len(),
            self.triangles.len()
        )
        .into_bytes();
        for c in self.vertices.iter().flatten() {
            bytes.extend(c.to_le_bytes());
        }
        for t in &self.triangles {
            bytes.push(3);
            t.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        std::fs::write(path, bytes).unwrap();
        path.to_path_buf()
    }
}

/// What is measured: from a level, from a mesh, or the body.
enum From<'a> {
    Nothing,
    Level(f64),
    Mesh(&'a Mesh),
}

/// Measures in these threads, with this part of the least budget taken by something else.
fn measured_in(
    (mesh, from, crop): (&Mesh, &From<'_>, Option<&str>),
    threads: usize,
    taken: u64,
) -> Result<Volumes> {
    let folder = tempfile();
    let path = mesh.write(&folder.join("mesh.ply"));
    let above = match from {
        From::Nothing => None,
        From::Level(level) => Some(Above::Level(*level)),
        From::Mesh(other) => Some(Above::Mesh(other.write(&folder.join("other.ply")))),
    };
    let crop = crop.map(|text| text.parse().unwrap());
    let workspace = Workspace::for_tests(threads).unwrap();
    let held = workspace.reserve("something else", taken).unwrap();
    let found = volume(&path, &Options { above, crop }, &workspace);
    drop(held);
    assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    std::fs::remove_dir_all(&folder).unwrap();
    found
}

fn tempfile() -> PathBuf {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let folder =
        std::env::temp_dir().join(format!("outcrop-survey-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn measured(mesh: &Mesh, from: From<'_>, crop: Option<&str>) -> Volumes {
    measured_in((mesh, &from, crop), 2, 0).unwrap()
}

#[track_caller]
fn near(found: f64, expected: f64) {
    let room = 1e-12 * expected.abs().max(1.0);
    assert!(
        (found - expected).abs() <= room,
        "{found}, expected {expected}"
    );
}

const UNIT: [[f64; 2]; 2] = [[-1.0, -1.0], [1.0, 1.0]];

#[test]
fn closed_components_have_their_volumes() {
    let cubes = Mesh::cube([635_000.0, 4_848_000.0, 120.0], 2.0)
        .with(&Mesh::cube([635_010.0, 4_848_000.0, 121.0], 1.0))
        .with(&Mesh::cube([635_010.25, 4_848_000.25, 121.25], 0.5).turned());
    let body = measured(&cubes, From::Nothing, None).body.unwrap();
    assert!(body.is_closed);
    assert_eq!((body.closed.components, body.closed.triangles), (3, 36));
    near(body.volume.unwrap(), 8.0 + 1.0 - 0.125);
    near(body.area, 24.0 + 6.0 + 1.5);
    near(body.facing_up, 5.25);
    near(body.facing_down, 5.25);
    let volumes: Vec<f64> = body.largest.iter().map(|one| one.volume).collect();
    assert_eq!(volumes, [8.0, 1.0, -0.125]);
    assert_eq!(body.largest[1].vertex, 8);
    assert_eq!(body.largest[1].position, [635_010.0, 4_848_000.0, 121.0]);
    assert_eq!((body.rest.components, body.rest.volume), (0, Some(0.0)));
    // One has a hole, and many are small.
    let mut open = cubes;
    open.triangles.remove(0);
    for k in 0..20 {
        open = open.with(&Mesh::cube(
            [635_020.0 + f64::from(k), 4_848_000.0, 120.0],
            0.5,
        ));
    }
    let body = measured(&open, From::Nothing, None).body.unwrap();
    assert_eq!((body.is_closed, body.volume), (false, None));
    assert_eq!((body.open.components, body.open.volume), (1, None));
    near(body.closed.volume.unwrap(), 1.0 - 0.125 + 2.5);
    assert_eq!(body.largest.len(), 10);
    near(body.rest.volume.unwrap(), 12.0 * 0.125);
    let vertices: Vec<u32> = body.largest[1..4].iter().map(|one| one.vertex).collect();
    assert_eq!(vertices, [16, 24, 32]);
}

#[test]
fn a_level_divides_a_body_and_a_pyramid() {
    let cube = Mesh::cube([0.0, 0.0, -1.0], 4.0);
    let earth = measured(&cube, From::Level(0.0), None).earth.unwrap();
    near(earth.above, 48.0);
    near(earth.below, -16.0);
    near(earth.net, 64.0);
    assert_eq!((earth.is_closed, earth.covered), (true, None));
    let earth = measured(&cube, From::Level(0.0), Some("1,1,2,9"))
        .earth
        .unwrap();
    near(earth.above, 9.0);
    // A pyramid without its base: of height 1 over 2 by 2.
    let pyramid = Mesh::field(
        UNIT,
        2,
        |k| k == 0 || k == 3,
        |x, y| 1.0 - x.abs().max(y.abs()),
    );
    for mesh in [pyramid.clone(), pyramid.turned()] {
        let found = measured(&mesh, From::Level(0.5), None);
        let earth = found.earth.clone().unwrap();
        near(earth.above, 4.0 / 3.0 / 8.0);
        near(earth.below, 4.0 / 3.0 / 8.0 + 2.0 / 3.0);
        near(earth.above_area, 1.0);
        near(earth.covered.unwrap(), 4.0);
        assert_eq!(found.to_string().contains("faces down"), earth.is_turned);
    }
}

#[test]
fn polygons_cut_a_slope_exactly() {
    // z = x, in large coordinates.
    let [x, y] = [635_000.0, 4_848_000.0];
    let slope = Mesh::field(
        [[x, y], [x + 10.0, y + 10.0]],
        7,
        |k| k % 3 == 0,
        |at, _| at - x,
    );
    let ring = |ring: &[[f64; 2]]| {
        let all: Vec<_> = ring
            .iter()
            .map(|p| format!("{} {}", x + p[0], y + p[1]))
            .collect();
        format!("({})", all.join(", "))
    };
    let outer = ring(&[[1.0, 1.0], [5.0, 1.0], [5.0, 5.0], [1.0, 5.0]]);
    let hole = ring(&[[2.0, 2.0], [2.0, 4.0], [4.0, 4.0], [4.0, 2.0]]);
    let found = measured(
        &slope,
        From::Level(0.0),
        Some(&format!("POLYGON({outer}, {hole})")),
    );
    near(found.crop_area.unwrap(), 12.0);
    let earth = found.earth.unwrap();
    near(earth.above, 36.0);
    near(earth.above_area, 12.0);
    near(earth.not_covered.unwrap(), 0.0);
    // A triangle that leaves the mesh: half of it is not covered.
    let outside = ring(&[[8.0, 2.0], [12.0, 2.0], [12.0, 6.0], [8.0, 6.0]]);
    let earth = measured(
        &slope,
        From::Level(9.0),
        Some(&format!("POLYGON({outside})")),
    )
    .earth
    .unwrap();
    near(earth.above, 0.5 * 4.0);
    near(earth.below, 0.5 * 4.0);
    near(earth.not_covered.unwrap(), 8.0);
}

#[test]
fn layers_count_what_is_between_them() {
    let layer = |z: f64| Mesh::field(UNIT, 1, |_| true, |_, _| z);
    let cave = layer(1.0).with(&layer(3.0).turned()).with(&layer(5.0));
    let found = measured(&cave, From::Level(0.0), None);
    let earth = found.earth.clone().unwrap();
    near(earth.above, 4.0 * 3.0);
    near(earth.covered.unwrap(), 4.0);
    near(earth.facing_down, 4.0);
    assert!(found.to_string().contains("33.3 %"), "{found}");
    let floor = Mesh::field([[-0.5, -2.0], [3.0, 2.0]], 3, |k| k % 2 == 0, |x, _| x);
    let earth = measured(&cave, From::Mesh(&floor), None).earth.unwrap();
    // Over x from -0.5 to 1: 3 - x, but the first layer is below where x is more than 1.
    near(earth.net, 2.0 * (4.5 - 0.375));
    near(earth.covered.unwrap(), 3.0);
    near(earth.only_this.unwrap(), 1.0);
    near(earth.only_other.unwrap(), 14.0 - 3.0);
}

#[test]
fn tilted_planes_have_a_wedge_on_each_side() {
    let slope = Mesh::field(UNIT, 5, |k| k % 2 == 0, |x, y| x + 2.0 * y);
    let other = Mesh::field([[-1.0, -1.0], [2.0, 1.0]], 4, |_| true, |_, y| 2.0 * y);
    for other in [other.clone(), other.clone().turned()] {
        let found = measured(&slope, From::Mesh(&other), None);
        let earth = found.earth.unwrap();
        near(earth.above, 1.0);
        near(earth.below, 1.0);
        near(earth.above_area, 2.0);
        near(earth.below_area, 2.0);
        near(earth.covered.unwrap(), 4.0);
        near(earth.only_other.unwrap(), 2.0);
    }
    let earth = measured(&slope, From::Mesh(&slope), None).earth.unwrap();
    near(earth.above, 0.0);
    near(earth.covered.unwrap(), 4.0);
    let half = "POLYGON((-1 -1, 1 -1, 1 1))";
    let found = measured(&slope, From::Mesh(&other), Some(half));
    let earth = found.earth.unwrap();
    near(earth.covered.unwrap(), 2.0);
    near(earth.net, 2.0 / 3.0);
    near(earth.not_covered.unwrap(), 0.0);
    // Beside each other.
    let far = Mesh::field([[5.0, 5.0], [6.0, 6.0]], 1, |_| true, |_, _| 0.0);
    let earth = measured(&slope, From::Mesh(&far), None).earth.unwrap();
    assert_eq!((earth.net, earth.covered), (0.0, Some(0.0)));
    near(earth.only_other.unwrap(), 1.0);
}

#[test]
fn neither_threads_nor_memory_decide_anything() {
    let wave = |x: f64, y: f64| 0.3 * x * y + 0.2 * (x * 7.0 - (x * 7.0).floor()) - 0.1 * y * y;
    let one = Mesh::field(UNIT, 900, |k| k % 3 == 0, wave);
    let two = Mesh::field(
        [[-0.9, -1.1], [1.3, 0.8]],
        130,
        |k| k % 2 == 0,
        |x, y| wave(y, x),
    );
    let solid = one.clone().with(&Mesh::cube([0.0; 3], 0.5));
    let star = "POLYGON((-0.9 -0.9, 0.8 0.9, 0.1 -1.4, -0.2 0.95, 0.9 -0.8), (0 0, 0.1 0, 0 0.1))";
    let cases = [
        (&solid, From::Nothing, None),
        (&one, From::Level(0.05), None),
        (&one, From::Level(0.05), Some(star)),
        (&one, From::Mesh(&two), None),
        (&two, From::Mesh(&one), Some(star)),
    ];
    for (mesh, from, crop) in cases {
        let run = |threads, taken| {
            let mut found = measured_in((mesh, &from, crop), threads, taken).unwrap();
            // Names of files differ.
            found.mesh.path = PathBuf::new();
            found
                .other
                .iter_mut()
                .for_each(|other| other.path = PathBuf::new());
            found
        };
        let first = run(1, 0);
        // The vertices do not fit.
        for (threads, taken) in [(3, 0), (2, 72 << 20)] {
            assert_eq!(
                run(threads, taken),
                first,
                "{threads} threads, {taken} bytes taken"
            );
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let cube = Mesh::cube([0.0; 3], 1.0);
    let refused = |mesh: &Mesh, from: From<'_>, crop: Option<&str>| {
        measured_in((mesh, &from, crop), 1, 0).unwrap_err()
    };
    for (from, crop) in [
        (From::Nothing, Some("0,0,1,1")),
        (From::Level(0.0), Some("0,0,0,1,1,1")),
        (From::Level(f64::NAN), None),
    ] {
        let error = refused(&cube, from, crop);
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
    }
    let mut broken = cube.clone();
    broken.vertices[5][1] = f64::INFINITY;
    let mut beyond = cube.clone();
    beyond.triangles[7][2] = 8;
    let empty = Mesh {
        triangles: Vec::new(),
        ..cube.clone()
    };
    for (mesh, place) in [(&broken, "vertex 5"), (&beyond, "faces"), (&empty, "mesh")] {
        for from in [From::Nothing, From::Level(0.5), From::Mesh(&cube)] {
            let error = refused(mesh, from, None);
            assert!(matches!(&error, Error::Input { .. }), "{error}");
            assert!(error.to_string().contains(place), "{error}");
        }
    }
    let entangled: Vec<_> = (0..400)
        .map(|k| format!("{} {}", k * 7919 % 1009, k * 104_729 % 1013))
        .collect();
    let crop = format!("POLYGON(({}))", entangled.join(", "));
    let error = refused(&cube, From::Level(0.0), Some(&crop));
    assert!(error.to_string().contains("simpler polygons"), "{error}");
}

/// The height of a mesh at a place, by looking at all triangles.
fn height(mesh: &Mesh, [x, y]: [f64; 2]) -> Option<f64> {
    mesh.triangles.iter().find_map(|t| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        let area = |p: V3, q: V3| (p[0] - x) * (q[1] - y) - (q[0] - x) * (p[1] - y);
        let [u, v, w] = [area(b, c), area(c, a), area(a, b)];
        let all = u + v + w;
        let inside = [u, v, w].iter().all(|part| part * all >= 0.0) && all != 0.0;
        inside.then(|| (u * a[2] + v * b[2] + w * c[2]) / all)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Against heights at the places of a fine grid.
    #[test]
    fn two_surfaces_are_as_far_apart_as_at_many_places(
        heights in proptest::collection::vec(-1.0f64..1.0, 2 * 49),
        moved in -0.6f64..0.6,
        diagonals in 0u64..1 << 36,
        bent in -0.12f64..0.12,
    ) {
        let turned = |k: u32| diagonals >> k & 1 == 1;
        let mut one = Mesh::field(UNIT, 6, turned, |_, _| 0.0);
        let mut two = Mesh::field([[-0.8, -1.0], [1.4, 1.0]], 6, |k| !turned(k), |_, _| 0.0);
        for (k, z) in heights.iter().enumerate() {
            let mesh = if k < 49 { &mut one } else { &mut two };
            let vertex = &mut mesh.vertices[k % 49];
            vertex[2] = *z;
            // Inner vertices move, so that triangles of both lie across each other.
            if (1..6).contains(&(k % 7)) && (1..6).contains(&(k % 49 / 7)) {
                vertex[1] += bent * *z;
                vertex[0] -= bent * *z;
            }
        }
        two.vertices.iter_mut().for_each(|v| v[2] += moved);
        let earth = measured(&one, From::Mesh(&two), None).earth.unwrap();
        let steps = 120;
        let at = |k: i32| -1.0 + (f64::from(k) + 0.5) * 2.0 / f64::from(steps);
        let (mut above, mut below, mut covered) = (0.0, 0.0, 0.0);
        for k in 0..steps * steps {
            let place = [at(k % steps), at(k / steps)];
            if let (Some(a), Some(b)) = (height(&one, place), height(&two, place)) {
                let each = (2.0 / f64::from(steps)).powi(2);
                above += (a - b).max(0.0) * each;
                below += (b - a).max(0.0) * each;
                covered += each;
            }
        }
        prop_assert!((earth.above - above).abs() < 0.02, "{} {}", earth.above, above);
        prop_assert!((earth.below - below).abs() < 0.02, "{} {}", earth.below, below);
        prop_assert!((earth.covered.unwrap() - covered).abs() < 0.04, "{}", covered);
        near(earth.covered.unwrap(), 3.6);
        // The difference is also that of the volumes above a level, in the region where both are.
        let both = Some("-0.8,-1,1,1");
        let level = |mesh| measured(mesh, From::Level(-2.0), both).earth.unwrap().net;
        near(earth.net, level(&one) - level(&two));
    }
}
