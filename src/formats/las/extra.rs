//! Extra bytes of a record: their descriptors, a variable-length record of LAS 1.4 that files of lower versions
//! have too.

use super::vlr::Records;
use outcrop_ply::Scalar;
use std::ops::Range;

/// The record with the descriptors.
const USER: &str = "LASF_Spec";
const NUMBER: u16 = 4;

/// Bytes of a descriptor, and where its parts are: type, options, name, scale, offset.
const DESCRIPTOR: usize = 192;
const TYPE: usize = 2;
const OPTIONS: usize = 3;
const NAME: Range<usize> = 4..36;
const SCALE: usize = 112;
const OFFSET: usize = 136;

/// Bits of the options that say that scale and offset are given.
const HAS_SCALE: u8 = 1 << 3;
const HAS_OFFSET: u8 = 1 << 4;

/// Type of a number as it is in the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    One(Scalar),
    /// Integers of 64 bits, unsigned and signed.
    Long,
    SignedLong,
}

impl Kind {
    /// The type with this number, from 1, in the record.
    fn of(number: u8) -> Option<Self> {
        Some(match number {
            1 => Self::One(Scalar::U8),
            2 => Self::One(Scalar::I8),
            3 => Self::One(Scalar::U16),
            4 => Self::One(Scalar::I16),
            5 => Self::One(Scalar::U32),
            6 => Self::One(Scalar::I32),
            7 => Self::Long,
            8 => Self::SignedLong,
            9 => Self::One(Scalar::F32),
            10 => Self::One(Scalar::F64),
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::One(scalar) => scalar.bytes(),
            Self::Long | Self::SignedLong => 8,
        }
    }

    /// The number at the beginning of `bytes`.
    #[inline]
    fn number(self, bytes: &[u8]) -> f64 {
        let word = |bytes: &[u8]| {
            bytes
                .first_chunk()
                .map_or(0, |word| u64::from_le_bytes(*word))
        };
        match self {
            Self::One(scalar) => outcrop_ply::real(scalar, bytes, false),
            Self::Long => word(bytes) as f64,
            Self::SignedLong => word(bytes).cast_signed() as f64,
        }
    }
}

/// A number among the extra bytes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extra {
    /// Its name, as that of a column.
    pub name: String,
    /// Byte in the record.
    pub at: usize,
    pub value: Value,
}

/// How the value comes from the number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Value {
    kind: Kind,
    /// Scale and offset: the value is the number times the scale, plus the offset.
    map: Option<[f64; 2]>,
}

impl Value {
    /// Type of the value: that of the number, or `f64` if that is scaled or of 64 bits.
    pub(super) fn scalar(&self) -> Scalar {
        match (self.kind, self.map) {
            (Kind::One(scalar), None) => scalar,
            _ => Scalar::F64,
        }
    }

    /// Appends the value of the number at the beginning of `bytes`.
    #[inline]
    pub(super) fn put(&self, bytes: &[u8], values: &mut Vec<u8>) {
        let number = self.kind.number(bytes);
        let value = self
            .map
            .map_or(number, |[scale, offset]| number * scale + offset);
        self.scalar().put(value, values);
    }
}

/// The extra bytes of a file that these records describe; `extra` is where they are in the record of a point.
/// Descriptors of more bytes are left out, and what cannot be read is none.
pub(super) fn read(records: Records<'_>, extra: Range<usize>) -> Vec<Extra> {
    if extra.is_empty() {
        return Vec::new();
    }
    let mut records = records.map_while(Result::ok);
    let found = records.find(|(_, vlr)| vlr.user_id == USER && vlr.record_id == NUMBER);
    found.map_or_else(Vec::new, |(_, vlr)| {
        parse(&vlr.data, extra.start, extra.end)
    })
}

