//! The header of a PLY file.

use super::source::Source;
use crate::error::{Error, Result};

/// Longest header accepted, in bytes. It also bounds the size of one entry: a property takes at
/// least 18 bytes here and at most 8 there.
pub(super) const LONGEST: usize = 1 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Property {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<(String, Property)>,
}

impl Element {
    /// Fewest bytes one entry can take.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> u64 {
        if encoding == Encoding::Ascii {
            return 2 * self.properties.len() as u64;
        }
        let least = |(_, property): &(String, Property)| match *property {
            Property::Scalar(scalar) => scalar.size() as u64,
            Property::List { count, .. } => count.size() as u64,
        };
        self.properties.iter().map(least).sum()
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

/// Text of a damaged file, cut to what fits a message.
fn shown(text: &str) -> String {
    let text: String = text
        .chars()
        .take(60)
        .flat_map(char::escape_debug)
        .take(60)
        .collect();
    format!("'{text}'")
}

impl Header {
    pub(super) fn read(source: &mut Source) -> Result<Self> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        for number in 1.. {
            let line = source.line(LONGEST)?;
            let refuse = |found: String, expected: &str| {
                let place = format!("header line {number}");
                Err(Error::input(source.path(), place, found, expected))
            };
            if number == 1 {
                if line != "ply" {
                    return refuse(shown(&line), "'ply'");
                }
                continue;
            }
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["end_header"] => break,
                ["format", name, _version] => {
                    encoding = match *name {
                        "ascii" => Some(Encoding::Ascii),
                        "binary_little_endian" => Some(Encoding::Little),
                        "binary_big_endian" => Some(Encoding::Big),
                        _ => return refuse(shown(&line), "format ascii or binary"),
                    }
                }
                ["element", name, count] => match count.parse() {
                    Ok(count) => elements.push(Element {
                        name: (*name).to_owned(),
                        count,
                        properties: Vec::new(),
                    }),
                    Err(_) => return refuse(shown(&line), "a count below 2^64"),
                },
                ["property", rest @ ..] => match (property(rest), elements.last_mut()) {
                    (Some(found), Some(element)) => element.properties.push(found),
                    (None, _) => return refuse(shown(&line), "a property with known types"),
                    (_, None) => return refuse(shown(&line), "an element before its properties"),
                },
                _ => return refuse(shown(&line), "format, element, property or end_header"),
            }
        }
        match encoding {
            Some(encoding) => Ok(Self { encoding, elements }),
            None => Err(Error::input(
                source.path(),
                "header",
                "no format line",
                "one",
            )),
        }
    }

    /// Checks that vertices have coordinates and faces corners.
    pub(super) fn check_properties(&self, element: &Element, source: &Source) -> Result<()> {
        let expected = match element.name.as_str() {
            "vertex" if element.axes().is_none() => "scalar properties x, y and z",
            "face" if element.corners().is_none() => "a list vertex_indices or vertex_index",
            "face" => {
                let corners = element.corners().map(|i| element.properties[i].1);
                match corners {
                    Some(Property::List { item, .. }) if !item.is_integer() => {
                        "integer vertex indices"
                    }
                    _ => return Ok(()),
                }
            }
            _ => return Ok(()),
        };
        let names: Vec<&str> = element
            .properties
            .iter()
            .map(|(n, _)| &**n)
            .take(20)
            .collect();
        Err(Error::input(
            source.path(),
            format!("header, element {}", element.name),
            format!("properties [{}]", names.join(", ")),
            expected,
        ))
    }
}

fn property(words: &[&str]) -> Option<(String, Property)> {
    match words {
        ["list", count, item, name] => {
            let count = Scalar::parse(count).filter(|c| c.is_integer())?;
            let item = Scalar::parse(item)?;
            Some(((*name).to_owned(), Property::List { count, item }))
        }
        [scalar, name] => Some(((*name).to_owned(), Property::Scalar(Scalar::parse(scalar)?))),
        _ => None,
    }
}
