//! The columns of PCD: numbers of fields, and the bytes of packed colours.

use super::header::{Field, Header, Number};
use outcrop_ply::Scalar;
use outcrop_points::columns::Column;

/// A column: a field or a part of it.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Number of the field.
    pub(super) field: usize,
    /// First byte of the value in the field.
    pub(super) at: usize,
    pub(super) number: Number,
    pub(super) column: Column,
}

/// Colours of one number: the lowest byte is blue.
const PACKED: [(&str, usize); 4] = [("red", 2), ("green", 1), ("blue", 0), ("alpha", 3)];

/// The columns of a file: all fields of one number but the coordinates.
pub(super) fn parts(header: &Header) -> Vec<Part> {
    let fields = header.fields.iter().enumerate();
    let others = fields
        .filter(|(at, field)| field.count == 1 && !field.is_padding() && !header.axes.contains(at));
    others.flat_map(|(at, field)| of_field(at, field)).collect()
}

fn of_field(at: usize, field: &Field) -> Vec<Part> {
    let colors = match &*field.name.to_ascii_lowercase() {
        "rgb" => 3,
        "rgba" => 4,
        _ => 0,
    };
    if colors > 0 && field.bytes() == 4 {
        let byte = |(name, byte): &(&str, usize)| Part {
            field: at,
            at: *byte,
            number: Number::Scalar(Scalar::U8),
            column: Column::new(name, Scalar::U8),
        };
        return PACKED[..colors].iter().map(byte).collect();
    }
    let scalar = match field.number {
        Number::Scalar(scalar) => scalar,
        Number::I64 | Number::U64 => Scalar::F64,
    };
    vec![Part {
        field: at,
        at: 0,
        number: field.number,
        column: Column::new(&field.name, scalar),
    }]
}
