//! PLY: ascii and binary, vertices only.

mod ascii;
mod binary;
mod header;

pub(super) use header::Header;

use super::format::Format;
use super::input::Input;
use super::source::Native;
use super::spool::SourceWriter;
use super::text::number;
use crate::error::Result;
use header::{Body, Scalar};

impl Header {
    /// Format by the kind of body.
    pub(super) fn format(&self) -> Format {
        match self.body {
            Body::Ascii => Format::PlyAscii,
            Body::Little => Format::PlyBinaryLittleEndian,
            Body::Big => Format::PlyBinaryBigEndian,
        }
    }

    /// How the spool holds the points: single precision if all coordinates have it.
    pub(super) fn native(&self) -> Native {
        let single = self
            .vertex
            .as_ref()
            .is_some_and(|v| v.coordinates.iter().all(|c| c.1 == Scalar::F32));
        if single { Native::F32 } else { Native::F64 }
    }

    /// Points the header claims.
    pub(super) fn claimed(&self) -> u64 {
        self.vertex.as_ref().map_or(0, |v| v.count)
    }
}

/// Reads a PLY file into the spool; returns what the user should know.
pub(super) fn read(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    if header.vertex.is_none() {
        return Ok(vec![
            "the header has no element \"vertex\", so there are no points".into(),
        ]);
    }
    match (header.body, header.native()) {
        (Body::Ascii, Native::F32) => ascii::read::<f32>(input, header, writer),
        (Body::Ascii, _) => ascii::read::<f64>(input, header, writer),
        (_, Native::F32) => binary::read::<f32>(input, header, writer),
        (..) => binary::read::<f64>(input, header, writer),
    }?;
    Ok(Vec::new())
}

/// A coordinate made from any scalar.
trait FromScalar: super::spool::Coordinate {
    fn from_single(value: f32) -> Self;
    fn from_double(value: f64) -> Self;
    /// A number in text; see [`number::parse`].
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self>;
}

impl FromScalar for f32 {
    fn from_single(value: f32) -> Self {
        value
    }
    fn from_double(value: f64) -> Self {
        value as f32
    }
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self> {
        // Straight to single precision: rounding twice may differ.
        match std::str::from_utf8(word).ok()?.parse() {
            Ok(value) => Some(value),
            Err(_) => number::parse(word, false, decimals).map(|v| v as f32),
        }
    }
}

impl FromScalar for f64 {
    fn from_single(value: f32) -> Self {
        f64::from(value)
    }
    fn from_double(value: f64) -> Self {
        value
    }
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self> {
        number::parse(word, false, decimals)
    }
}
