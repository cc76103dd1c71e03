//! What a scanner saw is the outer side of the mesh.

use crate::end_to_end::util::{self, Bench};
use outcrop::Report;
use outcrop::params::Params;
use outcrop_ply::Mesh;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Reads a mesh.
pub fn read(mesh: &Path) -> Mesh {
    let file = std::fs::read(mesh).unwrap();
    Mesh::read(&file[..], file.len() as u64).unwrap()
}

/// True if a triangle faces a place.
pub fn faces([a, b, c]: [[f64; 3]; 3], place: [f64; 3]) -> bool {
    let side = |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - a[k]) };
    let (p, q, d) = (side(b), side(c), side(place));
    let n = [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ];
    n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0.0
}

/// The share of triangles near `center`, up to `reach` along each axis, that face it.
pub fn facing(mesh: &Path, center: [f64; 3], reach: f64) -> f64 {
    let all = read(mesh);
    let (mut near, mut facing) = (0, 0);
    for t in &all.triangles {
        let corners = t.map(|v| all.vertices[v as usize]);
        if (0..3).all(|k| (center[k] - corners[0][k]).abs() <= reach) {
            near += 1;
            facing += usize::from(faces(corners, center));
        }
    }
    assert!(near > 1000, "{near} triangles near {center:?}");
    f64::from(facing as u32) / f64::from(near)
}

