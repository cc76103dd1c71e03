//! Meshes as surfaces, and surfaces as meshes.

use std::{collections::HashMap, fs, path::Path};

use outcrop_cloudgen::{Cloud, Error, Kind, Sampling};

/// A box of 4 x 2 x 1 as OBJ, with quadrilaterals.
const BOX: &str = "o box\nv 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 0\nv 0 0 1\nv 4 0 1\nv 4 2 1\nv 0 2 1\n\
                   f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

fn file(folder: &Path, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path
}

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Reads what `write_reference` wrote.
fn reference(cloud: &Cloud, folder: &Path) -> Mesh {
    let path = folder.join("reference.ply");
    cloud.write_reference(&path, 1e-5).unwrap();
    let bytes = fs::read(path).unwrap();
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap()
        + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |name: &str| -> usize {
        let (_, rest) = header.split_once(name).unwrap();
        rest.lines().next().unwrap().parse().unwrap()
    };
    let (vertices, faces) = (count("element vertex "), count("element face "));
    let (body, rest) = bytes[end..].split_at(24 * vertices);
    assert_eq!(rest.len(), 13 * faces);
    let f64_at = |c: &[u8]| f64::from_le_bytes(c.try_into().unwrap());
    let u32_at = |c: &[u8]| u32::from_le_bytes(c.try_into().unwrap());
    let triples = |c: &[u8]| [0, 1, 2].map(|k| f64_at(&c[8 * k..8 * k + 8]));
    let corners = |c: &[u8]| [0, 1, 2].map(|k| u32_at(&c[1 + 4 * k..5 + 4 * k]));
    (
        body.chunks(24).map(triples).collect(),
        rest.chunks(13).map(corners).collect(),
    )
}

/// True if every edge has a triangle on either side; the Euler characteristic; six times the volume.
fn properties((vertices, triangles): &Mesh) -> (bool, i64, f64) {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    let mut volume = 0.0;
    for t in triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a, b)).or_default() += 1;
        }
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        volume += a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    let closed = edges
        .iter()
        .all(|(&(a, b), &n)| n == 1 && edges.contains_key(&(b, a)));
    let euler = vertices.len() as i64 - edges.len() as i64 / 2 + triangles.len() as i64;
    (closed, euler, volume)
}

#[test]
fn references_are_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    for kind in Kind::ALL {
        let offset = [5e3, -7e3, 20.0];
        let cloud = Cloud::new(kind).points(1000).rotated(true).offset(offset);
        let mesh = reference(&cloud, folder.path());
        let generator = cloud.generator().unwrap();
        for &vertex in mesh.0.iter().step_by(97) {
            assert!(generator.distance(vertex) < 1e-7, "{kind}");
        }
        let middle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.0[v as usize]);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let flat = mesh
            .1
            .iter()
            .step_by(97)
            .map(|t| generator.distance(middle(t)));
        let flat = flat.fold(0.0, f64::max);
        // The terrain is rough at every scale.
        let most = if kind == Kind::Terrain { 0.1 } else { 0.025 };
        assert!(flat < most, "{kind}: {flat}");
        if let (Some(euler), false) = (cloud.euler_characteristic(), kind == Kind::Room) {
            let (closed, found, volume) = properties(&mesh);
            assert!(closed && volume > 0.0, "{kind}");
            assert_eq!(found, euler, "{kind}");
        }
    }
}

