//! The side that is out, as one says with `--facing`.

use crate::end_to_end::scanners::{faces, facing, noise, read, room, run};
use crate::end_to_end::util::{self, Bench};
use outcrop::params::{Facing, Params};
use std::path::Path;

/// Rounded to a thousandth.
fn rounded(point: [f64; 3]) -> [f64; 3] {
    point.map(|x| (x * 1000.0).round() / 1000.0)
}

fn params(facing: Facing) -> Params {
    Params {
        facing,
        ..Params::default()
    }
}

/// Middle of the centre line of [`tunnel`] at an angle.
fn middle(angle: f64) -> [f64; 3] {
    [12.0 * angle.cos(), 12.0 * angle.sin(), 2.0 * angle]
}

/// Points on a tunnel 4 wide that bends by half a turn, rises, and is open at both ends.
fn tunnel() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (i, j) in (0..240u64).flat_map(|i| (0..80u64).map(move |j| (i, j))) {
        let [u, v] = [0, 1].map(|k| noise([7, k, i * 128 + j]));
        let angle = (i as f64 + u) / 240.0 * std::f64::consts::PI;
        let around = (j as f64 + v) / 80.0 * std::f64::consts::TAU;
        let [x, y, z] = middle(angle);
        let far = 1.0 + 2.0 * around.cos() / 12.0;
        points.push(rounded([x * far, y * far, z + 2.0 * around.sin()]));
    }
    points
}

/// The share of triangles that face the centre line of the tunnel.
fn faces_middle(mesh: &Path) -> f64 {
    let all = read(mesh);
    let mut facing = 0;
    for t in &all.triangles {
        let [a, b, c] = t.map(|v| all.vertices[v as usize]);
        let axis = middle(a[1].atan2(a[0]).clamp(0.0, std::f64::consts::PI));
        facing += usize::from(faces([a, b, c], axis));
    }
    assert!(all.triangles.len() > 30_000);
    facing as f64 / all.triangles.len() as f64
}

#[test]
fn rooms_face_inwards_or_outwards() {
    let bench = Bench::new();
    let center = [2.0, 2.0, 1.5];
    let closed = bench.points("closed.xyz", &room(center, &[], 1));
    // Without a ceiling, and without a wall.
    let open = bench.points("open.xyz", &room(center, &[5], 2));
    let hall = bench.points("hall.xyz", &room(center, &[0], 3));
    let mesh = bench.path("mesh.ply");
    let above = Facing::At([2.0, 2.0, 40.0]);
    for (input, name, expected) in [
        (&closed, Facing::Auto, 0.0),
        (&closed, Facing::Up, 0.0),
        (&closed, Facing::Out, 0.0),
        (&closed, Facing::In, 1.0),
        (&closed, Facing::At(center), 1.0),
        (&open, Facing::Out, 0.0),
        (&open, Facing::In, 1.0),
        (&open, above, 1.0),
        (&hall, Facing::Out, 0.0),
        (&hall, Facing::In, 1.0),
        (&hall, Facing::At(center), 1.0),
    ] {
        run(std::slice::from_ref(input), &mesh, &params(name));
        assert!(util::verdict(&mesh).manifold);
        let found = facing(&mesh, center, 2.5);
        assert!(
            (found - expected).abs() < 0.01,
            "{name:?} of {}: {found} face the middle",
            input.display()
        );
    }
    // The paper's method does as it is told too.
    let paper = Params {
        facing: Facing::In,
        ..Params::paper()
    };
    run(&[closed], &mesh, &paper);
    assert!(facing(&mesh, center, 2.5) > 0.99);
}

#[test]
fn a_body_in_a_room_faces_the_room() {
    let bench = Bench::new();
    let center = [2.0, 2.0, 1.5];
    let mut points = room(center, &[], 1);
    let small = room([0.0; 3], &[], 5);
    let inside = |p: &[f64; 3]| rounded(std::array::from_fn(|k| center[k] + p[k] / 4.0));
    points.extend(small.iter().map(inside));
    let input = bench.points("body.xyz", &points);
    let mesh = bench.path("mesh.ply");
    run(&[input], &mesh, &params(Facing::In));
    let all = read(&mesh);
    let (mut of_body, mut of_room) = ([0; 2], [0; 2]);
    for t in &all.triangles {
        let corners = t.map(|v| all.vertices[v as usize]);
        let near = (0..3).all(|k| (corners[0][k] - center[k]).abs() < 1.0);
        let counts = if near { &mut of_body } else { &mut of_room };
        counts[usize::from(faces(corners, center))] += 1;
    }
    let [out, inward] = of_body;
    assert!(out > 5000 && inward < out / 100, "{of_body:?}");
    let [out, inward] = of_room;
    assert!(inward > 5000 && out < inward / 100, "{of_room:?}");
}

#[test]
fn a_tunnel_faces_its_middle_or_the_rock() {
    let bench = Bench::new();
    let input = bench.points("tunnel.xyz", &tunnel());
    let mesh = bench.path("mesh.ply");
    for (facing, expected) in [(Facing::In, 1.0), (Facing::Out, 0.0)] {
        run(std::slice::from_ref(&input), &mesh, &params(facing));
        let found = faces_middle(&mesh);
        assert!((found - expected).abs() < 0.01, "{facing:?}: {found}");
    }
}

#[test]
fn the_mesh_is_the_same_in_any_division() {
    let bench = Bench::new();
    let points = tunnel();
    let (first, second) = points.split_at(7000);
    let inputs = [
        bench.points("first.xyz", first),
        bench.points("second.xyz", second),
    ];
    let mesh = bench.path("mesh.ply");
    for facing in [Facing::In, Facing::At([0.0, 12.0, 3.0])] {
        let params = Params {
            block: 3000,
            ..params(facing)
        };
        run(&inputs, &mesh, &params);
        let hash = util::hash(&mesh);
        for (threads, tile, page) in [(1, 500, 16), (4, 3000, 64)] {
            let turned: Vec<_> = inputs.iter().rev().cloned().collect();
            util::builder(&turned, &mesh, &params)
                .threads(threads)
                .tile_points(tile)
                .page_points(page)
                .memory(200 << 20)
                .build()
                .unwrap()
                .run()
                .unwrap();
            assert_eq!(util::hash(&mesh), hash, "{facing:?}, {threads} threads");
        }
    }
}

#[test]
fn far_positions_are_refused() {
    let bench = Bench::new();
    let input = bench.points("room.xyz", &room([2.0, 2.0, 1.5], &[], 1));
    let run = |facing| {
        util::builder(
            std::slice::from_ref(&input),
            &bench.path("mesh.ply"),
            &params(facing),
        )
        .build()
        .and_then(|run| run.run())
        .map(drop)
        .map_err(|error| error.to_string())
    };
    let error = run(Facing::At([1e300, 0.0, -2.0])).unwrap_err();
    assert!(error.starts_with("facing: 1e300,0.0,-2.0 "), "{error}");
    let error = run(Facing::At([0.0, f64::NAN, 0.0])).unwrap_err();
    assert!(error.contains("finite coordinates"), "{error}");
    assert_eq!(run(Facing::At([1e3, 0.0, -2.0])), Ok(()));
}
