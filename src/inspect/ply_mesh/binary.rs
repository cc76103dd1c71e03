//! Bodies of binary PLY files; `BIG` is the byte order.

use super::header::{Element, Property, Scalar};
use super::source::Source;
use super::{Axes, NO_VERTEX, Role, SLICE, Sink};
use crate::error::Result;

pub(super) fn element<const BIG: bool>(
    element: &Element,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    match (element.role(), stride(&element.properties)) {
        (Role::Vertices(axes), _) => vertices::<BIG>(element, axes, source, sink),
        (Role::Faces(corners), _) => faces::<BIG>(element, corners, source, sink),
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

/// Bytes taken by properties none of which is a list.
fn stride(properties: &[(String, Property)]) -> Option<usize> {
    let size = |(_, property): &(String, Property)| match property {
        Property::Scalar(scalar) => Some(scalar.size()),
        Property::List { .. } => None,
    };
    properties.iter().map(size).sum()
}

fn array<const BIG: bool, const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut value = [0; N];
    value.copy_from_slice(&bytes[..N]);
    if BIG {
        value.reverse();
    }
    value
}

fn integer<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> i64 {
    match scalar {
        Scalar::I8 => i8::from_le_bytes(array::<BIG, 1>(bytes)).into(),
        Scalar::U8 => bytes[0].into(),
        Scalar::I16 => i16::from_le_bytes(array::<BIG, 2>(bytes)).into(),
        Scalar::U16 => u16::from_le_bytes(array::<BIG, 2>(bytes)).into(),
        Scalar::I32 => i32::from_le_bytes(array::<BIG, 4>(bytes)).into(),
        Scalar::U32 => u32::from_le_bytes(array::<BIG, 4>(bytes)).into(),
        Scalar::F32 | Scalar::F64 => real::<BIG>(scalar, bytes) as i64,
    }
}

fn real<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> f64 {
    match scalar {
        Scalar::F32 => f32::from_le_bytes(array::<BIG, 4>(bytes)).into(),
        Scalar::F64 => f64::from_le_bytes(array::<BIG, 8>(bytes)),
        _ => integer::<BIG>(scalar, bytes) as f64,
    }
}

pub(super) fn index(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(NO_VERTEX)
}

fn list_length<const BIG: bool>(scalar: Scalar, source: &mut Source) -> Result<u64> {
    let value = integer::<BIG>(scalar, source.take(scalar.size(), "a list's length")?);
    u64::try_from(value).map_err(|_| {
        let offset = source.position() - scalar.size() as u64;
        source.refuse(offset, &format!("a list of {value} items"), "0 or more")
    })
}

fn skip_properties<const BIG: bool>(
    properties: &[(String, Property)],
    source: &mut Source,
) -> Result<()> {
    for (name, property) in properties {
        let bytes = match *property {
            Property::Scalar(scalar) => scalar.size() as u64,
            Property::List { count, item } => {
                list_length::<BIG>(count, source)?.saturating_mul(item.size() as u64)
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
    let Some(each) = stride(&element.properties) else {
        return vertices_with_lists::<BIG>(element, axes, source, sink);
    };
    let fields = axes.map(|axis| {
        let before = stride(&element.properties[..axis]).unwrap_or(0);
        match element.properties[axis].1 {
            Property::Scalar(scalar) => (before, scalar),
            Property::List { count, .. } => (before, count),
        }
    });
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
                .map(|entry| fields.map(|(at, scalar)| real::<BIG>(scalar, &entry[at..]))),
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
                Property::Scalar(scalar) => {
                    let value = real::<BIG>(scalar, source.take(scalar.size(), name)?);
                    for (slot, _) in position.iter_mut().zip(axes).filter(|&(_, a)| a == i) {
                        *slot = value;
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
    corners: usize,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    let Property::List { count, item } = element.properties[corners].1 else {
        return Ok(());
    };
    let (before, after) = (
        &element.properties[..corners],
        &element.properties[corners + 1..],
    );
    let fixed = stride(before).zip(stride(after));
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
        // What the fast path left: the end of the file, or a face that is not a triangle.
        if left > 0 && slice.len() < SLICE {
            skip_properties::<BIG>(before, source)?;
            let length = list_length::<BIG>(count, source)?;
            if length == 3 {
                let bytes = source.take(3 * item.size(), "a face")?;
                let corner = |i: usize| index(integer::<BIG>(item, &bytes[i * item.size()..]));
                slice.push([corner(0), corner(1), corner(2)]);
            } else {
                source.skip(length.saturating_mul(item.size() as u64), "a face")?;
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
    /// Decodes up to `most` triangles out of what is at hand; stops before any other face.
    fn triangles<const BIG: bool>(
        &self,
        source: &mut Source,
        most: usize,
        slice: &mut Vec<[u32; 3]>,
    ) -> Result<usize> {
        let (list, size) = (self.before + self.count.size(), self.item.size());
        let each = list + 3 * size + self.after;
        let bytes = source.peek(each)?;
        let before = slice.len();
        for entry in bytes.chunks_exact(each).take(most) {
            if integer::<BIG>(self.count, &entry[self.before..]) != 3 {
                break;
            }
            let corners = &entry[list..list + 3 * size];
            slice.push(if self.item.size() == 4 {
                let corner = |i: usize| {
                    let value = u32::from_le_bytes(array::<BIG, 4>(&corners[4 * i..]));
                    // A negative `int` has the top bit set; as `uint` that is a valid number.
                    match self.item == Scalar::I32 && value > i32::MAX as u32 {
                        true => NO_VERTEX,
                        false => value,
                    }
                };
                [corner(0), corner(1), corner(2)]
            } else {
                let corner = |i: usize| index(integer::<BIG>(self.item, &corners[i * size..]));
                [corner(0), corner(1), corner(2)]
            });
        }
        let decoded = slice.len() - before;
        source.consume(decoded * each);
        Ok(decoded)
    }
}