#[test]
fn a_mesh_is_sampled_by_area() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(folder.path(), "box.obj", BOX);
    let unit = 1000.0 / 21f64.sqrt();
    for sampling in [Sampling::Uniform, Sampling::Regular, Sampling::Adaptive] {
        let cloud = Cloud::of_mesh(&path).points(14_000).sampling(sampling);
        let generator = cloud.generator().unwrap();
        let mut counts = [0; 3];
        for index in 0..generator.len() {
            let sample = generator.sample(index);
            assert!(generator.distance(sample.position) < 1e-8);
            let axis = sample.normal.iter().position(|c| c.abs() > 0.5).unwrap();
            counts[axis] += 1;
            let half = [2.0, 1.0, 0.5][axis] * unit;
            let height = sample.position[axis] * sample.normal[axis];
            assert!((height - half).abs() < 1e-8, "outward and centred");
        }
        if sampling != Sampling::Adaptive {
            let near = |found: i32, wanted: i32| (found - wanted).abs() < 300;
            let fair = near(counts[0], 2000) && near(counts[1], 4000) && near(counts[2], 8000);
            assert!(fair, "{sampling:?} {counts:?}");
        }
    }
    let mesh = reference(&Cloud::of_mesh(&path), folder.path());
    assert_eq!((mesh.0.len(), mesh.1.len()), (8, 12));
    let (closed, euler, volume) = properties(&mesh);
    assert!(closed && euler == 2);
    assert!((volume / (6.0 * 8.0 * unit.powi(3)) - 1.0).abs() < 1e-9);
}

#[test]
fn ply_and_obj_give_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let obj = file(folder.path(), "box.obj", BOX);
    let numbers = |letter: char| {
        let lines = BOX.lines().filter(move |line| line.starts_with(letter));
        lines.map(|line| line[2..].to_owned())
    };
    let mut ply = String::from(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n\
         property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n",
    );
    numbers('v').for_each(|line| ply += &format!("{line}\n"));
    for line in numbers('f') {
        let corners: Vec<i32> = line.split(' ').map(|c| c.parse().unwrap()).collect();
        let corners = corners.iter().map(|c| (c - 1).to_string());
        ply += &format!("4 {}\n", corners.collect::<Vec<_>>().join(" "));
    }
    let ply = file(folder.path(), "box.ply", &ply);
    let points = |path: &Path| -> Vec<[f64; 3]> {
        let cloud = Cloud::of_mesh(path).points(100);
        cloud.generator().unwrap().iter().collect()
    };
    assert_eq!(points(&obj), points(&ply));
}

#[test]
fn what_is_written_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torus.ply");
    let torus = Cloud::new(Kind::Torus).points(10);
    torus.write_reference(&path, 1e-4).unwrap();
    let generator = torus.generator().unwrap();
    let copy = Cloud::of_mesh(&path).points(500);
    for p in copy.generator().unwrap().iter() {
        assert!(generator.distance(p) < 0.25);
    }
}

#[test]
fn bad_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                end_header\n";
    let ply = |rest: &str| format!("{head}{rest}");
    let cases = [
        ("a.stl", String::from("solid")),
        ("a.obj", String::new()),
        (
            "b.obj",
            String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        ),
        (
            "c.obj",
            String::from("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        ),
        ("d.obj", String::from("v 0 0 x\n")),
        (
            "e.obj",
            String::from("v 0 0 0\nv nan 0 0\nv 2 1 0\nf 1 2 3\n"),
        ),
        ("a.ply", String::from("plx\n")),
        ("b.ply", ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 5\n")),
        ("c.ply", ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n")),
        ("d.ply", ply("0 0 0\n1 0 0\n")),
        ("e.ply", ply("0 0 0\n1e308 0 0\n-1e308 1e308 0\n3 0 1 2\n")),
        ("f.ply", ply("0 0 0\n1 0 0\n0 1 0\n2 0 1\n")),
    ];
    for (name, text) in cases {
        let path = file(folder.path(), name, &text);
        let error = Cloud::of_mesh(&path).generator().unwrap_err();
        let expected = matches!(error, Error::Mesh { .. });
        assert!(
            expected && !error.to_string().contains('\n'),
            "{name}: {error}"
        );
    }
    let missing = Cloud::of_mesh(folder.path().join("none.ply"));
    assert!(matches!(missing.generator(), Err(Error::Io { .. })));
    let torus = Cloud::new(Kind::Torus);
    for tolerance in [0.0, 1.0, f64::NAN] {
        assert!(torus.write_reference("/dev/null", tolerance).is_err());
    }
    assert!(missing.write_reference("/dev/null", 1e-5).is_err());
}
