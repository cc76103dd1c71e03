//! Binary glTF 2.0: a chunk of JSON and a chunk of vertices and indices.
//!
//! Positions are floats relative to a translation in the JSON, so that clouds far from their origin keep their
//! precision. With an origin of the mesh's own, that is not added back: as in other formats, coordinates are those
//! from it. The axes in the buffer are those of the cloud, with z up; a node above turns them, since y is up
//! in glTF.

use super::format::{
    CoordinateType, Exceeded, Layout, MADE_BY, Mesh, MeshFormat, Positions, VertexColumn, four, two,
};
use outcrop_codecs::glb::{FLOAT, FOR_INDICES, FOR_VERTICES, INDEX, SHORT, header};
use outcrop_codecs::light;
use outcrop_disk::workspace::fault;
use outcrop_ply::Scalar;
use serde_json::{Value, json};

/// Binary glTF.
pub struct Glb;

/// Bytes of a triangle: three indices.
const TRIANGLE: u64 = 12;

/// The matrix of a node that turns z up into y up, by columns.
pub const Y_UP: [i32; 16] = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1];

impl MeshFormat for Glb {
    fn name(&self) -> &'static str {
        "GLB"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["glb"]
    }

    fn wants_bounds(&self) -> bool {
        true
    }

    fn holds_doubles(&self) -> bool {
        // By its translation.
        true
    }

    fn has_compression(&self) -> bool {
        true
    }

    fn holds(&self, mesh: &Mesh, column: &VertexColumn) -> bool {
        mesh.is_colour_or_normal(column)
    }

    fn exceeded(&self, mesh: &Mesh) -> Option<Exceeded> {
        // How large it is if it is compressed is not known before.
        if mesh.compress {
            return None;
        }
        let (found, most) = (self.layout(mesh).bytes, most());
        (found > most).then_some(Exceeded {
            unit: "bytes",
            found,
            most,
        })
    }

    fn layout(&self, mesh: &Mesh) -> Layout {
        let record = Record::of(mesh);
        let binary = mesh.vertices * record.bytes as u64 + mesh.triangles * TRIANGLE;
        let json = document(mesh, &record).to_string().into_bytes();
        let header = header(json, binary);
        Layout::of(header, mesh, record.bytes as u64, TRIANGLE)
    }

    fn put_vertices(
        &self,
        mesh: &Mesh,
        positions: &[[f64; 3]],
        values: &[u8],
        bytes: &mut Vec<u8>,
    ) {
        let (shift, each) = (shift(mesh), mesh.value_bytes());
        let (normals, colours) = (mesh.normals(), mesh.colours());
        for (number, position) in positions.iter().enumerate() {
            let values = &values[number * each..][..each];
            for x in local(*position, shift) {
                bytes.extend_from_slice(&x.to_le_bytes());
            }
            for at in normals.into_iter().flatten() {
                bytes.extend_from_slice(&four(values, at));
            }
            if let Some(colour) = colours {
                put_colour(values, colour, bytes);
            }
        }
    }

    fn put_triangles(
        &self,
        _: &Mesh,
        triangles: &[[u32; 3]],
        _: &[Positions],
        bytes: &mut Vec<u8>,
    ) {
        for corner in triangles.as_flattened() {
            bytes.extend_from_slice(&corner.to_le_bytes());
        }
    }
}

/// Most bytes of a file.
pub fn most() -> u64 {
    fault::most(u32::MAX.into())
}

/// Bytes of the colour of a vertex: linear light in 16 bits, as glTF wants it, and opaque.
pub const COLOUR: usize = 8;

/// Appends the colour of a vertex; its components are at `places` of `values`.
pub fn put_colour(values: &[u8], (places, scalar): ([usize; 3], Scalar), bytes: &mut Vec<u8>) {
    for at in places {
        let light = match scalar {
            Scalar::U8 => light::of_byte(values[at]),
            _ => light::of_word(u16::from_le_bytes(two(values, at))),
        };
        bytes.extend_from_slice(&light.to_le_bytes());
    }
    bytes.extend_from_slice(&u16::MAX.to_le_bytes());
}

