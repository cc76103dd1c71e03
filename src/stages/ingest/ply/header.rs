//! The PLY header.

use super::super::input::Input;
use crate::error::{Error, Result};

/// Longest header that is read.
const LONGEST: usize = 1 << 20;

/// How the elements are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Body {
    Ascii,
    Little,
    Big,
}

/// Type of a number.
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

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A property of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Property {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

/// An element that is not the vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    names: Vec<String>,
}

/// The element of the points.
#[derive(Debug, Clone)]
pub(super) struct Vertex {
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// Number and type of the properties x, y and z.
    pub(super) coordinates: [(usize, Scalar); 3],
}

/// What matters of a PLY header.
#[derive(Debug, Clone)]
pub(in super::super) struct Header {
    pub(super) body: Body,
    /// Where the elements start.
    pub(super) data: u64,
    /// The elements before the vertices.
    pub(super) before: Vec<Element>,
    pub(super) vertex: Option<Vertex>,
}

impl Header {
    /// Reads the header.
    ///
    /// # Errors
    /// [`Error::Input`] naming the line.
    pub(in super::super) fn read(input: &Input) -> Result<Self> {
        let mut most = 16 << 10;
        loop {
            let head = input.head(most)?;
            let whole = head.len() as u64 == input.bytes;
            match Parser::parse(input, &head)? {
                Some(header) => return Ok(header),
                None if whole || most >= LONGEST => {
                    return Err(input.error(
                        "PLY header",
                        if whole {
                            "the end of the file"
                        } else {
                            "no end in 1 MiB"
                        },
                        "a line \"end_header\"",
                    ));
                }
                None => most *= 8,
            }
        }
    }
}

struct Parser<'a> {
    input: &'a Input,
    line: usize,
    body: Option<Body>,
    elements: Vec<Element>,
}

impl<'a> Parser<'a> {
    /// Parses a header, if its end is in `head`.
    fn parse(input: &'a Input, head: &[u8]) -> Result<Option<Header>> {
        let mut parser = Self {
            input,
            line: 0,
            body: None,
            elements: Vec::new(),
        };
        // Lines end with CR alone only if the first one does.
        let first_end = head.iter().position(|b| matches!(b, b'\n' | b'\r'));
        let old_mac =
            first_end.is_some_and(|e| head[e] == b'\r' && head.get(e + 1) != Some(&b'\n'));
        let end = if old_mac { b'\r' } else { b'\n' };
        let mut at = 0;
        while let Some(length) = head[at..].iter().position(|b| *b == end) {
            let line = head[at..at + length].trim_ascii();
            at += length + 1;
            parser.line += 1;
            let text = String::from_utf8_lossy(line);
            if text == "end_header" {
                return parser.finish(at as u64).map(Some);
            }
            parser.take(&text)?;
        }
        Ok(None)
    }

    fn error(&self, found: &str, expected: &str) -> Error {
        let short: String = found.chars().take(60).collect();
        self.input.error(
            format!("PLY header, line {}", self.line),
            format!("\"{}\"", short.escape_debug()),
            expected,
        )
    }

    fn take(&mut self, text: &str) -> Result<()> {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["ply" | "comment" | "obj_info", ..] => {}
            ["format", body, ..] => {
                self.body = Some(match body {
                    "ascii" => Body::Ascii,
                    "binary_little_endian" => Body::Little,
                    "binary_big_endian" => Body::Big,
                    _ => return Err(self.error(text, "ascii or binary_…_endian")),
                });
            }
            ["element", name, count] => {
                let Ok(count) = count.parse::<u64>() else {
                    return Err(self.error(text, "a number of elements, 0 or more"));
                };
                self.elements.push(Element {
                    name: name.to_owned(),
                    count,
                    ..Element::default()
                });
            }
            ["property", "list", count, item, name] => {
                match (Scalar::parse(count), Scalar::parse(item)) {
                    (Some(count), Some(item)) if !matches!(count, Scalar::F32 | Scalar::F64) => {
                        self.property(text, name, Property::List { count, item })?;
                    }
                    _ => return Err(self.error(text, "an integer type and a type")),
                }
            }
            ["property", kind, name] => match Scalar::parse(kind) {
                Some(scalar) => self.property(text, name, Property::One(scalar))?,
                None => return Err(self.error(text, "a type such as float or uchar")),
            },
            _ => return Err(self.error(text, "format, element, property, comment or end_header")),
        }
        Ok(())
    }

    fn property(&mut self, text: &str, name: &str, property: Property) -> Result<()> {
        match self.elements.last_mut() {
            Some(element) => {
                element.properties.push(property);
                element.names.push(name.to_owned());
                Ok(())
            }
            None => Err(self.error(text, "an element before its properties")),
        }
    }

    fn finish(self, data: u64) -> Result<Header> {
        let Some(body) = self.body else {
            return Err(self.error("end_header", "a line \"format\" before it"));
        };
        let named = self.elements.iter().filter(|e| e.name == "vertex").count();
        if named > 1 {
            return Err(self.input.error(
                "PLY header",
                format!("{named} elements named vertex"),
                "one",
            ));
        }
        let at = self.elements.iter().position(|e| e.name == "vertex");
        let vertex = match at {
            Some(at) => Some(self.vertex(&self.elements[at])?),
            None => None,
        };
        let mut before = self.elements;
        before.truncate(at.unwrap_or(0));
        Ok(Header {
            body,
            data,
            before,
            vertex,
        })
    }

    fn vertex(&self, element: &Element) -> Result<Vertex> {
        let mut coordinates = [(0, Scalar::F32); 3];
        for (to, name) in coordinates.iter_mut().zip(["x", "y", "z"]) {
            let named = element.names.iter().filter(|n| *n == name).count();
            if named > 1 {
                return Err(self.input.error(
                    "PLY header, element vertex",
                    format!("{named} properties named {name}"),
                    "one",
                ));
            }
            let at = element.names.iter().position(|n| n == name);
            *to = match at.map(|at| (at, element.properties[at])) {
                Some((at, Property::One(scalar))) => (at, scalar),
                Some((_, Property::List { .. })) => {
                    return Err(self.error(name, "a number for each vertex, not a list"));
                }
                None => {
                    return Err(self.input.error(
                        "PLY header, element vertex",
                        format!("no property {name}"),
                        "the properties x, y and z",
                    ));
                }
            };
        }
        Ok(Vertex {
            count: element.count,
            properties: element.properties.clone(),
            coordinates,
        })
    }
}