/// The numbers that are described; the extra bytes are from `at` to `end` of a record.
fn parse(data: &[u8], mut at: usize, end: usize) -> Vec<Extra> {
    let mut all = Vec::new();
    for descriptor in data.as_chunks::<DESCRIPTOR>().0 {
        let (number, options) = (descriptor[TYPE], descriptor[OPTIONS]);
        if number == 0 {
            // So many bytes without a meaning.
            at += usize::from(options);
            continue;
        }
        // Types from 11 on are pairs of those from 1 on, and from 21 on triples.
        let (count, number) = ((number - 1) / 10 + 1, (number - 1) % 10 + 1);
        let Some(kind) = Kind::of(number).filter(|_| count <= 3) else {
            break;
        };
        for part in 0..count {
            if at + kind.bytes() > end {
                return all;
            }
            let name = name(&descriptor[NAME]);
            if !name.is_empty() {
                all.push(Extra {
                    name: match count {
                        1 => name,
                        _ => format!("{name}{part}"),
                    },
                    at,
                    value: Value {
                        kind,
                        map: map(descriptor, options, part.into()),
                    },
                });
            }
            at += kind.bytes();
        }
    }
    all
}

/// Scale and offset of a part of a number, if there are any.
fn map(descriptor: &[u8; DESCRIPTOR], options: u8, part: usize) -> Option<[f64; 2]> {
    let double = |at: usize| {
        let bytes = descriptor[at + 8 * part..].first_chunk();
        bytes.map_or(0.0, |bytes| f64::from_le_bytes(*bytes))
    };
    let scale = (options & HAS_SCALE != 0).then(|| double(SCALE));
    let offset = (options & HAS_OFFSET != 0).then(|| double(OFFSET));
    (scale.is_some() || offset.is_some()).then(|| [scale.unwrap_or(1.0), offset.unwrap_or(0.0)])
}

/// The name of a column: in lower case, and of letters, digits and `_` only, since a PLY file has spaces between words.
fn name(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let text = text.split('\0').next().unwrap_or_default().trim();
    let usual = |c: char| match c.is_ascii_alphanumeric() {
        true => c.to_ascii_lowercase(),
        false => '_',
    };
    text.chars().map(usual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn descriptor(number: u8, options: u8, name: &str, map: [f64; 2]) -> Vec<u8> {
        let mut bytes = vec![0; DESCRIPTOR];
        (bytes[TYPE], bytes[OPTIONS]) = (number, options);
        bytes[NAME][..name.len()].copy_from_slice(name.as_bytes());
        for part in 0..3 {
            bytes[SCALE + 8 * part..][..8].copy_from_slice(&map[0].to_le_bytes());
            bytes[OFFSET + 8 * part..][..8].copy_from_slice(&map[1].to_le_bytes());
        }
        bytes
    }

    #[test]
    fn numbers_are_where_the_descriptors_say() {
        let none = [0.0; 2];
        let data = [
            descriptor(3, HAS_SCALE, "Pulse width", [0.1, 7.0]),
            descriptor(0, 5, "", none),
            descriptor(24, 0, "n", none),
            descriptor(8, HAS_OFFSET, "long", [9.0, 3.0]),
            descriptor(1, 0, "", none),
            descriptor(10, 0, "cut off", none),
        ];
        let found = parse(&data.concat(), 20, 49);
        let names: Vec<(&str, usize, Scalar)> = found
            .iter()
            .map(|e| (&*e.name, e.at, e.value.scalar()))
            .collect();
        let expected = [
            ("pulse_width", 20, Scalar::F64),
            ("n0", 27, Scalar::I16),
            ("n1", 29, Scalar::I16),
            ("n2", 31, Scalar::I16),
            ("long", 33, Scalar::F64),
        ];
        assert_eq!(names, expected);
        let value = |number: usize, bytes: &[u8]| {
            let mut values = Vec::new();
            found[number].value.put(bytes, &mut values);
            outcrop_ply::real(found[number].value.scalar(), &values, false)
        };
        assert_eq!(value(0, &[4, 1]), 260.0 * 0.1);
        assert_eq!(value(1, &[255, 255]), -1.0);
        assert_eq!(value(4, &(-5i64).to_le_bytes()), -2.0);
        // A type that is none hides where the rest is.
        assert!(parse(&descriptor(31, 0, "x", none), 20, 90).is_empty());
        assert!(parse(&[1; 191], 20, 90).is_empty());
    }
}