/// The material: not metallic, rough, seen from both sides.
pub fn material() -> Value {
    json!({
        "doubleSided": true,
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 1 },
    })
}

/// The parts of a vertex: its position, then what it has of these.
struct Record {
    /// Offset of the normal.
    normal: Option<usize>,
    /// Offset of the colour.
    colour: Option<usize>,
    bytes: usize,
}

impl Record {
    fn of(mesh: &Mesh) -> Self {
        let mut bytes = 12;
        let mut take = |size| {
            bytes += size;
            bytes - size
        };
        let normal = mesh.normals().map(|_| take(12));
        let colour = mesh.colours().map(|_| take(COLOUR));
        Self {
            normal,
            colour,
            bytes,
        }
    }
}

/// The position that is the origin of the positions in the file: none, or the middle of the mesh, rounded to a
/// sixteenth of its size or finer, if floats are not enough.
fn shift(mesh: &Mesh) -> [f64; 3] {
    let Some([low, high]) = mesh.bounds else {
        return [0.0; 3];
    };
    if mesh.coordinates == CoordinateType::Float {
        return [0.0; 3];
    }
    let sides = [0, 1, 2].map(|k| high[k] - low[k]);
    let part = sides.into_iter().fold(f64::MIN_POSITIVE, f64::max) / 16.0;
    // The power of two below it: that of its exponent alone.
    let unit = f64::from_bits(part.to_bits() & !((1 << 52) - 1)).max(f64::MIN_POSITIVE);
    [0, 1, 2].map(|k| {
        let middle = low[k] / 2.0 + high[k] / 2.0;
        let rounded = (middle / unit).round() * unit;
        if rounded.is_finite() { rounded } else { middle }
    })
}

/// A position as it is in the file. JSON has no infinite numbers.
fn local(position: [f64; 3], shift: [f64; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| ((position[k] - shift[k]) as f32).clamp(f32::MIN, f32::MAX))
}

