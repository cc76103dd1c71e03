//! The header of a PLY file.

use std::io::BufRead;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Body {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    One(Scalar),
    List { length: Scalar, item: Scalar },
}

#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub shape: Shape,
}

#[derive(Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Debug)]
pub(super) struct Header {
    pub body: Body,
    pub elements: Vec<Element>,
}

/// Longest header line that is believed.
const LINE_LIMIT: u64 = 4096;

impl Header {
    /// Reads up to and including the line `end_header`. The error is a message.
    pub(super) fn read(input: &mut impl BufRead) -> Result<Self, String> {
        if next_line(input)? != "ply" {
            return Err("the file does not begin with \"ply\"".to_owned());
        }
        let mut body = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let line = next_line(input)?;
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                [] | ["comment" | "obj_info", ..] => {}
                ["end_header"] => break,
                ["format", name, _version] => {
                    body = Some(match *name {
                        "ascii" => Body::Ascii,
                        "binary_little_endian" => Body::LittleEndian,
                        "binary_big_endian" => Body::BigEndian,
                        other => return Err(format!("unknown format \"{other}\"")),
                    });
                }
                ["element", name, count] => elements.push(Element {
                    name: (*name).to_owned(),
                    count: count
                        .parse()
                        .map_err(|_| format!("bad count in \"{line}\""))?,
                    properties: Vec::new(),
                }),
                ["property", rest @ ..] => {
                    let property = property(rest).ok_or(format!("cannot read \"{line}\""))?;
                    let element = elements.last_mut().ok_or("a property before any element")?;
                    element.properties.push(property);
                }
                _ => return Err(format!("cannot read \"{line}\"")),
            }
        }
        Ok(Header {
            body: body.ok_or("no format line")?,
            elements,
        })
    }
}

fn property(words: &[&str]) -> Option<Property> {
    let (name, shape) = match words {
        ["list", length, item, name] => {
            let (length, item) = (Scalar::parse(length)?, Scalar::parse(item)?);
            (name, Shape::List { length, item })
        }
        [scalar, name] => (name, Shape::One(Scalar::parse(scalar)?)),
        _ => return None,
    };
    Some(Property {
        name: (*name).to_owned(),
        shape,
    })
}

fn next_line(input: &mut impl BufRead) -> Result<String, String> {
    let mut line = Vec::new();
    let mut limited = std::io::Read::take(input, LINE_LIMIT);
    limited
        .read_until(b'\n', &mut line)
        .map_err(|e| e.to_string())?;
    if line.pop() != Some(b'\n') {
        return Err("the header has no end".to_owned());
    }
    let text = String::from_utf8(line).map_err(|_| "the header is not text".to_owned())?;
    Ok(text.trim_end().to_owned())
}
