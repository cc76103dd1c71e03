//! Small meshes in each format, damaged ones, and many vertices in little memory.

mod ply;

use super::*;
use crate::light;
use crate::ply_mesh::{PlyMesh, Sink, holds_faces};
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_ply::Scalar;
use proptest::prelude::*;
use serde_json::{Value, json};
use std::sync::Arc;

#[derive(Debug, Default, PartialEq)]
struct Got {
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

impl Sink for Got {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.positions.extend(positions);
        Ok(())
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.values.extend(values);
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.triangles.extend(triangles);
        Ok(())
    }
}

fn workspace(folder: &Path) -> Workspace {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    Workspace::new(folder, memory, 2, Arc::new(Silent), Cancel::new()).unwrap()
}

/// Reads a file with this name and these bytes.
fn read(name: &str, bytes: &[u8]) -> Result<Got> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_file(&path, &workspace(folder.path()))
}

fn read_file(path: &Path, workspace: &Workspace) -> Result<Got> {
    assert!(holds_faces(path)?);
    let mesh = PlyMesh::open_any(path, workspace)?;
    let columns = mesh.columns().into_iter();
    let columns = columns.map(|(index, _, scalar)| (index, scalar)).collect();
    let mut got = Got::default();
    mesh.wanting(columns).read(&mut got)?;
    Ok(got)
}

/// What an error says after the name of the file.
fn said(result: Result<Got>) -> String {
    let text = result.unwrap_err().to_string();
    text.split_once(": ").unwrap().1.to_owned()
}

const SQUARE: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.5],
];

#[test]
fn obj_has_faces_of_all_kinds() {
    let vertices =
        "# a square\no one\nv 0 0 0\nv 1 0 0 1.0\nv 1.0e0 1 0\nvt 0 0\nvn 0 0 1\nv 0 1 .5\n";
    let quad = [[0, 1, 2], [0, 2, 3]];
    for faces in [
        "f 1 2 3 4\n",
        "f 1/1 2/1 3/1 4/1",
        "f 1//1 2//1 3//1 4//1\r\n",
        "f -4 -3 -2 -1\n",
        "f 1 2 \\\n3 4\n",
        "f 1/1/1 2/1/1 3/1/1\ns off\ng two\nf 1 3 4\nl 1 2\nf 1 2\n",
    ] {
        let got = read("a.obj", format!("{vertices}{faces}").as_bytes()).unwrap();
        assert_eq!(got.positions, SQUARE, "{faces}");
        assert_eq!(got.triangles, quad, "{faces}");
        assert!(got.values.is_empty());
    }
    // A face may come before its vertices.
    let got = read("b.OBJ", format!("f 1 2 3\n{vertices}").as_bytes()).unwrap();
    assert_eq!(got.triangles, [[0, 1, 2]]);
}

#[test]
fn obj_has_colours_of_vertices_or_of_materials() {
    let text = "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 2\nv 1 1 0\nf 1 2 3\n";
    let got = read("a.obj", text.as_bytes()).unwrap();
    let (red, other, white) = ([255.0, 0.0, 0.0], [0.0, 128.0, 255.0], [255.0; 3]);
    assert_eq!(got.values, [red, other, white].concat());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let library =
        "newmtl a b\nKd 1 0 0\nmap_Kd x.png\nnewmtl unused\nKd 0 1 0\nnewmtl c\nKd 0 0 1\n";
    std::fs::write(folder.path().join("a b.mtl"), library).unwrap();
    let text = "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 2\nv 3 3 3\nf 1 2 3\n\
                usemtl a b\nf 1 3 4\nusemtl c\nf 3 4 5\nusemtl none\nf 4 5 6\n";
    std::fs::write(&path, text).unwrap();
    let got = read_file(&path, &workspace(folder.path())).unwrap();
    let blue = [0.0, 0.0, 255.0];
    assert_eq!(got.values, [red, white, red, red, blue, white].concat());
}

