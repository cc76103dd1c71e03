//! The JSON of a GLB with meshopt compression.

use super::format::{MADE_BY, Mesh};
use super::glb::{self, Y_UP};
use super::piece::{About, VIEWS};
use outcrop_codecs::glb::{COMPRESSION, FLOAT, INDEX, SHORT, View, header};
use serde_json::{Value, json};

/// Bytes before the JSON: the head of the file and that of the chunk.
pub const HEADS: u64 = 12 + 8;

/// Properties that all pieces share.
pub struct Document<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// The position from which steps are counted, in the coordinates of the mesh.
    pub translation: [f64; 3],
    /// Length of a step.
    pub step: f64,
}

/// Where the next piece begins.
#[derive(Debug, Clone, Copy, Default)]
struct Next {
    /// Accessors and views before it.
    accessors: u64,
    views: u64,
    /// Bytes before it: compressed, and as they are after reading.
    packed: u64,
    plain: u64,
}

/// A piece that has the longest text, and the place where it has it.
const LONGEST: (About, Next) = (
    About {
        vertices: u32::MAX,
        triangles: u32::MAX,
        filtered: true,
        bounds: [[-1_073_741_824.0; 3]; 2],
        bytes: [u32::MAX; VIEWS],
    },
    Next {
        accessors: u32::MAX as u64,
        views: u32::MAX as u64,
        packed: u32::MAX as u64,
        plain: 1 << 53,
    },
);

/// Elements of the lists of accessors, views and primitives, as JSON.
#[derive(Debug, Default)]
struct Lists {
    accessors: Vec<u8>,
    views: Vec<u8>,
    primitives: Vec<u8>,
}

fn push(list: &mut Vec<u8>, element: &Value) {
    if !list.is_empty() {
        list.push(b',');
    }
    list.extend_from_slice(element.to_string().as_bytes());
}

impl Document<'_> {
    /// Bytes of the longest JSON for `count` pieces, a multiple of four.
    pub fn most(&self, count: usize) -> u64 {
        let (about, mut next) = LONGEST;
        let mut lists = Lists::default();
        self.add(&mut lists, &about, &mut next);
        let piece = lists.accessors.len() + lists.views.len() + lists.primitives.len() + 3;
        let (_, next) = LONGEST;
        let fixed = self.text(&Lists::default(), next).len();
        (fixed + count * piece).next_multiple_of(4) as u64
    }

    /// The bytes of a file before the pieces: `room` bytes are for the JSON, and the file has `end` bytes.
    pub fn header(&self, pieces: &[About], room: u64, end: u64) -> Vec<u8> {
        let (mut lists, mut next) = (Lists::default(), Next::default());
        for about in pieces {
            self.add(&mut lists, about, &mut next);
        }
        let mut text = self.text(&lists, next);
        drop(lists);
        text.resize(room as usize, b' ');
        header(text, end - HEADS - room - 8)
    }

    fn text(&self, lists: &Lists, next: Next) -> Vec<u8> {
        let mut asset = json!({ "version": "2.0", "generator": MADE_BY });
        if !self.mesh.comments.is_empty() {
            asset["extras"] = json!({ "comments": self.mesh.comments });
        }
        let scale = [self.step; 3];
        let rest = json!({
            "asset": asset,
            "extensionsUsed": [COMPRESSION],
            "extensionsRequired": [COMPRESSION],
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [
                { "name": "y up", "matrix": Y_UP, "children": [1] },
                { "name": "mesh", "mesh": 0, "translation": self.translation, "scale": scale },
            ],
            "materials": [glb::material()],
            "buffers": [
                { "byteLength": next.packed },
                { "byteLength": next.plain, "extensions": { COMPRESSION: { "fallback": true } } },
            ],
        });
        let mut text = rest.to_string().into_bytes();
        text.pop();
        let parts: [(&str, &[u8], &str); 3] = [
            (",\"accessors\":[", &lists.accessors, "]"),
            (",\"bufferViews\":[", &lists.views, "]"),
            (",\"meshes\":[{\"primitives\":[", &lists.primitives, "]}]}"),
        ];
        for (before, list, after) in parts {
            text.extend_from_slice(before.as_bytes());
            text.extend_from_slice(list);
            text.extend_from_slice(after.as_bytes());
        }
        text
    }

    /// Adds a piece to the lists.
    fn add(&self, lists: &mut Lists, about: &About, next: &mut Next) {
        let of_vertices = |stride, filter, bytes| View {
            stride,
            count: about.vertices as usize,
            mode: ("ATTRIBUTES", filter),
            bytes: bytes as usize,
        };
        let [low, high] = about.bounds;
        let mut attributes = json!({ "POSITION": next.accessors });
        let filter = about.filtered.then_some("EXPONENTIAL");
        let view = of_vertices(12, filter, about.bytes[0]);
        let accessor = json!({ "componentType": FLOAT, "type": "VEC3", "min": low, "max": high });
        next.add(lists, view, accessor);
        if self.mesh.normals().is_some() {
            attributes["NORMAL"] = next.accessors.into();
            let view = of_vertices(12, Some("EXPONENTIAL"), about.bytes[1]);
            let accessor = json!({ "componentType": FLOAT, "type": "VEC3" });
            next.add(lists, view, accessor);
        }
        if self.mesh.colours().is_some() {
            attributes["COLOR_0"] = next.accessors.into();
            let view = of_vertices(glb::COLOUR, None, about.bytes[2]);
            let accessor = json!({ "componentType": SHORT, "type": "VEC4", "normalized": true });
            next.add(lists, view, accessor);
        }
        let indices = next.accessors;
        let view = View {
            stride: 4,
            count: 3 * about.triangles as usize,
            mode: ("TRIANGLES", None),
            bytes: about.bytes[3] as usize,
        };
        let accessor = json!({ "componentType": INDEX, "type": "SCALAR" });
        next.add(lists, view, accessor);
        let primitive = json!({
            "attributes": attributes, "indices": indices, "material": 0, "mode": 4,
        });
        push(&mut lists.primitives, &primitive);
    }
}

