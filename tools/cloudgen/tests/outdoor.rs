//! The outdoor world, and the measures of meshes of it.

use std::{fmt::Write, fs, path::Path};

use outcrop_cloudgen::{
    Cloud, Error, GroundReport, Kind, NoiseMode, OUTDOOR_SIDE, Objects, Order, Sampling,
};

fn world(points: u64) -> Cloud {
    Cloud::new(Kind::Outdoor).points(points).seed(1)
}

fn points(cloud: &Cloud) -> Vec<[f64; 3]> {
    cloud.generator().unwrap().iter().collect()
}

/// Height of the ground, written independently.
fn ground(x: f64, y: f64) -> f64 {
    12.0 * (x / 61.0).sin() * (y / 47.0).cos()
        + 4.0 * (x / 17.0 + 1.0).sin() * (y / 23.0).sin()
        + 0.6 * (x / 3.1).sin() * (y / 2.7).sin()
}

/// Distance to the nearest disc; negative inside.
fn clearance(discs: &[[f64; 3]], x: f64, y: f64) -> f64 {
    let to = |&[u, v, radius]: &[f64; 3]| (x - u).hypot(y - v) - radius;
    discs.iter().map(to).fold(f64::INFINITY, f64::min)
}

#[test]
fn equal_descriptions_give_equal_points() {
    let cloud = world(20_000).noise(0.1).outliers(0.01).duplicates(0.1);
    let all = points(&cloud);
    assert_eq!(all, points(&cloud));
    let mut piece = [[0.0; 3]; 20];
    cloud.generator().unwrap().fill(7777, &mut piece);
    assert_eq!(piece, all[7777..7797]);
    assert_ne!(all, points(&cloud.clone().seed(2)));

    // The same points by part, the ground first.
    let clean = world(20_000);
    let mut sorted = points(&clean.clone().order(Order::Sorted));
    let on_ground = |p: &[f64; 3]| (p[2] - ground(p[0], p[1])).abs() < 1e-9;
    assert!(sorted[..15_000].iter().all(on_ground));
    assert!(!sorted[18_000..].iter().any(on_ground));
    let mut random = points(&clean);
    let order = |a: &[f64; 3], b: &[f64; 3]| a.partial_cmp(b).unwrap();
    sorted.sort_by(order);
    random.sort_by(order);
    assert_eq!(sorted, random);
}

#[test]
fn points_stay_in_bounds() {
    let objects = Objects {
        wires: 12,
        ..Objects::default()
    };
    let cloud = world(300_000).outliers(0.01).objects(objects);
    for [x, y, z] in points(&cloud) {
        for c in [x, y] {
            assert!((-10.0..OUTDOOR_SIDE + 10.0).contains(&c), "{x} {y}");
        }
        assert!((-1.01..30.0).contains(&(z - ground(x, y))) || z < 17.0 + 19.0);
    }
}

#[test]
fn open_ground_is_bare_and_objects_stand_in_discs() {
    let cloud = world(100_000);
    let discs = cloud.discs().unwrap();
    assert!(discs.len() > 60 + 400 + 25 * 10);
    let (mut open, mut inside) = (0, 0);
    let mut high = vec![false; 460];
    for [x, y, z] in points(&cloud) {
        let up = z - ground(x, y);
        if clearance(&discs, x, y) > 0.0 {
            assert!(up.abs() < 1e-9, "{x} {y}: {up}");
            open += 1;
        } else {
            inside += 1;
        }
        for (high, disc) in high.iter_mut().zip(&discs) {
            *high |= up > 2.0 && clearance(&[*disc], x, y) < -1.0;
        }
    }
    assert!((1.0..3.0).contains(&(f64::from(open) / f64::from(inside))));
    assert!(
        high.iter().all(|&high| high),
        "a house or tree without points"
    );
}

#[test]
fn parts_have_their_share() {
    let n = 300_000;
    let share = |cloud: Cloud, from: f64, to: f64| {
        let all = points(&cloud);
        let within = |p: &&[f64; 3]| (from..to).contains(&(p[2] - ground(p[0], p[1])));
        all.iter().filter(within).count() as f64 / n as f64
    };
    // Ground, without the part under this seed's houses and trees.
    let bare = share(world(n), -1e-9, 1e-9);
    assert!((0.80..0.86).contains(&bare), "{bare}");
    // No other point is that high.
    let birds = share(world(n).outliers(0.1), 16.0, 40.0);
    assert!((birds - 0.1 * 14.0 / 29.5).abs() < 0.004, "{birds}");
    // With twice the trees the other parts have fewer points.
    let trees = Objects {
        trees: 800,
        ..Objects::default()
    };
    let fewer = share(world(n).objects(trees), -1e-9, 1e-9);
    assert!((0.93..0.96).contains(&(fewer / bare)), "{fewer} {bare}");
    let low = Objects {
        wall_height: Some(0.3),
        ..Objects::default()
    };
    let more = share(world(n).objects(low), -1e-9, 1e-9);
    assert!((1.001..1.01).contains(&(more / bare)), "{more} {bare}");
}

