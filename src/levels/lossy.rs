//! The encoding of the tiles of a lossy tileset. Positions were rounded before all tiles (`rounding`); here they take as
//! few bits as that allows, and normals, colours and other values fewer bits.

use super::columns::Columns;
use super::node::{Node, squared};
use super::writer::{Grids, Placed, Writer};
use outcrop_codecs::glb::{FLOAT, SHORT};
use outcrop_codecs::light;
use outcrop_ply::Scalar;
use rustc_hash::FxHashSet;
use serde_json::{Value, json};

/// Bits of each of the two components of a normal: directions are within 4 degrees, 1.3 on average. Normals take 0.5 bytes a triangle
/// on the lion, with 8 bits 0.8.
pub(super) const NORMAL_BITS: u32 = 6;

/// Largest step of other values, as a part of the range of the middle 96 % of a tile's values: as many as a ramp of
/// colours has, in a byte. Few values far from the others do not make it coarser.
const VALUE_SHARE: f64 = 1.0 / 256.0;

/// Bits of the whole number in the filter `EXPONENTIAL`.
const BITS: u32 = 24;

/// Where the vertices of a tile at this depth are drawn.
fn shown(node: &Node, depth: u32, grids: &Grids<'_>) -> Vec<[u32; 3]> {
    let hide = |(point, depth_of): ([u32; 3], &u8)| {
        let hidden = grids.hidden(depth, *depth_of);
        point.map(|x| x >> hidden << hidden)
    };
    node.rounded().zip(&node.depths).map(hide).collect()
}

/// The tile with the triangles first that are drawn, and their vertices first; and the number of these triangles.
/// Indices take a fifth more bytes if triangles are left out of the order of the vertices.
pub(super) fn arranged(node: &Node, depth: u32, grids: &Grids<'_>) -> (Node, usize) {
    let [drawn, left] = parted(&node.triangles, &shown(node, depth, grids));
    let count = drawn.len();
    (node.with_triangles(&[drawn, left].concat()), count)
}

/// Positions as whole numbers of the coarsest step that they have in common: 16 bits if they fit, which takes less
/// than the filter `EXPONENTIAL`.
pub(super) fn positions(writer: &mut Writer, node: &Node, depth: u32, grids: &Grids<'_>) -> Placed {
    let shown = shown(node, depth, grids);
    let ways = shown.iter().zip(&node.points).map(|(p, q)| squared(*p, *q));
    let moved2 = ways.fold(0.0, f64::max);
    let all = shown.iter().copied();
    let bounds = all.fold(super::node::Bounds::EMPTY, super::node::Bounds::with);
    let steps = |x: u32, axis: usize| x - bounds.min[axis];
    let ones = shown.iter().fold(0, |ones, p| {
        (0..3).fold(ones, |ones, axis| ones | steps(p[axis], axis))
    });
    let bits = ones.trailing_zeros() % 32;
    let most = [0, 1, 2].map(|axis| steps(bounds.max[axis].max(bounds.min[axis]), axis) >> bits);
    let is_short = most.iter().all(|most| *most < 1 << 16);
    let (stride, filter, component) = match is_short {
        true => (8, None, SHORT),
        false => (12, Some("EXPONENTIAL"), FLOAT),
    };
    // Whole numbers of the filter have a sign.
    let middle = most.map(|most| if is_short { 0 } else { most / 2 });
    let mut data = Vec::with_capacity(stride * shown.len());
    for point in &shown {
        for axis in 0..3 {
            let number = (steps(point[axis], axis) >> bits).wrapping_sub(middle[axis]);
            match is_short {
                true => data.extend_from_slice(&(number as u16).to_le_bytes()),
                false => data.extend_from_slice(&(number & ((1 << BITS) - 1)).to_le_bytes()),
            }
        }
        data.resize(data.len().next_multiple_of(4), 0);
    }
    let ends = |sign: f64| {
        [0, 1, 2].map(|axis| match sign < 0.0 {
            true => -f64::from(middle[axis]),
            false => f64::from(most[axis]) - f64::from(middle[axis]),
        })
    };
    let (min, max) = (ends(-1.0), ends(1.0));
    let accessor = json!({ "componentType": component, "type": "VEC3", "min": min, "max": max });
    let position = writer.attribute(&data, stride, filter, accessor);
    Placed {
        attributes: json!({ "POSITION": position }),
        place: std::array::from_fn(|axis| bounds.min[axis] + (middle[axis] << bits)),
        bits,
        moved: moved2.sqrt(),
    }
}