impl Next {
    /// Adds a view, and an accessor of all of it.
    fn add(&mut self, lists: &mut Lists, view: View<'_>, mut accessor: Value) {
        accessor["bufferView"] = self.views.into();
        accessor["count"] = view.count.into();
        push(&mut lists.accessors, &accessor);
        push(&mut lists.views, &view.json(self.packed, self.plain));
        self.accessors += 1;
        self.views += 1;
        self.packed += view.bytes.next_multiple_of(4) as u64;
        self.plain += view.plain() as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::format::{VertexColumn, normal_columns};
    use outcrop_ply::Scalar;

    #[test]
    fn the_room_suffices_for_any_pieces() {
        let colours = ["red", "green", "blue"].map(|name| VertexColumn {
            name: name.into(),
            scalar: Scalar::U16,
        });
        let mesh = Mesh {
            columns: colours.into_iter().chain(normal_columns()).collect(),
            comments: vec!["crs \"x\" \u{1}".into()],
            ..Mesh::default()
        };
        let document = Document {
            mesh: &mesh,
            translation: [-1.0 / 3.0, 5e-324, 1e300],
            step: 0.001,
        };
        let pieces = [LONGEST.0; 9];
        let room = document.most(pieces.len());
        for count in [0, 1, 9] {
            let end = HEADS + room + 8 + 100;
            let header = document.header(&pieces[..count], room, end);
            assert_eq!(header.len() as u64, end - 100, "{count}");
            let json = &header[HEADS as usize..][..room as usize];
            let json: Value = serde_json::from_slice(json).unwrap();
            let lists = ["accessors", "bufferViews"].map(|k| json[k].as_array().unwrap().len());
            assert_eq!(lists, [4 * count; 2]);
            assert_eq!(
                json["meshes"][0]["primitives"].as_array().unwrap().len(),
                count
            );
        }
    }
}
