//! A reader of tilesets, for tests: every tile as triangles with exact coordinates.

use outcrop_codecs::meshopt;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// A tile.
pub struct Tile {
    pub level: u64,
    pub error: f64,
    pub bytes: usize,
    pub children: Vec<usize>,
    /// Positions in steps from the origin of the tileset, with the bits of `_LOW`.
    pub exact: Vec<[i64; 3]>,
    /// The same without `_LOW`: as they are drawn.
    pub drawn: Vec<[i64; 3]>,
    pub normals: Vec<[i8; 3]>,
    /// Other attributes by name, as they are in the file, of four bytes or eight for each vertex.
    pub others: BTreeMap<String, Vec<u8>>,
    pub triangles: Vec<[u32; 3]>,
    pub lines: Vec<[u32; 2]>,
    /// Centre and half sides of the box.
    pub volume: [f64; 6],
    /// True if positions have 16 bits.
    pub is_short: bool,
}

/// A tileset; the first tile is the root.
pub struct Tileset {
    pub json: Value,
    pub tiles: Vec<Tile>,
    pub origin: [f64; 3],
    pub step: f64,
}

impl Tileset {
    pub fn read(folder: &Path) -> Self {
        let json: Value =
            serde_json::from_slice(&std::fs::read(folder.join("tileset.json")).unwrap()).unwrap();
        let about = &json["extras"]["outcrop"];
        assert_eq!(about["version"], 1);
        let number = |value: &Value| value.as_f64().unwrap();
        let step = number(&about["step"][0]);
        let mut tileset = Self {
            origin: std::array::from_fn(|k| number(&about["origin"][k])),
            step,
            tiles: Vec::new(),
            json: Value::Null,
        };
        assert_eq!(json["asset"]["version"], "1.1");
        assert_eq!(json["root"]["refine"], "REPLACE");
        tileset.tile(folder, &json["root"], step);
        tileset.json = json;
        tileset
    }

    fn tile(&mut self, folder: &Path, json: &Value, step: f64) -> usize {
        let uri = json["content"]["uri"].as_str().unwrap();
        let mut tile = glb(&std::fs::read(folder.join(uri)).unwrap(), step);
        tile.level = json["extras"]["outcrop"]["level"].as_u64().unwrap();
        tile.error = json["geometricError"].as_f64().unwrap();
        let triangles = json["extras"]["outcrop"]["triangles"].as_u64();
        assert_eq!(triangles, Some(tile.triangles.len() as u64));
        let sides = &json["boundingVolume"]["box"];
        tile.volume = [0, 1, 2, 3, 7, 11].map(|n: usize| sides[n].as_f64().unwrap());
        let number = self.tiles.len();
        self.tiles.push(tile);
        for child in json["children"].as_array().into_iter().flatten() {
            let child = self.tile(folder, child, step);
            self.tiles[number].children.push(child);
        }
        number
    }

    pub fn leaves(&self) -> impl Iterator<Item = &Tile> {
        self.tiles.iter().filter(|tile| tile.children.is_empty())
    }
}

/// The data of an accessor, decoded, and its bytes for each element.
fn data(json: &Value, binary: &[u8], accessor: &Value) -> (Vec<u8>, usize) {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let packed = &view["extensions"]["EXT_meshopt_compression"];
    let number = |key: &str| packed[key].as_u64().unwrap() as usize;
    let (count, stride) = (number("count"), number("byteStride"));
    assert_eq!(accessor["count"].as_u64(), Some(count as u64));
    assert_eq!(view["byteLength"].as_u64(), Some((count * stride) as u64));
    let source = &binary[number("byteOffset")..][..number("byteLength")];
    let names = (packed["mode"].as_str().unwrap(), packed["filter"].as_str());
    let decoded = meshopt::decode(names, (count, stride), source).unwrap();
    (decoded, stride)
}