/// The triangles that are drawn, and the others: those whose corners are no three positions, if triangles that are
/// drawn have what is left of them, so that the surface has lost no part.
fn parted(triangles: &[[u32; 3]], shown: &[[u32; 3]]) -> [Vec<[u32; 3]>; 2] {
    let corners = |t: &[u32; 3]| t.map(|v| shown[v as usize]);
    let sides =
        |[a, b, c]: [[u32; 3]; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
    let is_flat = |t: &[u32; 3]| sides(corners(t)).iter().any(|[a, b]| a == b);
    // The longest side is all that is left.
    let rest = |t: &[u32; 3]| {
        let sides = sides(corners(t));
        sides.into_iter().find(|[a, b]| a != b).unwrap_or(sides[0])
    };
    let flat = triangles.iter().filter(|t| is_flat(t));
    let mut missing: FxHashSet<[[u32; 3]; 2]> = flat.map(rest).collect();
    if missing.is_empty() {
        return [triangles.to_vec(), Vec::new()];
    }
    for triangle in triangles.iter().filter(|t| !is_flat(t)) {
        let corners = corners(triangle);
        for side in sides(corners) {
            missing.remove(&side);
        }
        for p in corners {
            missing.remove(&[p, p]);
        }
    }
    let stays = |t: &[u32; 3]| !is_flat(t) || missing.contains(&rest(t));
    let (drawn, left) = triangles.iter().partition(|t| stays(t));
    [drawn, left]
}

/// Normals, octahedral.
pub(super) fn normals(normals: &[[i8; 2]]) -> Vec<u8> {
    let one = (1i32 << (NORMAL_BITS - 1)) - 1;
    let fewer = |x: i8| (f64::from(x) * f64::from(one) / 127.0).round() as i8;
    let bytes = |[x, y]: &[i8; 2]| {
        [
            fewer(*x).cast_unsigned(),
            fewer(*y).cast_unsigned(),
            one as u8,
            0,
        ]
    };
    normals.iter().flat_map(bytes).collect()
}

/// Colours and other values.
pub(super) fn values(writer: &mut Writer, node: &Node, columns: &Columns, attributes: &mut Value) {
    let each = columns.words();
    let column = |number: usize| node.values.iter().skip(number).step_by(each.max(1));
    let mut number = 0;
    if columns.has_colors() {
        let byte = |component: u8| (f64::from(light::of_byte(component)) / 257.0).round() as u8;
        let bytes = |word: &u32| {
            let [r, g, b, _] = word.to_le_bytes();
            [byte(r), byte(g), byte(b), 0]
        };
        let data: Vec<u8> = column(0).flat_map(bytes).collect();
        let accessor = json!({ "componentType": 5121, "normalized": true, "type": "VEC3" });
        attributes["COLOR_0"] = writer.attribute(&data, 4, None, accessor).into();
        number = 1;
    }
    for (other, number) in columns.others().zip(number..) {
        let scalar = other.attribute_type();
        let all: Vec<f64> = column(number).map(|word| value(*word, scalar)).collect();
        let exponent = exponent(&all, scalar);
        let accessor = json!({ "componentType": FLOAT, "type": "SCALAR" });
        let (data, filter): (Vec<u8>, _) = match exponent {
            Some(e) => {
                let step = 2f64.powi(e);
                let word = |x: &f64| {
                    let number = (x / step).round() as i32;
                    (e << BITS | number & ((1 << BITS) - 1)).to_le_bytes()
                };
                (all.iter().flat_map(word).collect(), Some("EXPONENTIAL"))
            }
            None => {
                let word = |x: &f64| (*x as f32).to_le_bytes();
                (all.iter().flat_map(word).collect(), None)
            }
        };
        attributes[&*other.attribute] = writer.attribute(&data, 4, filter, accessor).into();
    }
}

/// The value of a word of a node.
fn value(word: u32, scalar: Scalar) -> f64 {
    match scalar {
        Scalar::I8 => f64::from(word as u8 as i8),
        Scalar::U8 => f64::from(word as u8),
        Scalar::I16 => f64::from(word as u16 as i16),
        Scalar::U16 => f64::from(word as u16),
        _ => f64::from(f32::from_bits(word)),
    }
}

/// The exponent of the step to which values are rounded; none if they have to stay.
fn exponent(all: &[f64], scalar: Scalar) -> Option<i32> {
    let mut sorted = all.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    if !(first.is_finite() && last.is_finite()) {
        return None;
    }
    let range = sorted[sorted.len() - 1 - sorted.len() / 50] - sorted[sorted.len() / 50];
    // Steps that a float has, and that leave each value 23 bits.
    let largest = first.abs().max(last.abs());
    let least = match scalar {
        Scalar::F32 => -100,
        _ => 0,
    };
    let fits = |e: &i32| largest / 2f64.powi(*e) < f64::from((1 << (BITS - 1)) - 2);
    let least = (least..100).find(fits)?;
    let wanted = range * VALUE_SHARE;
    match (wanted > 0.0, scalar) {
        (false, Scalar::F32) => None,
        _ => (least..100)
            .take_while(|e| *e == least || 2f64.powi(*e) <= wanted)
            .last(),
    }
}