#[test]
fn noise_is_in_units_and_spacing_is_told() {
    let cloud = world(200_000);
    let exact = points(&cloud);
    let noisy = points(&cloud.noise(0.25).noise_mode(NoiseMode::Isotropic));
    let sigma = |axis: usize| {
        let pairs = exact.iter().zip(&noisy);
        let square: f64 = pairs.map(|(a, b)| (a[axis] - b[axis]).powi(2)).sum();
        (square / 200_000.0).sqrt()
    };
    for axis in 0..3 {
        assert!((sigma(axis) - 0.25).abs() < 0.005, "{}", sigma(axis));
    }
    let spacing = |cloud: Cloud| cloud.generator().unwrap().outdoor_spacing();
    let spacing_of = spacing(world(4_500_000)).unwrap();
    assert!((spacing_of - 0.179).abs() < 0.001, "{spacing_of}");
    assert_eq!(spacing(Cloud::new(Kind::Plane)), None);
}

#[test]
fn settings_that_do_not_fit_are_refused() {
    let conflicts = [
        world(100).size(400.0),
        world(100).rotated(true),
        world(100).layers(2, 0.1),
        world(100).falloff(true),
        world(100).scanlines(5.0),
        world(100).sampling(Sampling::Regular),
        Cloud::new(Kind::Plane).objects(Objects {
            wires: 1,
            ..Objects::default()
        }),
    ];
    for cloud in conflicts {
        let error = cloud.generator().unwrap_err();
        assert!(matches!(error, Error::Conflict { .. }), "{error}");
    }
    let wrong = |trees, wires, wall_height| {
        let objects = Objects {
            trees,
            wires,
            wall_height,
            epoch: false,
        };
        world(100).objects(objects).generator().unwrap_err()
    };
    for (name, error) in [
        ("trees", wrong(u32::MAX, 0, None)),
        ("wires", wrong(0, u32::MAX, None)),
        ("wall-height", wrong(0, 0, Some(-1.0))),
        ("wall-height", wrong(0, 0, Some(f64::NAN))),
    ] {
        assert!(error.to_string().starts_with(name), "{error}");
    }
    assert!(Cloud::new(Kind::Plane).discs().is_err());
    let path = Path::new("any.ply");
    assert!(Cloud::new(Kind::Plane).measure_mesh(path).is_err());
    assert!(world(100).write_reference(path, 0.1).is_err());
    assert!(world(0).generator().unwrap().is_empty());
}

/// Cells across the patch of the measured meshes.
const CELLS: usize = 10;

/// A patch of open ground, half a unit each cell; and the position of its first corner.
fn patch(cloud: &Cloud) -> ([f64; 2], Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let discs = cloud.discs().unwrap();
    let places = (20..760).flat_map(|i| (20..760).map(move |j| [i, j].map(|k| 0.5 * f64::from(k))));
    let [x, y] = places
        .into_iter()
        .find(|[x, y]| clearance(&discs, x + 2.5, y + 2.5) > 4.5)
        .unwrap();
    let mut vertices = Vec::new();
    for k in 0..(CELLS + 1) * (CELLS + 1) {
        let (x, y) = (
            x + 0.5 * (k % (CELLS + 1)) as f64,
            y + 0.5 * (k / (CELLS + 1)) as f64,
        );
        vertices.push([x, y, ground(x, y)]);
    }
    let mut triangles = Vec::new();
    for k in 0..CELLS * CELLS {
        let a = (k / CELLS * (CELLS + 1) + k % CELLS) as u32;
        let b = a + CELLS as u32 + 1;
        triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    ([x, y], vertices, triangles)
}

fn area(vertices: &[[f64; 3]], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| vertices[v as usize]);
    let (u, v) = (
        [0, 1, 2].map(|k| b[k] - a[k]),
        [0, 1, 2].map(|k| c[k] - a[k]),
    );
    let cross =
        [0, 1, 2].map(|k| u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
    cross.iter().map(|c| c * c).sum::<f64>().sqrt() / 2.0
}

/// A binary mesh with additional properties.
fn bytes(vertices: &[[f64; 3]], triangles: &[[u32; 3]], double: bool) -> Vec<u8> {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\ncomment a test\n");
    let kind = if double { "double" } else { "float" };
    write!(
        header,
        "element vertex {}\nproperty uchar more\n",
        vertices.len()
    )
    .unwrap();
    for axis in ["x", "y", "z"] {
        writeln!(header, "property {kind} {axis}").unwrap();
    }
    writeln!(header, "element face {}", triangles.len()).unwrap();
    header.push_str("property list uchar int vertex_indices\nend_header\n");
    let mut bytes = header.into_bytes();
    for vertex in vertices {
        bytes.push(7);
        if double {
            bytes.extend(vertex.map(f64::to_le_bytes).as_flattened());
        } else {
            bytes.extend(vertex.map(|c| (c as f32).to_le_bytes()).as_flattened());
        }
    }
    for triangle in triangles {
        bytes.push(3);
        bytes.extend(triangle.map(u32::to_le_bytes).as_flattened());
    }
    bytes
}

fn measure(cloud: &Cloud, mesh: &[u8]) -> Result<GroundReport, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    fs::write(&path, mesh).unwrap();
    cloud.measure_mesh(&path)
}