/// The content of the chunk of JSON.
fn document(mesh: &Mesh, record: &Record) -> Value {
    let shift = shift(mesh);
    let vertices = mesh.vertices * record.bytes as u64;
    let indices = mesh.triangles * TRIANGLE;
    let bounds = mesh.bounds.unwrap_or_default();
    // The same arithmetic as for vertices, and rounding keeps the order.
    let [low, high] = bounds.map(|corner| local(corner, shift).map(f64::from));
    let mut attributes = json!({ "POSITION": 0 });
    let mut accessors = vec![
        json!({
            "bufferView": 0, "byteOffset": 0, "componentType": FLOAT, "count": mesh.vertices,
            "type": "VEC3", "min": low, "max": high,
        }),
        json!({
            "bufferView": 1, "componentType": INDEX, "count": 3 * mesh.triangles, "type": "SCALAR",
        }),
    ];
    if let Some(at) = record.normal {
        attributes["NORMAL"] = accessors.len().into();
        accessors.push(json!({
            "bufferView": 0, "byteOffset": at, "componentType": FLOAT, "count": mesh.vertices,
            "type": "VEC3",
        }));
    }
    if let Some(at) = record.colour {
        attributes["COLOR_0"] = accessors.len().into();
        accessors.push(json!({
            "bufferView": 0, "byteOffset": at, "componentType": SHORT, "normalized": true,
            "count": mesh.vertices, "type": "VEC4",
        }));
    }
    let mut asset = json!({ "version": "2.0", "generator": MADE_BY });
    if !mesh.comments.is_empty() {
        asset["extras"] = json!({ "comments": mesh.comments });
    }
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "y up", "matrix": Y_UP, "children": [1] },
            { "name": "mesh", "mesh": 0, "translation": shift },
        ],
        "meshes": [{
            "primitives": [{ "attributes": attributes, "indices": 1, "material": 0, "mode": 4 }],
        }],
        "materials": [material()],
        "accessors": accessors,
        "bufferViews": [
            {
                "buffer": 0, "byteOffset": 0, "byteLength": vertices, "byteStride": record.bytes,
                "target": FOR_VERTICES,
            },
            { "buffer": 0, "byteOffset": vertices, "byteLength": indices, "target": FOR_INDICES },
        ],
        "buffers": [{ "byteLength": vertices + indices }],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::format::normal_columns;

    fn mesh(scalar: Scalar) -> Mesh {
        let colours = ["red", "green", "blue"].map(|name| VertexColumn {
            name: name.into(),
            scalar,
        });
        Mesh {
            vertices: 1,
            triangles: 1,
            columns: colours.into_iter().chain(normal_columns()).collect(),
            comments: vec!["EPSG:25832 \"x\"\n".into()],
            coordinates: CoordinateType::Double,
            bounds: Some([[500_000.25, 0.0, -3.0], [500_100.25, 40.0, 3.0]]),
            ..Mesh::default()
        }
    }

    /// The document of a file that starts with this header.
    fn json_of(header: &[u8]) -> Value {
        serde_json::from_slice(&header[20..header.len() - 8]).unwrap()
    }

    #[test]
    fn colours_normals_and_comments_are_there() {
        // Half of the light of white, in sRGB.
        for (scalar, red, near) in [
            (Scalar::U8, vec![188], 600),
            (Scalar::U16, vec![83, 188], 100),
        ] {
            let mesh = mesh(scalar);
            let layout = Glb.layout(&mesh);
            assert_eq!(layout.vertices.bytes, 32);
            assert!(layout.vertices.at.is_multiple_of(4));
            let document = json_of(&layout.header);
            assert_eq!(document["asset"]["extras"]["comments"][0], mesh.comments[0]);
            let attributes = &document["meshes"][0]["primitives"][0]["attributes"];
            let accessor =
                |name: &str| &document["accessors"][attributes[name].as_u64().unwrap() as usize];
            assert_eq!(accessor("NORMAL")["byteOffset"], 12);
            assert_eq!(accessor("COLOR_0")["byteOffset"], 24);
            assert_eq!(accessor("COLOR_0")["componentType"], SHORT);
            // Rounded to four units: a sixteenth of the size is 6.25.
            let translation = &document["nodes"][1]["translation"];
            assert_eq!(*translation, json!([500_052.0, 20.0, 0.0]));

            let mut values = [red, vec![0; 2 * scalar.bytes()]].concat();
            values.extend([0f32, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()));
            let mut bytes = Vec::new();
            Glb.put_vertices(&mesh, &[[500_000.25, 40.0, 3.0]], &values, &mut bytes);
            let floats = [-51.75f32, 20.0, 3.0, 0.0, 0.0, 1.0];
            let floats = floats.map(f32::to_le_bytes);
            assert_eq!(&bytes[..24], floats.as_flattened());
            let red = u16::from_le_bytes(two(&bytes, 24));
            assert!(red.abs_diff(32767) < near, "{red}");
            assert_eq!(bytes[26..], [0, 0, 0, 0, 255, 255]);
            assert_eq!(bytes.len() as u64, layout.vertices.bytes);
        }
    }

    #[test]
    fn four_gibibytes_are_the_limit() {
        let mesh = |triangles| Mesh {
            vertices: 1000,
            triangles,
            ..Mesh::default()
        };
        let most = u64::from(u32::MAX);
        // The length of the JSON grows with the counts.
        let fixed = Glb.layout(&mesh(357_000_000)).bytes - 357_000_000 * 12;
        let triangles = (most - fixed) / 12;
        assert_eq!(Glb.exceeded(&mesh(triangles)), None);
        let exceeded = Glb.exceeded(&mesh(triangles + 1)).unwrap();
        assert_eq!((exceeded.unit, exceeded.most), ("bytes", most));
        assert!(exceeded.found > most && exceeded.found < most + 13);
    }

    #[test]
    fn a_translation_of_any_bounds_is_a_number() {
        for bounds in [
            [[0.0; 3]; 2],
            [[5e-324; 3], [1e-320; 3]],
            [[-1e308; 3], [1e308; 3]],
            [[1e300, 1.0, 2.0], [1e300, 1.0, 2.0]],
        ] {
            let mesh = Mesh {
                coordinates: CoordinateType::Double,
                bounds: Some(bounds),
                ..Mesh::default()
            };
            assert!(shift(&mesh).iter().all(|x| x.is_finite()), "{bounds:?}");
        }
    }
}