fn indices(json: &Value, binary: &[u8], accessor: &Value) -> Vec<u32> {
    let (data, stride) = data(json, binary, accessor);
    let index = |bytes: &[u8]| match stride {
        2 => u32::from(u16::from_le_bytes(bytes.try_into().unwrap())),
        _ => u32::from_le_bytes(bytes.try_into().unwrap()),
    };
    data.chunks_exact(stride).map(index).collect()
}

fn glb(file: &[u8], step: f64) -> Tile {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(&file[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, file.len()));
    let json: Value = serde_json::from_slice(&file[20..20 + word(12)]).unwrap();
    let binary = &file[28 + word(12)..];
    let matrix: Vec<f64> = serde_json::from_value(json["nodes"][0]["matrix"].clone()).unwrap();
    // Of a lossy tileset, a power of two times the step.
    let unit = (matrix[0] / step).round() as i64;
    assert!(unit.count_ones() == 1 && matrix[0] == step * unit as f64);
    assert_eq!((matrix[6], matrix[9]), (-matrix[0], matrix[0]));
    // Zeros elsewhere.
    for at in [1, 2, 3, 4, 5, 7, 8, 10, 11] {
        assert_eq!(matrix[at], 0.0);
    }
    let place = [matrix[12], -matrix[14], matrix[13]].map(|x| (x / step).round() as i64);
    let primitives = &json["meshes"][0]["primitives"];
    let attributes = &primitives[0]["attributes"];
    let (positions, _) = data(&json, binary, &attributes["POSITION"]);
    let accessor = &json["accessors"][attributes["POSITION"].as_u64().unwrap() as usize];
    let mut drawn = Vec::new();
    let is_short = accessor["componentType"] == 5123;
    for position in positions.chunks_exact(if is_short { 8 } else { 12 }) {
        drawn.push(std::array::from_fn(|axis| {
            let x = match is_short {
                true => f32::from(u16::from_le_bytes([
                    position[2 * axis],
                    position[2 * axis + 1],
                ])),
                false => f32::from_le_bytes(position[4 * axis..][..4].try_into().unwrap()),
            };
            assert_eq!(x.fract(), 0.0);
            let x = f64::from(x);
            let (min, max) = (&accessor["min"][axis], &accessor["max"][axis]);
            assert!(min.as_f64().unwrap() <= x && x <= max.as_f64().unwrap());
            x as i64 * unit + place[axis]
        }));
    }
    let mut exact = drawn.clone();
    if !attributes["_LOW"].is_null() {
        let (low, stride) = data(&json, binary, &attributes["_LOW"]);
        for (position, low) in exact.iter_mut().zip(low.chunks_exact(stride)) {
            for axis in 0..3 {
                let bits = [low[2 * axis], low[2 * axis + 1]];
                position[axis] += i64::from(u16::from_le_bytes(bits));
            }
        }
    }
    let (normals, _) = data(&json, binary, &attributes["NORMAL"]);
    let normals = normals
        .chunks_exact(4)
        .map(|n| [0, 1, 2].map(|k| n[k] as i8));
    let others = attributes.as_object().unwrap().iter();
    let others = others.filter(|(name, _)| !["POSITION", "NORMAL", "_LOW"].contains(&&***name));
    let lines = match primitives[1].is_null() {
        true => Vec::new(),
        false => indices(&json, binary, &primitives[1]["indices"]),
    };
    Tile {
        level: 0,
        error: 0.0,
        bytes: file.len(),
        children: Vec::new(),
        exact,
        drawn,
        normals: normals.collect(),
        others: others
            .map(|(name, accessor)| (name.clone(), data(&json, binary, accessor).0))
            .collect(),
        triangles: indices(&json, binary, &primitives[0]["indices"])
            .as_chunks()
            .0
            .to_vec(),
        lines: lines.as_chunks().0.to_vec(),
        volume: [0.0; 6],
        is_short,
    }
}
