//! A tile as a GLB file, its buffer views compressed with `EXT_meshopt_compression`.

use super::columns::Columns;
use super::lossy;
use super::node::Node;
use super::writer::{Grids, Placed, Writer};
use outcrop_codecs::glb::{COMPRESSION, FLOAT, SHORT, header};
use outcrop_codecs::light;
use outcrop_codecs::meshopt;
use outcrop_ply::Scalar;
use serde_json::{Value, json};

/// Component types of glTF.
fn component(scalar: Scalar) -> u32 {
    match scalar {
        Scalar::I8 => 5120,
        Scalar::U8 => 5121,
        Scalar::I16 => 5122,
        Scalar::U16 => SHORT,
        _ => FLOAT,
    }
}

/// Low bits of positions that a tile hides whose longest side is twice `half`: the rest must fit 24 bits with a sign.
pub(super) fn low_bits(half: u32) -> u32 {
    (0..32)
        .find(|bits| (half >> bits) + 2 < 1 << 23)
        .unwrap_or(31)
}

/// A tile as a file.
pub(super) struct Written {
    pub file: Vec<u8>,
    /// The longest way of a vertex from its position to the place where it is drawn, in steps, if no attribute has
    /// the rest.
    pub moved: f64,
}

/// The place of a tile: a whole number of the steps of the coarsest grid.
fn place(node: &Node, grids: &Grids<'_>) -> [u32; 3] {
    let bits = grids.low_bits.first().copied().unwrap_or(0);
    node.bounds().middle().map(|x| x >> bits << bits)
}

