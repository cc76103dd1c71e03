//! Readers of mesh files that know only what the program writes.

use outcrop_ply::{Header, Property};

/// A mesh as it is in a file.
#[derive(Debug, Default, PartialEq)]
pub struct Mesh {
    pub vertices: Vec<[f64; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

fn four(bytes: &[u8], at: usize) -> [u8; 4] {
    bytes[at..at + 4].try_into().unwrap()
}

fn float(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(four(bytes, at))
}

fn integer(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(four(bytes, at))
}

fn three<T>(from: impl Fn(usize) -> T) -> [T; 3] {
    std::array::from_fn(from)
}

/// A PLY mesh, and true if its coordinates have double precision.
pub fn ply(bytes: &[u8]) -> (Mesh, bool) {
    let header = Header::read(&mut &*bytes).unwrap();
    let element = |name| header.element(name).unwrap().unwrap().1;
    let (vertex, face) = (element("vertex"), element("face"));
    let [(first, scalar), ..] = vertex.coordinates().unwrap();
    assert_eq!(first, 0);
    let wide = scalar.bytes();
    let size = vertex.record_bytes().unwrap();
    let names: Vec<&str> = vertex.properties.iter().map(|p| &*p.0).collect();
    let has_normals = names.get(3..6) == Some(&["nx", "ny", "nz"]);
    let mut mesh = Mesh::default();
    let (vertices, faces) = bytes[header.bytes as usize..].split_at(size * vertex.count as usize);
    for row in vertices.chunks_exact(size) {
        mesh.vertices.push(three(|k| match wide {
            8 => f64::from_le_bytes(row[8 * k..8 * k + 8].try_into().unwrap()),
            _ => float(row, 4 * k).into(),
        }));
        if has_normals {
            mesh.normals.push(three(|k| float(row, 3 * wide + 4 * k)));
        }
    }
    assert!(matches!(face.properties[0].1, Property::List { .. }));
    assert_eq!(faces.len(), 13 * face.count as usize);
    for row in faces.chunks_exact(13) {
        assert_eq!(row[0], 3);
        mesh.triangles.push(three(|k| integer(row, 1 + 4 * k)));
    }
    (mesh, wide == 8)
}

/// An OBJ mesh, and the number of decimals. All lines of a kind have one length.
pub fn obj(bytes: &[u8]) -> (Mesh, usize) {
    let text = std::str::from_utf8(bytes).unwrap();
    let mut mesh = Mesh::default();
    let mut lengths = std::collections::HashMap::new();
    let mut decimals = 0;
    for line in text.lines() {
        let mut words = line.split_ascii_whitespace();
        let kind = words.next().unwrap();
        let words: Vec<&str> = words.collect();
        if kind == "#" {
            continue;
        }
        assert_eq!(
            *lengths.entry(kind).or_insert(line.len()),
            line.len(),
            "{line}"
        );
        let number = |k: usize| words[k].parse::<f64>().unwrap();
        match kind {
            "v" => {
                mesh.vertices.push(three(number));
                decimals = words[0].split_once('.').map_or(0, |(_, after)| after.len());
            }
            "vn" => mesh.normals.push(three(|k| number(k) as f32)),
            "f" => mesh.triangles.push(three(|k| {
                let mut parts = words[k].split("//");
                let vertex: u32 = parts.next().unwrap().parse().unwrap();
                match parts.next() {
                    Some(normal) => assert_eq!(normal.parse(), Ok(vertex)),
                    None => assert!(mesh.normals.is_empty()),
                }
                vertex - 1
            })),
            _ => panic!("{line}"),
        }
    }
    (mesh, decimals)
}

/// The triangles of an STL file: normal and corners.
pub fn stl(bytes: &[u8]) -> Vec<[[f32; 3]; 4]> {
    assert!(!bytes.starts_with(b"solid"));
    let count = integer(bytes, 80) as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let vector = |row: &[u8], n: usize| three(|k| float(row, 12 * n + 4 * k));
    let rows = bytes[84..].chunks_exact(50);
    rows.map(|row| std::array::from_fn(|n| vector(row, n)))
        .collect()
}

/// A GLB file: positions as they are in it, and its translation.
pub fn glb(bytes: &[u8]) -> (Mesh, [f64; 3]) {
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!(integer(bytes, 4), 2);
    assert_eq!(integer(bytes, 8) as usize, bytes.len());
    let json = integer(bytes, 12) as usize;
    assert!(json.is_multiple_of(4) && &bytes[16..20] == b"JSON");
    let document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json]).unwrap();
    let binary = &bytes[20 + json..];
    assert_eq!(&binary[4..8], b"BIN\0");
    assert_eq!(integer(binary, 0) as usize, binary.len() - 8);
    let buffer = &binary[8..];
    let number = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
    assert_eq!(number(&document["buffers"][0]["byteLength"]), buffer.len());
    let rows = |accessor: &serde_json::Value, size: usize| -> Vec<Vec<u8>> {
        let view = &document["bufferViews"][number(&accessor["bufferView"])];
        let stride = view["byteStride"].as_u64().map_or(size, |s| s as usize);
        let start = number(&view["byteOffset"]);
        let view = &buffer[start..start + number(&view["byteLength"])];
        let first = accessor["byteOffset"].as_u64().unwrap_or(0) as usize;
        let row = |n: usize| view[first + n * stride..][..size].to_vec();
        (0..number(&accessor["count"])).map(row).collect()
    };
    let primitive = &document["meshes"][0]["primitives"][0];
    let accessor = |value: &serde_json::Value| &document["accessors"][number(value)];
    let vectors = |value: &serde_json::Value| -> Vec<[f32; 3]> {
        let rows = rows(accessor(value), 12);
        rows.iter()
            .map(|row| three(|k| float(row, 4 * k)))
            .collect()
    };
    let attributes = &primitive["attributes"];
    let places = vectors(&attributes["POSITION"]);
    let normals = attributes.get("NORMAL").map(vectors).unwrap_or_default();
    // The bounds are those of the numbers in the file.
    let bound = |name: &str, k: usize| accessor(&attributes["POSITION"])[name][k].as_f64();
    for k in 0..3 {
        let all = || places.iter().map(|p| p[k]);
        let (low, high) = (all().reduce(f32::min), all().reduce(f32::max));
        assert_eq!(bound("min", k), low.map(f64::from));
        assert_eq!(bound("max", k), high.map(f64::from));
    }
    let indices = rows(accessor(&primitive["indices"]), 4);
    let indices: Vec<u32> = indices.iter().map(|row| integer(row, 0)).collect();
    // z of the cloud is y of glTF, and y of the cloud is -z.
    let matrix = document["nodes"][0]["matrix"].as_array().unwrap();
    let columns: Vec<f64> = matrix.iter().map(|x| x.as_f64().unwrap()).collect();
    assert_eq!(columns[..11], [1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0.]);
    let translation = &document["nodes"][1]["translation"];
    let mesh = Mesh {
        vertices: places.iter().map(|p| p.map(f64::from)).collect(),
        normals,
        triangles: indices.chunks_exact(3).map(|t| three(|k| t[k])).collect(),
    };
    (mesh, three(|k| translation[k].as_f64().unwrap()))
}