#[test]
fn a_patch_of_ground_is_right() {
    for double in [false, true] {
        let cloud = world(0);
        let (_, vertices, triangles) = patch(&cloud);
        let report = measure(&cloud, &bytes(&vertices, &triangles, double)).unwrap();
        let all: f64 = triangles.iter().map(|&t| area(&vertices, t)).sum();
        assert_eq!(report.triangles, 200);
        assert_eq!((report.down_share, report.open_down_share), (0.0, 0.0));
        assert_eq!(
            (report.boundary_edges, report.open_boundary_edges),
            (40, 40)
        );
        assert!((report.open_area - all).abs() < 1e-3 * all, "{report:?}");
        assert_eq!(report.open_sail_area, 0.0);
    }
}

#[test]
fn faults_are_found() {
    // One triangle turned, one left out, one sail, and one sail over a house or tree.
    let offset = [5e5, 5.4e6, 300.0];
    let cloud = world(0).offset(offset);
    let ([x, y], mut vertices, mut triangles) = {
        let (_, vertices, triangles) = patch(&world(0));
        (vertices[0][..2].try_into().unwrap(), vertices, triangles)
    };
    let [x, y]: [f64; 2] = [x, y];
    triangles[50].swap(0, 1);
    triangles.remove(120);
    let [u, v, _] = world(0).discs().unwrap()[0];
    for (x, y) in [(x + 2.0, y + 2.0), (u, v)] {
        let first = vertices.len() as u32;
        let up = ground(x, y) + 12.0;
        vertices.extend([[x, y, up], [x + 1.0, y, up], [x, y + 1.0, up]]);
        triangles.push([first, first + 1, first + 2]);
    }
    let areas: Vec<f64> = triangles.iter().map(|&t| area(&vertices, t)).collect();
    let all: f64 = areas.iter().sum();
    for vertex in &mut vertices {
        (0..3).for_each(|k| vertex[k] += offset[k]);
    }
    let report = measure(&cloud, &bytes(&vertices, &triangles, true)).unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}: {report:?}");
    near(report.down_share, areas[50] / all);
    near(report.open_down_share, areas[50] / (all - 0.5));
    near(report.open_area, all - 0.5);
    near(report.open_sail_area, 0.5);
    assert_eq!(report.boundary_edges, 40 + 3 + 3 + 3);
    assert_eq!(report.open_boundary_edges, 40 + 3 + 3);
    let json = report.to_json();
    assert!(json.contains("\"open_boundary_edges\": 46}"), "{json}");
    assert!(!json.contains('\n'));
}

#[test]
fn nothing_to_measure_is_null() {
    let report = measure(&world(0), &bytes(&[], &[], true)).unwrap();
    let json = report.to_json();
    assert!(
        json.starts_with("{\"triangles\": 0, \"down_share\": null, "),
        "{json}"
    );
}

#[test]
fn what_is_no_mesh_is_refused() {
    let (_, vertices, triangles) = patch(&world(0));
    let good = bytes(&vertices, &triangles, false);
    let replaced = |from: &str, to: &str| {
        let at = good.windows(from.len()).position(|w| w == from.as_bytes());
        let at = at.unwrap();
        [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat()
    };
    let mut far = triangles.clone();
    far[7][1] = 121;
    let mut nan = vertices.clone();
    nan[3][2] = f64::NAN;
    let mut quad = good.clone();
    let at = quad.len() - 13;
    quad[at] = 4;
    for (mesh, said) in [
        (good[..good.len() - 1].to_vec(), "header asks for"),
        (
            bytes(&vertices, &far, true),
            "a corner beyond the 121 vertices",
        ),
        (bytes(&nan, &triangles, true), "not finite"),
        (quad, "a face of 4 corners"),
        (Vec::new(), "PLY header: found the end of the file"),
        (
            replaced("end_header\n", "end_heades\n"),
            "line 11: found \"end_heades\"",
        ),
        (replaced("binary_little_endian", "ascii"), "format ascii"),
        (
            replaced("float x", "int x"),
            "x, y and z must be float or double",
        ),
        (replaced("float y", "float x"), "2 properties named x"),
        (replaced("float z", "float w"), "no property z"),
        (
            replaced("list uchar int", "list uchar short"),
            "a list uchar int",
        ),
        (
            replaced("element face", "element camera"),
            "vertex and face",
        ),
        (
            replaced("vertex 121", "vertex 99999999999999999999"),
            "a number of elements, 0 or more",
        ),
        (
            replaced("vertex 121", "vertex 9999999999999999999"),
            "too many",
        ),
        (replaced("comment", "commend"), "line 3: found \"commend"),
    ] {
        let error = measure(&world(0), &mesh).unwrap_err();
        assert!(matches!(error, Error::Mesh { .. }), "{error}");
        assert!(error.to_string().contains(said), "{error}, not {said}");
        assert!(!error.to_string().contains('\n'));
    }
    let error = world(0).measure_mesh("/nonexistent/mesh.ply").unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
}
