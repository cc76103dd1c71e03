//! Normals that points bring: directions for the disks, and the outer side.

use crate::end_to_end::scanners::{read, run};
use crate::end_to_end::util::{self, Bench};
use outcrop::params::{InputNormals, Params};
use outcrop_ply::Mesh;
use std::fmt::Write;

/// A point with its true normal.
type Oriented = ([f64; 3], [f64; 3]);

/// Numbers from 0 to 1.
struct Random(oorandom::Rand64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0.rand_float()
    }

    /// About normally distributed.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// Points on faces of a box, `dense` along a unit of length; normals lead out, or in.
fn faces(
    center: [f64; 3],
    size: [f64; 3],
    dense: f64,
    faces: std::ops::Range<usize>,
    out: f64,
    random: &mut Random,
) -> Vec<Oriented> {
    let mut points = Vec::new();
    for face in faces {
        let axis = face / 2;
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = [u, v].map(|k| (size[k] * dense).round().max(1.0) as usize);
        for place in 0..count[0] * count[1] {
            let cell = [place / count[1], place % count[1]];
            let at = [0, 1].map(|k| (cell[k] as f64 + random.unit()) / count[k] as f64 - 0.5);
            let (mut p, mut n) = ([0.0; 3], [0.0; 3]);
            let side = if face % 2 == 0 { -1.0 } else { 1.0 };
            (p[axis], p[u], p[v]) = (side / 2.0, at[0], at[1]);
            n[axis] = side * out;
            points.push((std::array::from_fn(|k| center[k] + p[k] * size[k]), n));
        }
    }
    points
}

/// What is done to true normals.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    None,
    /// Ten degrees of noise.
    Noise,
    /// Random signs.
    Signs,
    /// A fifth is flipped.
    Flipped,
    /// Any direction.
    Garbage,
}

/// The points as text, with changed normals.
fn text(points: &[Oriented], change: Change, random: &mut Random) -> String {
    let mut text = String::from("//X Y Z Nx Ny Nz\n");
    for ([x, y, z], normal) in points {
        let mut n = *normal;
        match change {
            Change::None => {}
            Change::Noise => n = n.map(|c| c + 10f64.to_radians() * random.normal()),
            Change::Signs if random.unit() < 0.5 => n = n.map(|c| -c),
            Change::Flipped if random.unit() < 0.2 => n = n.map(|c| -c),
            Change::Signs | Change::Flipped => {}
            Change::Garbage => n = n.map(|_| random.normal()),
        }
        let [a, b, c] = n;
        writeln!(text, "{x:.6} {y:.6} {z:.6} {a:.6} {b:.6} {c:.6}").unwrap();
    }
    text
}

fn with(input_normals: InputNormals) -> Params {
    Params {
        input_normals,
        ..Params::default()
    }
}

fn random(seed: u128) -> Random {
    Random(oorandom::Rand64::new(seed))
}

/// The share of the triangles whose corners `near` selects that run as `out` says at their middle.
fn facing(mesh: &Mesh, near: impl Fn([f64; 3]) -> bool, out: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
    let (mut all, mut right) = (0, 0);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        if ![a, b, c].iter().all(|p| near(*p)) {
            continue;
        }
        let p: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let q: [f64; 3] = std::array::from_fn(|k| c[k] - a[k]);
        let n = [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ];
        let d = out(std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0));
        all += 1;
        right += u32::from(n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0.0);
    }
    assert!(all > 1000, "{all} triangles");
    f64::from(right) / f64::from(all)
}

