//! The columns of a record: all fields but the position and the flags, and extra bytes that are described.

use super::extra::{Extra, Value};
use super::{CLASS, FLAGS, Header};
use laz::DecompressionSelection;
use outcrop_ply::Scalar;
use outcrop_points::columns::{AXES, CLASSIFICATION, COLORS, Column, INTENSITY, Wanted, extra};
use std::borrow::Cow;

/// Degrees for each unit of the scan angle in point formats 6 to 10.
const ANGLE: f64 = 0.006;

/// Adds the layer of a field to what is decompressed of a layered chunk.
type Layer = fn(DecompressionSelection) -> DecompressionSelection;

/// How a value is stored.
#[derive(Debug, Clone, Copy)]
enum Stored {
    /// As it is.
    Plain,
    /// Some bits of a byte: how far they are shifted, and their mask after that.
    Bits(u32, u8),
    /// Units of this many degrees.
    Angle(Scalar, f64),
    /// Among the extra bytes.
    Extra(Value),
}

/// A field of a record.
#[derive(Debug, Clone)]
pub(super) struct Field {
    name: Cow<'static, str>,
    scalar: Scalar,
    /// Byte in the record.
    at: usize,
    stored: Stored,
    layer: Layer,
}

impl Field {
    fn plain(name: &'static str, scalar: Scalar, at: usize, layer: Layer) -> Self {
        Self {
            name: Cow::Borrowed(name),
            scalar,
            at,
            stored: Stored::Plain,
            layer,
        }
    }

    fn bits(name: &'static str, at: usize, shift: u32, mask: u8, layer: Layer) -> Self {
        Self {
            stored: Stored::Bits(shift, mask),
            ..Self::plain(name, Scalar::U8, at, layer)
        }
    }

    fn angle(of: Scalar, at: usize, degrees: f64) -> Self {
        let layer = DecompressionSelection::decompress_scan_angle;
        Self {
            stored: Stored::Angle(of, degrees),
            ..Self::plain("scan_angle", Scalar::F32, at, layer)
        }
    }

    fn extra(extra: &Extra) -> Self {
        Self {
            name: Cow::Owned(extra.name.clone()),
            scalar: extra.value.scalar(),
            at: extra.at,
            stored: Stored::Extra(extra.value),
            layer: DecompressionSelection::decompress_extra_bytes,
        }
    }

    /// Appends the value in a record.
    #[inline]
    fn put(&self, record: &[u8], values: &mut Vec<u8>) {
        let bytes = &record[self.at..];
        match self.stored {
            Stored::Plain => values.extend_from_slice(&bytes[..self.scalar.bytes()]),
            Stored::Bits(shift, mask) => values.push(bytes[0] >> shift & mask),
            Stored::Angle(of, degrees) => {
                let value = outcrop_ply::real(of, bytes, false) * degrees;
                self.scalar.put(value, values);
            }
            Stored::Extra(value) => value.put(bytes, values),
        }
    }
}

/// The fields of records of this file.
fn all(header: &Header) -> Vec<Field> {
    use DecompressionSelection as Layers;
    use Scalar::{F64, I8, I16, U8, U16};
    let format = header.format;
    let base: Layer = |selection| selection;
    let class: Layer = Layers::decompress_classification;
    let mut fields = vec![Field::plain(
        INTENSITY,
        U16,
        12,
        Layers::decompress_intensity,
    )];
    let after = if format.is_extended {
        fields.extend([
            Field::bits("return_number", 14, 0, 0x0f, base),
            Field::bits("number_of_returns", 14, 4, 0x0f, base),
            Field::plain(CLASSIFICATION, U8, CLASS, class),
            Field::plain("user_data", U8, 17, Layers::decompress_user_data),
            Field::angle(I16, 18, ANGLE),
            Field::plain("point_source", U16, 20, Layers::decompress_point_source_id),
        ]);
        22
    } else {
        // In LAS 1.0 the class is the whole byte.
        let classes = if header.raw.version.minor == 0 {
            0xff
        } else {
            0x1f
        };
        fields.extend([
            Field::bits("return_number", 14, 0, 0x07, base),
            Field::bits("number_of_returns", 14, 3, 0x07, base),
            Field::bits(CLASSIFICATION, FLAGS, 0, classes, class),
            Field::angle(I8, 16, 1.0),
            Field::plain("user_data", U8, 17, Layers::decompress_user_data),
            Field::plain("point_source", U16, 18, Layers::decompress_point_source_id),
        ]);
        20
    };
    let mut at = after;
    if format.has_gps_time {
        fields.push(Field::plain(
            "gps_time",
            F64,
            at,
            Layers::decompress_gps_time,
        ));
        at += 8;
    }
    if format.has_color {
        for name in COLORS {
            fields.push(Field::plain(name, U16, at, Layers::decompress_rgb));
            at += 2;
        }
    }
    if format.has_nir {
        fields.push(Field::plain(
            "near_infrared",
            U16,
            at,
            Layers::decompress_nir,
        ));
    }
    for one in &header.extra {
        let mut field = Field::extra(one);
        let taken = |name: &str| AXES.contains(&name) || fields.iter().any(|f| f.name == name);
        while taken(&field.name) {
            field.name = extra(&field.name).into();
        }
        fields.push(field);
    }
    fields
}

/// The columns of records of this file.
pub(super) fn columns(header: &Header) -> Vec<Column> {
    let column = |field: Field| Column {
        name: field.name.into_owned(),
        scalar: field.scalar,
    };
    all(header).into_iter().map(column).collect()
}

/// The wanted fields of records.
#[derive(Debug)]
pub(super) struct Fields(Vec<Field>);

impl Fields {
    pub(super) fn of(header: &Header, wanted: &Wanted) -> Self {
        let all = all(header);
        Self(wanted.numbers.iter().map(|n| all[*n].clone()).collect())
    }

    /// Appends the values in a record.
    #[inline]
    pub(super) fn put(&self, record: &[u8], values: &mut Vec<u8>) {
        for field in &self.0 {
            field.put(record, values);
        }
    }

    /// Adds the layers of the fields to what is decompressed.
    pub(super) fn layers(&self, selection: DecompressionSelection) -> DecompressionSelection {
        let add = |selection, field: &Field| (field.layer)(selection);
        self.0.iter().fold(selection, add)
    }
}
