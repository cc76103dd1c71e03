//! The data after a header, as a sequence of numbers.

use crate::error::Result;
use crate::header::{Element, Field};
use crate::types::{Encoding, Property, Scalar};
use std::io::{self, BufRead, ErrorKind, Read};

/// The number in the first bytes, in little-endian order unless `big`; all types fit into `f64`. The caller
/// has checked the length.
#[must_use]
#[inline]
pub fn real(scalar: Scalar, bytes: &[u8], big: bool) -> f64 {
    match scalar {
        Scalar::F32 => f32::from_le_bytes(array(bytes, big)).into(),
        Scalar::F64 => f64::from_le_bytes(array(bytes, big)),
        _ => integer(scalar, bytes, big) as f64,
    }
}

/// As [`real`], truncated to an integer.
#[inline]
pub(crate) fn integer(scalar: Scalar, bytes: &[u8], big: bool) -> i64 {
    match scalar {
        Scalar::I8 => i8::from_le_bytes(array(bytes, big)).into(),
        Scalar::U8 => u8::from_le_bytes(array(bytes, big)).into(),
        Scalar::I16 => i16::from_le_bytes(array(bytes, big)).into(),
        Scalar::U16 => u16::from_le_bytes(array(bytes, big)).into(),
        Scalar::I32 => i32::from_le_bytes(array(bytes, big)).into(),
        Scalar::U32 => u32::from_le_bytes(array(bytes, big)).into(),
        Scalar::F32 => f32::from_le_bytes(array(bytes, big)) as i64,
        Scalar::F64 => f64::from_le_bytes(array(bytes, big)) as i64,
    }
}

#[inline]
fn array<const N: usize>(bytes: &[u8], big: bool) -> [u8; N] {
    let mut value = [0; N];
    value.copy_from_slice(&bytes[..N]);
    if big {
        value.reverse();
    }
    value
}

/// Reads a sequence of numbers in any encoding. Errors are the content found.
#[derive(Debug)]
pub struct Numbers<R> {
    /// The data.
    pub input: R,
    encoding: Encoding,
    token: Vec<u8>,
}

/// Upper bound for the length of a number in text.
const LONGEST: usize = 400;

const END: &str = "the end of the file";

impl<R: BufRead> Numbers<R> {
    /// Numbers from the begin of `input` on.
    pub fn new(input: R, encoding: Encoding) -> Self {
        Self {
            input,
            encoding,
            token: Vec::new(),
        }
    }

    pub(crate) fn next(&mut self, scalar: Scalar) -> Result<f64, String> {
        if self.encoding == Encoding::Ascii {
            return self.next_token();
        }
        let mut bytes = [0; 8];
        let read = self.input.read_exact(&mut bytes[..scalar.bytes()]);
        read.map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => END.to_owned(),
            _ => e.to_string(),
        })?;
        Ok(real(scalar, &bytes, self.encoding == Encoding::Big))
    }

    /// Reads an entry with coordinates; they are from [`Element::coordinates`].
    ///
    /// # Errors
    /// The content found instead of the entry.
    pub fn point(
        &mut self,
        element: &Element,
        coordinates: &[Field; 3],
    ) -> Result<[f64; 3], String> {
        self.point_with(element, coordinates, &[], &mut Vec::new())
    }

    /// As [`Numbers::point`]; replaces `others` by the values of the properties `columns`, given by their indices
    /// and types, ascending.
    ///
    /// # Errors
    /// The content found instead of the entry.
    pub fn point_with(
        &mut self,
        element: &Element,
        coordinates: &[Field; 3],
        columns: &[Field],
        others: &mut Vec<f64>,
    ) -> Result<[f64; 3], String> {
        let mut point = [0.0; 3];
        others.clear();
        for (at, (_, property)) in element.properties.iter().enumerate() {
            let axis = coordinates.iter().position(|c| c.0 == at);
            if let Some(axis) = axis {
                point[axis] = self.next(coordinates[axis].1)?;
            } else if let Some((_, scalar)) = columns.iter().find(|c| c.0 == at) {
                others.push(self.next(*scalar)?);
            } else {
                self.skip(*property)?;
            }
        }
        Ok(point)
    }

    /// Skips an entry.
    ///
    /// # Errors
    /// The content found instead of the entry.
    pub fn skip_entry(&mut self, element: &Element) -> Result<(), String> {
        let mut properties = element.properties.iter();
        properties.try_for_each(|p| self.skip(p.1))
    }

    fn next_token(&mut self) -> Result<f64, String> {
        self.token.clear();
        loop {
            let buffer = self.input.fill_buf().map_err(|e| e.to_string())?;
            if buffer.is_empty() {
                break;
            }
            // Leading white space first, then up to the next, over any number of buffers.
            let blank = |b: &&u8| b.is_ascii_whitespace();
            let begin = match self.token.is_empty() {
                true => buffer.iter().take_while(blank).count(),
                false => 0,
            };
            let word = buffer[begin..].iter().take_while(|b| !blank(b)).count();
            self.token.extend_from_slice(&buffer[begin..begin + word]);
            let more = begin + word == buffer.len() && self.token.len() <= LONGEST;
            self.input.consume(begin + word);
            if !more {
                break;
            }
        }
        if self.token.is_empty() {
            return Err(END.to_owned());
        }
        let text = String::from_utf8_lossy(&self.token);
        let short: String = text.chars().take(40).collect();
        let wrong = |_| format!("\"{}\", not a number", short.escape_debug());
        text.parse().map_err(wrong)
    }

    pub(crate) fn length(&mut self, scalar: Scalar) -> Result<u64, String> {
        let length = self.next(scalar)?;
        if (0.0..=f64::from(u32::MAX)).contains(&length) && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err(format!("a list of {length} items"))
        }
    }

    pub(crate) fn skip(&mut self, property: Property) -> Result<(), String> {
        match property {
            Property::One(scalar) => self.next(scalar).map(drop),
            Property::List { count, item } if self.encoding == Encoding::Ascii => {
                (0..self.length(count)?).try_for_each(|_| self.next(item).map(drop))
            }
            Property::List { count, item } => {
                let bytes = self.length(count)? * item.bytes() as u64;
                let skipped = io::copy(&mut self.input.by_ref().take(bytes), &mut io::sink());
                match skipped.map_err(|e| e.to_string())? == bytes {
                    true => Ok(()),
                    false => Err(END.to_owned()),
                }
            }
        }
    }
}