#[test]
fn obj_that_is_damaged_has_one_clear_line() {
    let wrong = |text: &str| said(read("a.obj", text.as_bytes()));
    assert_eq!(
        wrong("v 0 0 0\nv 0 x 0\n"),
        "line 2: found \"v 0 x 0\", expected v and numbers"
    );
    assert_eq!(
        wrong("v 0 0\n"),
        "line 1: found \"v 0 0\", expected v and three finite numbers"
    );
    assert_eq!(
        wrong("v 0 0 0\nf 1 1 2\n"),
        "faces: found a corner with number 2, expected numbers up to 1"
    );
    for corner in ["0", "-2", "x", "99999999999", "-9223372036854775808"] {
        let found = wrong(&format!("v 0 0 0\nf 1 1 {corner}\n"));
        assert!(
            found.contains("expected f and numbers of vertices"),
            "{found}"
        );
    }
    assert!(wrong("").starts_with("content: found 0 vertices"));
    let long = format!("v 0 0 {}", "0".repeat(1 << 20));
    assert!(wrong(&long).contains("lines of less than"));
}

/// A binary STL of these triangles.
fn stl(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        let parts = triangle.as_flattened().iter();
        bytes.extend(parts.flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_joins_corners_in_both_kinds() {
    let [a, b, c, d] = SQUARE.map(|p| p.map(|x| x as f32));
    let negative_zero = [-0.0, 0.0, -0.0];
    let binary = stl(&[[a, b, c], [negative_zero, c, d]]);
    let expected = Got {
        positions: SQUARE.to_vec(),
        values: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    assert_eq!(read("a.stl", &binary).unwrap(), expected);
    // Its text may be that of the other kind.
    let mut solid = binary.clone();
    solid[..5].copy_from_slice(b"solid");
    assert_eq!(read("a.stl", &solid).unwrap(), expected);
    let text = "solid x\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  VERTEX 1 0 0\n  vertex 1 1 0\n endloop\n\
                endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e0 1 0\nvertex 0 1 0.5\nendloop\n\
                endfacet\nendsolid\n";
    assert_eq!(read("a.stl", text.as_bytes()).unwrap(), expected);

    let wrong = |bytes: &[u8]| said(read("a.stl", bytes));
    let found = "header: found 2 triangles in 183 bytes, expected 184 bytes, or a file that begins with \"solid\"";
    assert_eq!(wrong(&binary[..183]), found);
    let lost = text.replace("vertex 1e0 1 0\n", "");
    let found = "line 14: found \"endfacet\", expected three corners before it";
    assert_eq!(wrong(lost.as_bytes()), found);
    let nan = stl(&[[a, b, [f32::NAN; 3]]]);
    assert!(wrong(&nan).contains("expected finite coordinates"));
    assert!(wrong(b"").starts_with("header: found 0 triangles"));
}

/// Corners of a grid of squares, each as two triangles: joined they are as many as the grid has.
#[test]
fn corners_are_joined_in_little_memory() {
    let side = 400;
    let at = |x: usize, y: usize| [x as f32, y as f32, ((x * 7 + y * 13) % 10) as f32];
    let squares = (0..side * side).map(|n| (n % side, n / side));
    let triangles: Vec<_> = squares
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let got = read("grid.stl", &stl(&triangles)).unwrap();
    assert_eq!(got.positions.len(), (side + 1) * (side + 1));
    assert_eq!(got.triangles.len(), triangles.len());
    let mut next = 0;
    for (corners, triangle) in got.triangles.iter().zip(&triangles) {
        let positions = corners.map(|v| got.positions[v as usize]);
        assert_eq!(positions, triangle.map(|p| p.map(f64::from)));
        // They are numbered as they come.
        for corner in corners {
            assert!(*corner <= next);
            next = next.max(corner + 1);
        }
    }
}

/// A GLB of a document and a buffer.
fn glb(mut document: Value, buffer: &[u8]) -> Vec<u8> {
    document["asset"] = json!({ "version": "2.0" });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((buffer.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(buffer);
    bytes
}

/// The square of two triangles with y up, with indices of bytes, below a node that moves it.
fn square() -> (Value, Vec<u8>) {
    let mut buffer = Vec::new();
    for [x, y, z] in SQUARE {
        let turned = [x as f32, z as f32, -y as f32];
        buffer.extend(turned.iter().flat_map(|x| x.to_le_bytes()));
    }
    buffer.extend([0u8, 1, 2, 0, 2, 3, 0, 0]);
    let document = json!({
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "children": [1], "translation": [10.0, 0.0, 0.0] }, { "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 6 },
        ],
        "buffers": [{ "byteLength": 56 }],
    });
    (document, buffer)
}

fn moved(shift: f64) -> Vec<[f64; 3]> {
    SQUARE.map(|[x, y, z]| [x + shift, y, z]).to_vec()
}

#[test]
fn glb_is_where_its_nodes_put_it() {
    let (mut document, buffer) = square();
    let got = read("a.glb", &glb(document.clone(), &buffer)).unwrap();
    assert_eq!(got.positions, moved(10.0));
    assert_eq!(got.triangles, [[0, 1, 2], [0, 2, 3]]);
    // The format is known by its beginning.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh");
    std::fs::write(&path, glb(document.clone(), &buffer)).unwrap();
    assert_eq!(read_file(&path, &workspace(folder.path())).unwrap(), got);

    // A second time, mirrored: the vertices on the mirror are joined, and the triangles turned.
    document["nodes"][0]["children"] = json!([1, 2]);
    let mirror = json!({ "mesh": 0, "scale": [-1.0, 1.0, 1.0] });
    document["nodes"].as_array_mut().unwrap().push(mirror);
    let got = read("a.glb", &glb(document.clone(), &buffer)).unwrap();
    assert_eq!(got.positions.len(), 6);
    assert_eq!(got.triangles[2..], [[4, 0, 5], [5, 0, 3]]);
    // A quarter turn about the axis that is up.
    document["nodes"][2] =
        json!({ "mesh": 0, "rotation": [0.0, 0.5f64.sqrt(), 0.0, 0.5f64.sqrt()] });
    let got = read("a.glb", &glb(document, &buffer)).unwrap();
    let turned = got.positions[4];
    assert!((turned[0] - 10.0).abs() < 1e-9 && (turned[1] - 1.0).abs() < 1e-9);
}

#[test]
fn glb_has_strips_fans_and_colours() {
    let (mut document, buffer) = square();
    document["meshes"][0]["primitives"][0] = json!({ "attributes": { "POSITION": 0 }, "mode": 6 });
    let fan = read("a.glb", &glb(document.clone(), &buffer)).unwrap();
    assert_eq!(fan.triangles, [[0, 1, 2], [0, 2, 3]]);
    document["meshes"][0]["primitives"][0]["mode"] = json!(5);
    let strip = read("a.glb", &glb(document.clone(), &buffer)).unwrap();
    assert_eq!(strip.triangles, [[0, 1, 2], [2, 1, 3]]);
    document["meshes"][0]["primitives"][0]["mode"] = json!(1);
    assert!(said(read("a.glb", &glb(document, &buffer))).starts_with("content: found 0"));

    let (mut document, mut buffer) = square();
    // White, red and the middle grey of sRGB, in linear light of 16 bits.
    let grey = light::of_byte(128);
    for colour in [[u16::MAX; 3], [u16::MAX, 0, 0], [grey; 3], [0; 3]] {
        buffer.extend(colour.iter().flat_map(|x| x.to_le_bytes()));
        buffer.extend([0; 2]);
    }
    document["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "buffer": 0, "byteOffset": 56, "byteLength": 32, "byteStride": 8 }));
    document["accessors"].as_array_mut().unwrap().push(
        json!({ "bufferView": 2, "componentType": 5123, "count": 4, "type": "VEC3", "normalized": true }),
    );
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(2);
    let got = read("a.glb", &glb(document.clone(), &buffer)).unwrap();
    let expected = [[255.0; 3], [255.0, 0.0, 0.0], [128.0; 3], [0.0; 3]];
    assert_eq!(got.values, expected.concat());

    let (mut document, buffer) = square();
    document["materials"] =
        json!([{ "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.0, 0.0, 1.0] } }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let got = read("a.glb", &glb(document, &buffer)).unwrap();
    assert_eq!(got.values, [[255.0, 0.0, 0.0]; 4].concat());
}

#[test]
fn glb_is_read_compressed() {
    let (mut document, buffer) = square();
    let packed = crate::meshopt::vertices(&buffer[..48], 12);
    let extension = json!({
        "buffer": 0, "byteLength": packed.len(), "byteStride": 12, "count": 4, "mode": "ATTRIBUTES",
    });
    let at = packed.len().next_multiple_of(4);
    let mut all = packed;
    all.resize(at, 0);
    all.extend(&buffer[48..]);
    document["bufferViews"][0] = json!({
        "buffer": 1, "byteLength": 48, "extensions": { "EXT_meshopt_compression": extension },
    });
    document["bufferViews"][1]["byteOffset"] = json!(at);
    document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let got = read("a.glb", &glb(document.clone(), &all)).unwrap();
    assert_eq!(got.positions, moved(10.0));
    all[3] ^= 0xff;
    let damaged = said(read("a.glb", &glb(document.clone(), &all)));
    assert!(
        damaged.starts_with("buffer view 0: found what cannot be decoded"),
        "{damaged}"
    );
    document["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    assert_eq!(
        said(read("a.glb", &glb(document, &all))),
        "JSON: found the required extension KHR_draco_mesh_compression, expected no compression but \
         EXT_meshopt_compression"
    );
}

#[test]
fn glb_that_is_damaged_has_one_clear_line() {
    type Change = (&'static str, Value, &'static str);
    let changes: [Change; 9] = [
        ("/nodes/1/children", json!([0]), "node 0 below two nodes"),
        ("/nodes/1/mesh", json!(7), "mesh 7"),
        ("/scenes/0/nodes", json!([9]), "node 9"),
        ("/accessors/0/count", json!(5), "5 elements every 12 bytes"),
        ("/accessors/0/type", json!("VEC2"), "VEC2"),
        ("/accessors/0/componentType", json!(1), "type 1"),
        (
            "/bufferViews/0/byteLength",
            json!(1u64 << 40),
            "bytes from byte 0",
        ),
        (
            "/bufferViews/0/buffer",
            json!(1),
            "a buffer outside the file",
        ),
        ("/meshes/0/primitives/0/indices", json!(0), "VEC3"),
    ];
    for (place, value, expected) in changes {
        let (mut document, buffer) = square();
        match document.pointer_mut(place) {
            Some(at) => *at = value,
            None => document["nodes"][1]["children"] = value,
        }
        let found = said(read("a.glb", &glb(document, &buffer)));
        assert!(found.contains(expected), "{place}: {found}");
    }
    let (mut document, mut buffer) = square();
    buffer[53] = 4;
    let found = said(read("a.glb", &glb(document.clone(), &buffer)));
    assert_eq!(found, "indices: found 4, expected the number of a vertex");
    document["accessors"][0]["sparse"] = json!({});
    assert!(said(read("a.glb", &glb(document, &buffer))).contains("a sparse one"));
    assert!(said(read("a.glb", b"glTF\x01\0\0\0")).contains("found version 1"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Changed bytes give an error or a mesh, and no panic.
    #[test]
    fn changed_files_are_refused_or_read(kind in 0..4, changes in prop::collection::vec((any::<u16>(), any::<u8>()), 1..6)) {
        let (name, mut bytes) = match kind {
            0 => ("a.obj", b"v 0 0 0\nv 1 0 0 1\nv 1 1 0 1 0 1\nusemtl a\nf 1 2/1 -1//2\nmtllib a.mtl\n".to_vec()),
            3 => ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 4\nproperty uchar red\nproperty float x\n\
                property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\n\
                end_header\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n4 0 1 2 3\n".to_vec()),
            1 => ("a.stl", stl(&[[[0.0; 3], [1.0; 3], [2.0, 0.0, 1.0]]])),
            _ => {
                let (document, buffer) = square();
                ("a.glb", glb(document, &buffer))
            }
        };
        for (at, byte) in changes {
            let at = usize::from(at) % bytes.len();
            bytes[at] = byte;
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let workspace = workspace(folder.path());
        if let Ok(mesh) = PlyMesh::open_any(&path, &workspace) {
            prop_assert!(kind == 3 || mesh.columns().iter().all(|(_, _, scalar)| *scalar == Scalar::U8));
            prop_assert!(mesh.read(&mut Got::default()).is_ok());
        }
    }
}