/// A GLB file with a tile at this depth, which draws these of its triangles, and lines along `boundary`.
pub(super) fn write(
    (node, depth): (&Node, u32),
    triangles: &[[u32; 3]],
    boundary: &[[u32; 2]],
    (grids, columns): (&Grids<'_>, &Columns),
) -> Written {
    let mut writer = Writer::default();
    let placed = match grids.lossy {
        true => lossy::positions(&mut writer, node, depth, grids),
        false => positions(&mut writer, node, depth, grids),
    };
    let mut attributes = placed.attributes;
    let normals: Vec<u8> = match grids.lossy {
        true => lossy::normals(&node.normals),
        false => {
            let bytes = |n: &[i8; 2]| [n[0].cast_unsigned(), n[1].cast_unsigned(), 127, 0];
            node.normals.iter().flat_map(bytes).collect()
        }
    };
    let accessor = json!({ "componentType": 5120, "normalized": true, "type": "VEC3" });
    attributes["NORMAL"] = writer
        .attribute(&normals, 4, Some("OCTAHEDRAL"), accessor)
        .into();
    match grids.lossy {
        true => lossy::values(&mut writer, node, columns, &mut attributes),
        false => values(&mut writer, node, columns, &mut attributes),
    }
    let vertices = node.ids.len();
    let packed = (meshopt::triangles(triangles), "TRIANGLES");
    let indices = writer.indices(packed, 3 * triangles.len(), vertices);
    let mut primitives = vec![json!({
        "attributes": attributes, "indices": indices, "mode": 4, "material": 0,
    })];
    if !boundary.is_empty() {
        let packed = (meshopt::sequence(boundary.as_flattened()), "INDICES");
        let indices = writer.indices(packed, 2 * boundary.len(), vertices);
        primitives.push(json!({
            "attributes": attributes, "indices": indices, "mode": 1, "material": 0,
        }));
    }
    let step = grids.lattice.step;
    let [x, y, z] = placed.place.map(|x| f64::from(x) * step);
    let unit = step * f64::from(1u32 << placed.bits);
    let matrix = [
        [unit, 0.0, 0.0, 0.0],
        [0.0, 0.0, -unit, 0.0],
        [0.0, unit, 0.0, 0.0],
        [x, z, 0.0 - y, 1.0],
    ];
    writer.align();
    let json = json!({
        "asset": { "version": "2.0", "generator": concat!("outcrop ", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": [COMPRESSION, "KHR_mesh_quantization"],
        "extensionsRequired": [COMPRESSION, "KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "matrix": matrix.as_flattened() }],
        "meshes": [{ "primitives": primitives }],
        "materials": [{
            "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        }],
        "buffers": [
            { "byteLength": writer.bytes.len() },
            { "byteLength": writer.decoded.max(1), "extensions": { COMPRESSION: { "fallback": true } } },
        ],
        "bufferViews": writer.views,
        "accessors": writer.accessors,
    });
    let mut file = header(json.to_string().into_bytes(), writer.bytes.len() as u64);
    file.extend_from_slice(&writer.bytes);
    Written {
        file,
        moved: placed.moved,
    }
}

/// Positions as whole steps from the place, in the filter `EXPONENTIAL`, and the bits that this leaves out.
fn positions(writer: &mut Writer, node: &Node, depth: u32, grids: &Grids<'_>) -> Placed {
    let place = place(node, grids);
    let exponent = grids.hidden(depth, super::node::INNER);
    let mut data = Vec::with_capacity(12 * node.points.len());
    let mut low = Vec::with_capacity(8 * node.points.len());
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut any = false;
    for (point, vertex_depth) in node.points.iter().zip(&node.depths) {
        let hidden = grids.hidden(depth, *vertex_depth);
        for axis in 0..3 {
            let shown = point[axis] >> hidden << hidden;
            let rest = point[axis] - shown;
            any |= rest > 0;
            low.extend_from_slice(&(rest as u16).to_le_bytes());
            let steps = i64::from(shown) - i64::from(place[axis]);
            let mantissa = (steps >> exponent) as i32;
            let word = exponent << 24 | mantissa.cast_unsigned() & 0xff_ffff;
            data.extend_from_slice(&word.to_le_bytes());
            min[axis] = min[axis].min(steps as f64);
            max[axis] = max[axis].max(steps as f64);
        }
        low.extend_from_slice(&[0, 0]);
    }
    let accessor = json!({ "componentType": FLOAT, "type": "VEC3", "min": min, "max": max });
    let position = writer.attribute(&data, 12, Some("EXPONENTIAL"), accessor);
    let mut attributes = json!({ "POSITION": position });
    if any {
        let accessor = json!({ "componentType": SHORT, "type": "VEC3" });
        attributes["_LOW"] = writer.attribute(&low, 8, None, accessor).into();
    }
    Placed {
        attributes,
        place,
        bits: 0,
        moved: 0.0,
    }
}

/// Colours and other values.
fn values(writer: &mut Writer, node: &Node, columns: &Columns, attributes: &mut Value) {
    let each = columns.words();
    let column = |number: usize| node.values.iter().skip(number).step_by(each.max(1));
    let mut number = 0;
    if columns.has_colors() {
        let mut data = Vec::with_capacity(8 * node.ids.len());
        for word in column(0) {
            let [rgb @ .., _] = word.to_le_bytes();
            for component in rgb {
                data.extend_from_slice(&light::of_byte(component).to_le_bytes());
            }
            data.extend_from_slice(&[0, 0]);
        }
        let accessor = json!({ "componentType": SHORT, "normalized": true, "type": "VEC3" });
        attributes["COLOR_0"] = writer.attribute(&data, 8, None, accessor).into();
        number = 1;
    }
    for (other, number) in columns.others().zip(number..) {
        let scalar = other.attribute_type();
        let bytes = scalar.bytes();
        let mut data = Vec::with_capacity(4 * node.ids.len());
        for word in column(number) {
            data.extend_from_slice(&word.to_le_bytes()[..bytes]);
            data.extend_from_slice(&[0; 4][bytes..]);
        }
        let accessor = json!({ "componentType": component(scalar), "type": "SCALAR" });
        attributes[&*other.attribute] = writer.attribute(&data, 4, None, accessor).into();
    }
}
