//! Coordinates of formats that store single or double precision.

use outcrop_points::coordinate::Coordinate;
use outcrop_points::number;

/// A floating-point coordinate, made of what a file stores.
pub(super) trait FromScalar: Coordinate {
    fn from_double(value: f64) -> Self;
    /// Parses a number in text; see [`number::parse`].
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self>;
}

impl FromScalar for f32 {
    fn from_double(value: f64) -> Self {
        value as f32
    }
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self> {
        // Parsed directly as single precision, since rounding twice may differ.
        match std::str::from_utf8(word).ok()?.parse() {
            Ok(value) => Some(value),
            Err(_) => number::parse(word, false, decimals).map(|v| v as f32),
        }
    }
}

impl FromScalar for f64 {
    fn from_double(value: f64) -> Self {
        value
    }
    fn parse(word: &[u8], decimals: &mut u32) -> Option<Self> {
        number::parse(word, false, decimals)
    }
}
