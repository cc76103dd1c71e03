//! Bodies of binary PLY files; `BIG` is the byte order.

use super::source::Source;
use super::{Axes, NO_VERTEX, Role, SLICE, Sink};
use crate::error::Result;
use outcrop_ply::{Element, Property, Scalar, bytes_of, integer, real};

pub(super) fn element<const BIG: bool>(
    element: &Element,
    role: Role,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    match (role, element.record_bytes()) {
        (Role::Vertices(axes), _) => vertices::<BIG>(element, axes, source, sink),
        (Role::Faces(at, count, item), _) => faces::<BIG>(element, (at, count, item), source, sink),
        (Role::Other, Some(each)) => {
            let bytes = element.count.saturating_mul(each as u64);
            source.skip(bytes, &format!("element {}", element.name))
        }
        (Role::Other, None) => {
            for _ in 0..element.count {
                skip_properties::<BIG>(&element.properties, source)?;
            }
            Ok(())
        }
    }
}

pub(super) fn index(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(NO_VERTEX)
}

fn list_length<const BIG: bool>(scalar: Scalar, source: &mut Source) -> Result<u64> {
    let value = integer(scalar, source.take(scalar.bytes(), "a list's length")?, BIG);
    u64::try_from(value).map_err(|_| {
        let offset = source.position() - scalar.bytes() as u64;
        source.refuse(offset, &format!("a list of {value} items"), "0 or more")
    })
}

fn skip_properties<const BIG: bool>(
    properties: &[(String, Property)],
    source: &mut Source,
) -> Result<()> {
    for (name, property) in properties {
        let bytes = match *property {
            Property::One(scalar) => scalar.bytes() as u64,
            Property::List { count, item } => {
                list_length::<BIG>(count, source)?.saturating_mul(item.bytes() as u64)
            }
        };
        source.skip(bytes, &format!("property {name}"))?;
    }
    Ok(())
}

fn vertices<const BIG: bool>(
    element: &Element,
    axes: Axes,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    let mut slice = Vec::with_capacity(SLICE);
    let mut left = element.count;
    let Some(each) = element.record_bytes() else {
        return vertices_with_lists::<BIG>(element, axes, source, sink);
    };
    let fields = axes.map(|(at, scalar)| (element.bytes_before(at).unwrap_or(0), scalar));
    while left > 0 {
        let at_hand = source.peek(each)?.len() / each;
        let now = at_hand
            .min(SLICE)
            .min(usize::try_from(left).unwrap_or(SLICE));
        let bytes = source.take(now.max(1) * each, "a vertex")?;
        slice.clear();
        slice.extend(
            bytes
                .chunks_exact(each)
                .map(|entry| fields.map(|(at, scalar)| real(scalar, &entry[at..], BIG))),
        );
        sink.vertices(&slice)?;
        left -= now as u64;
    }
    Ok(())
}

fn vertices_with_lists<const BIG: bool>(
    element: &Element,
    axes: Axes,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    for _ in 0..element.count {
        let mut position = [0.0; 3];
        for (i, (name, property)) in element.properties.iter().enumerate() {
            match *property {
                Property::One(scalar) => {
                    let bytes = source.take(scalar.bytes(), name)?;
                    if let Some(axis) = axes.iter().position(|axis| axis.0 == i) {
                        position[axis] = real(scalar, bytes, BIG);
                    }
                }
                Property::List { .. } => {
                    skip_properties::<BIG>(&element.properties[i..=i], source)?;
                }
            }
        }
        sink.vertices(&[position])?;
    }
    Ok(())
}

fn faces<const BIG: bool>(
    element: &Element,
    (corners, count, item): (usize, Scalar, Scalar),
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    let (before, after) = (
        &element.properties[..corners],
        &element.properties[corners + 1..],
    );
    let fixed = bytes_of(before).zip(bytes_of(after));
    let mut slice = Vec::with_capacity(SLICE);
    let mut left = element.count;
    while left > 0 {
        if let Some((before, after)) = fixed {
            let most = usize::try_from(left)
                .unwrap_or(SLICE)
                .min(SLICE - slice.len());
            let layout = Layout {
                before,
                count,
                item,
                after,
            };
            left -= layout.triangles::<BIG>(source, most, &mut slice)? as u64;
        }
        // After the fast path: the end of the file, or a face that is not a triangle.
        if left > 0 && slice.len() < SLICE {
            skip_properties::<BIG>(before, source)?;
            let length = list_length::<BIG>(count, source)?;
            if length == 3 {
                let bytes = source.take(3 * item.bytes(), "a face")?;
                let corner = |i: usize| index(integer(item, &bytes[i * item.bytes()..], BIG));
                slice.push([corner(0), corner(1), corner(2)]);
            } else {
                source.skip(length.saturating_mul(item.bytes() as u64), "a face")?;
                sink.non_triangles(1)?;
            }
            skip_properties::<BIG>(after, source)?;
            left -= 1;
        }
        if slice.len() == SLICE {
            sink.triangles(&slice)?;
            slice.clear();
        }
    }
    sink.triangles(&slice)
}

/// Faces with one list among properties of fixed size.
struct Layout {
    before: usize,
    count: Scalar,
    item: Scalar,
    after: usize,
}

impl Layout {
    /// Decodes up to `most` triangles from the buffer; stops before any other face.
    fn triangles<const BIG: bool>(
        &self,
        source: &mut Source,
        most: usize,
        slice: &mut Vec<[u32; 3]>,
    ) -> Result<usize> {
        let (list, size) = (self.before + self.count.bytes(), self.item.bytes());
        let each = list + 3 * size + self.after;
        let bytes = source.peek(each)?;
        let before = slice.len();
        for entry in bytes.chunks_exact(each).take(most) {
            if integer(self.count, &entry[self.before..], BIG) != 3 {
                break;
            }
            let corners = &entry[list..list + 3 * size];
            slice.push(if self.item.bytes() == 4 {
                let corner = |i: usize| {
                    let mut word = [0; 4];
                    word.copy_from_slice(&corners[4 * i..4 * i + 4]);
                    let value = match BIG {
                        true => u32::from_be_bytes(word),
                        false => u32::from_le_bytes(word),
                    };
                    // A negative `int` has the top bit set; as `uint` that is a valid number.
                    match self.item == Scalar::I32 && value > i32::MAX as u32 {
                        true => NO_VERTEX,
                        false => value,
                    }
                };
                [corner(0), corner(1), corner(2)]
            } else {
                let corner = |i: usize| index(integer(self.item, &corners[i * size..], BIG));
                [corner(0), corner(1), corner(2)]
            });
        }
        let decoded = slice.len() - before;
        source.consume(decoded * each);
        Ok(decoded)
    }
}