/// A room with a body inside it: normals tell that the room is seen from inside.
#[test]
fn a_room_faces_inwards_and_a_body_in_it_outwards() {
    let bench = Bench::new();
    let mut random = random(1);
    let mut points = faces([0.0; 3], [2.0, 2.0, 1.5], 25.0, 0..6, -1.0, &mut random);
    let center = [0.2, 0.1, 0.0];
    points.extend(faces(center, [0.5; 3], 40.0, 0..6, 1.0, &mut random));
    let inside = |p: [f64; 3]| (0..3).all(|k| (p[k] - center[k]).abs() < 0.26);
    let from_center = |p: [f64; 3]| std::array::from_fn(|k| p[k] - center[k]);
    let mesh = bench.path("mesh.ply");
    for (change, wanted, oriented) in [
        (Change::None, InputNormals::Auto, true),
        (Change::None, InputNormals::Use, true),
        (Change::Noise, InputNormals::Auto, true),
        (Change::Flipped, InputNormals::Auto, true),
        (Change::Signs, InputNormals::Auto, false),
        (Change::Garbage, InputNormals::Auto, false),
        (Change::None, InputNormals::Ignore, false),
    ] {
        let input = bench.write("room.xyz", text(&points, change, &mut random));
        let report = run(&[input], &mesh, &with(wanted));
        let found = report.normals.map(|normals| normals.input);
        let expected = (wanted != InputNormals::Ignore).then_some(oriented);
        assert_eq!(found.map(|f| f.oriented), expected, "{change:?} {wanted:?}");
        assert!(util::verdict(&mesh).manifold);
        let all = read(&mesh);
        let body = facing(&all, inside, from_center);
        let room = facing(&all, |p| !inside(p), from_center);
        // Closed bodies face outwards without evidence.
        let expected = if oriented { 0.0 } else { 1.0 };
        assert!(body > 0.99, "{change:?} {wanted:?}: {body} of the body");
        let wrong = (room - expected).abs();
        assert!(wrong < 0.01, "{change:?} {wanted:?}: {room} of the room");
    }
}