/// A number from 0 to 1 that depends on the seeds.
pub fn noise(seeds: [u64; 3]) -> f64 {
    let [a, b, c] = seeds;
    let mut x = a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.wrapping_mul(0xc2b2_ae3d_27d4_eb4f) ^ c;
    for _ in 0..3 {
        x ^= x >> 29;
        x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// Points on the faces of a box around `center`, 4 by 4 by 3 wide, without those of `left_out` faces.
pub fn room(center: [f64; 3], left_out: &[usize], seed: u64) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for face in (0..6).filter(|face| !left_out.contains(face)) {
        let axis = face / 2;
        for (i, j) in (0..40u64).flat_map(|i| (0..40u64).map(move |j| (i, j))) {
            let jitter = [0, 1].map(|k| noise([seed, face as u64 * 2 + k, i * 64 + j]));
            let [u, v] = [i as f64 + jitter[0], j as f64 + jitter[1]].map(|x| x / 40.0 - 0.5);
            let mut p = [0.0; 3];
            p[axis] = if face % 2 == 0 { -0.5 } else { 0.5 };
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            let size = [4.0, 4.0, 3.0];
            points.push(std::array::from_fn(|k| {
                ((center[k] + p[k] * size[k]) * 1000.0).round() / 1000.0
            }));
        }
    }
    points
}

/// A scan as PTX. Its points are in the coordinates of the cloud.
fn scan(scanner: [f64; 3], points: &[[f64; 3]]) -> String {
    ptx(scanner, [0.0; 3], points)
}

/// A scan as PTX, whose matrix moves its points by `moved`.
pub fn ptx(scanner: [f64; 3], moved: [f64; 3], points: &[[f64; 3]]) -> String {
    let ([x, y, z], [a, b, c]) = (scanner, moved);
    let mut text = format!(
        "1\n{}\n{x} {y} {z}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{a} {b} {c} 1\n",
        points.len()
    );
    for [x, y, z] in points {
        writeln!(text, "{x:.3} {y:.3} {z:.3} 0.5").unwrap();
    }
    text
}

pub fn run(inputs: &[PathBuf], mesh: &Path, params: &Params) -> Report {
    util::builder(inputs, mesh, params)
        .build()
        .unwrap()
        .run()
        .unwrap()
}

#[test]
fn rooms_face_the_scanners_that_saw_them() {
    let bench = Bench::new();
    let (center, beside) = ([2.0, 2.0, 1.5], [12.0, 2.0, 1.5]);
    let far = [2.0, 2.0, 40.0];
    let all = room(center, &[], 1);
    // One seen from inside, and one from outside, without its floor.
    let inside = bench.write("inside.ptx", scan(center, &all));
    let open = bench.write("open.ptx", scan(center, &room(center, &[5], 2)));
    let outside = bench.write("outside.ptx", scan(far, &room(center, &[4], 3)));
    let two = scan(center, &all) + &scan(beside, &room(beside, &[], 4));
    let two = bench.write("two.ptx", two);
    let params = Params::default();
    let mesh = bench.path("mesh.ply");
    for (input, places, share) in [
        (&inside, vec![(center, 1.0)], 1),
        (&open, vec![(center, 1.0)], 1),
        (&outside, vec![(center, 0.0)], 1),
        (&two, vec![(center, 1.0), (beside, 1.0)], 2),
    ] {
        let report = run(std::slice::from_ref(input), &mesh, &params);
        assert_eq!(report.scanners.len(), share);
        assert!(util::verdict(&mesh).manifold);
        for (place, expected) in places {
            let found = facing(&mesh, place, 2.5);
            let name = input.display();
            assert!(
                (found - expected).abs() < 0.01,
                "{name}: {found} face {place:?}"
            );
        }
    }
    // Closed bodies face outwards without scanners.
    for params in [
        Params {
            ignore_scanners: true,
            ..Params::default()
        },
        Params::paper(),
    ] {
        let report = run(std::slice::from_ref(&inside), &mesh, &params);
        assert_eq!(report.scanners, [[0.0; 3]; 0]);
        assert!(facing(&mesh, center, 2.5) < 0.01);
    }
}

#[test]
fn the_mesh_is_the_same_in_any_order_and_division() {
    let bench = Bench::new();
    let (center, beside) = ([2.0, 2.0, 1.5], [6.0, 2.0, 1.5]);
    // The rooms share a wall, of which some positions were seen from both sides.
    let (mut one, other) = (room(center, &[1], 1), room(beside, &[], 2));
    one.extend(other.iter().step_by(3).filter(|p| p[0] == 4.0));
    let first = bench.write("a.ptx", scan(center, &one));
    let second = bench.write("b.ptx", scan(beside, &other));
    let both = bench.write("c.ptx", scan(beside, &other) + &scan(center, &one));
    let plain = bench.points("d.xyz", &room([2.0, 8.0, 1.5], &[], 5));
    let params = Params {
        block: 3000,
        ..Params::default()
    };
    let mesh = bench.path("mesh.ply");
    let with = |plain: &PathBuf, others: &[&PathBuf]| -> Vec<PathBuf> {
        let others = others.iter().map(|path| (*path).clone());
        others.chain([plain.clone()]).collect()
    };
    let inputs = with(&plain, &[&first, &second]);
    let report = run(&inputs, &mesh, &params);
    assert_eq!(report.scanners, [center, beside]);
    let hash = util::hash(&mesh);
    for inputs in [
        with(&plain, &[&second, &first]),
        with(&plain, &[&both]),
        inputs.iter().rev().cloned().collect(),
    ] {
        run(&inputs, &mesh, &params);
        assert_eq!(util::hash(&mesh), hash, "{inputs:?}");
    }
    for (threads, tile, page) in [(1, 500, 16), (4, 3000, 64)] {
        util::builder(&inputs, &mesh, &params)
            .threads(threads)
            .tile_points(tile)
            .page_points(page)
            .memory(200 << 20)
            .build()
            .unwrap()
            .run()
            .unwrap();
        assert_eq!(util::hash(&mesh), hash, "{threads} threads");
    }
    // Columns of the mesh do not change its triangles; the number of a scanner may be one.
    let attributes = Params {
        attributes: "intensity,scanner".parse().unwrap(),
        ..params.clone()
    };
    let listed = bench.path("listed.ply");
    let report = run(&inputs, &listed, &attributes);
    assert_eq!(report.attributes[1].range, [0.0, 2.0]);
    let triangles = |mesh: &Path| {
        let all = read(mesh);
        (all.vertices, all.triangles)
    };
    assert_eq!(triangles(&listed), triangles(&mesh));
}

#[test]
fn a_far_position_is_no_scanner() {
    let bench = Bench::new();
    let center = [2.0, 2.0, 1.5];
    let text = scan([-5e5, 4e6, 0.0], &room(center, &[], 1));
    let input = bench.write("far.ptx", text);
    let mesh = bench.path("mesh.ply");
    let report = run(&[input], &mesh, &Params::default());
    assert_eq!(report.scanners, [[0.0; 3]; 0]);
    let warned = |w: &String| w.starts_with("1 of 1 positions of scanners are not used");
    assert!(report.warnings.iter().any(warned), "{:?}", report.warnings);
    assert!(facing(&mesh, center, 2.5) < 0.01);
}