/// The bytes of the mesh depend on the points and their normals only.
#[test]
fn the_mesh_is_the_same_in_any_order_and_division() {
    let bench = Bench::new();
    let mut random = random(2);
    let points = faces([0.0; 3], [1.0; 3], 30.0, 0..6, -1.0, &mut random);
    let (one, other) = points.split_at(2000);
    // Some positions are in both files, with other normals.
    let again: Vec<Oriented> = one[..300]
        .iter()
        .map(|(p, _)| (*p, [0.0, 0.6, 0.8]))
        .collect();
    let other = [other, &again].concat();
    let first = bench.write("a.xyz", text(one, Change::Flipped, &mut random));
    let second = bench.write("b.xyz", text(&other, Change::Noise, &mut random));
    let plain: Vec<[f64; 3]> = points.iter().map(|(p, _)| p.map(|x| x + 5.0)).collect();
    let third = bench.points("c.xyz", &plain);
    let params = Params {
        block: 1500,
        ..Params::default()
    };
    let mesh = bench.path("mesh.ply");
    let inputs = [first.clone(), second.clone(), third.clone()];
    let report = run(&inputs, &mesh, &params);
    let normals = report.normals.unwrap();
    assert!(normals.input.oriented);
    assert_eq!(normals.input.missing, plain.len() as u64);
    assert_eq!(normals.input.columns, ["nx", "ny", "nz"]);
    let disks = normals.disks.used + normals.disks.disagreeing;
    assert_eq!(disks + normals.input.missing, report.points);
    let hash = util::hash(&mesh);
    run(&[third, second, first], &mesh, &params);
    assert_eq!(util::hash(&mesh), hash);
    for (threads, tile, page) in [(1, 400, 16), (4, 1500, 64)] {
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
    // Columns of the mesh do not change its triangles; a normal may be one.
    let listed = bench.path("listed.ply");
    let attributes = Params {
        attributes: "nx,ny,nz".parse().unwrap(),
        ..params
    };
    let report = run(&inputs, &listed, &attributes);
    assert_eq!(report.attributes.len(), 3);
    let (listed, mesh) = (read(&listed), read(&mesh));
    assert_eq!(listed.vertices, mesh.vertices);
    assert_eq!(listed.triangles, mesh.triangles);
}

/// Two sheets that are a little less than one spacing apart: their points do not tell the direction at each of them.
#[test]
fn a_thin_plate_has_two_sides() {
    let bench = Bench::new();
    let mut random = random(3);
    let points = faces([0.0; 3], [1.0, 1.0, 0.009], 100.0, 0..6, 1.0, &mut random);
    let mesh = bench.path("mesh.ply");
    let mut run = |change, input_normals| {
        let input = bench.write("plate.xyz", text(&points, change, &mut random));
        let params = Params {
            relax: 0,
            ..with(input_normals)
        };
        let report = run(&[input], &mesh, &params);
        let out = |p: [f64; 3]| [0.0, 0.0, p[2]];
        let inner = |p: [f64; 3]| p[0].abs() < 0.48 && p[1].abs() < 0.48;
        (report.mesh.boundary_edges, facing(&read(&mesh), inner, out))
    };
    let (torn, _) = run(Change::None, InputNormals::Ignore);
    assert!(torn > 50, "{torn}");
    for change in [Change::None, Change::Noise, Change::Signs, Change::Flipped] {
        for wanted in [InputNormals::Auto, InputNormals::Use] {
            let (boundary, share) = run(change, wanted);
            let right = boundary < torn / 4 && share > 0.99;
            assert!(right, "{change:?} {wanted:?}: {boundary} edges, {share}");
        }
    }
}

/// At the edges of a box estimated directions are between those of its faces.
#[test]
fn normals_that_do_not_suit_the_points_are_not_used() {
    let bench = Bench::new();
    let mut random = random(4);
    let points = faces([0.0; 3], [1.0; 3], 40.0, 0..6, 1.0, &mut random);
    let mesh = bench.path("mesh.ply");
    for (change, wanted, used) in [
        (Change::None, InputNormals::Auto, 0.999..=1.0),
        (Change::Signs, InputNormals::Auto, 0.999..=1.0),
        (Change::Noise, InputNormals::Auto, 0.1..=0.6),
        (Change::Garbage, InputNormals::Auto, 0.0..=0.2),
        (Change::Garbage, InputNormals::Use, 1.0..=1.0),
    ] {
        let input = bench.write("box.xyz", text(&points, change, &mut random));
        let report = run(&[input], &mesh, &with(wanted));
        let disks = report.normals.unwrap().disks;
        let share = disks.used as f64 / (disks.used + disks.disagreeing) as f64;
        assert!(used.contains(&share), "{change:?} {wanted:?}: {share}");
        assert_eq!(disks.used + disks.disagreeing, report.points);
        if (change, wanted) != (Change::Garbage, InputNormals::Use) {
            assert_eq!(report.mesh.boundary_edges, 0, "{change:?}");
        }
    }
}

#[test]
fn info_and_report_tell_about_normals() {
    let bench = Bench::new();
    let mut random = random(5);
    let points = faces([0.0; 3], [1.0; 3], 20.0, 0..6, 1.0, &mut random);
    let bare: Vec<[f64; 3]> = points.iter().map(|(p, _)| p.map(|x| x + 2.0)).collect();
    for (change, kind) in [
        (Change::None, "oriented"),
        (Change::Signs, "directions only"),
    ] {
        let input = bench.write("box.xyz", text(&points, change, &mut random));
        let said = util::run(["info".as_ref(), input.as_os_str()]);
        let line = format!("normals      nx, ny, nz ({kind})\n");
        assert!(said.out.contains(&line), "{}", said.out);
        let other = bench.points("other.xyz", &bare);
        let (mesh, json) = (bench.path("mesh.ply"), bench.path("report.json"));
        let said = util::run([
            "reconstruct".as_ref(),
            input.as_os_str(),
            other.as_os_str(),
            "-o".as_ref(),
            mesh.as_os_str(),
            "--input-normals".as_ref(),
            "use".as_ref(),
            "--report".as_ref(),
            json.as_os_str(),
        ]);
        assert_eq!(said.code, Some(0), "{}", said.err);
        let text = std::fs::read_to_string(json).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(report["parameters"]["input_normals"], "use");
        let normals = &report["normals"];
        assert_eq!(normals["columns"], serde_json::json!(["nx", "ny", "nz"]));
        assert_eq!(normals["oriented"], kind == "oriented");
        assert_eq!(normals["missing"], bare.len());
        assert_eq!(normals["used"], points.len());
        assert_eq!(normals["disagreeing"], 0);
    }
    let plain = bench.points("plain.xyz", &bare);
    let said = util::run(["info".as_ref(), plain.as_os_str()]);
    assert!(
        said.code == Some(0) && !said.out.contains("normals"),
        "{}",
        said.out
    );
}
