//! The scale of the colours in a file: numbers of 8 or 16 bits, or from 0 to 1. It is decided for each file, by what
//! the file says, by the type of its numbers, or by most of its points.

use super::columns::{COLORS, Column};
use outcrop_ply::Scalar;
use serde::{Deserialize, Serialize};

/// A file of 8 bits in which so many points for each of 16 bits are of 8 has no real points of 16 bits.
const STRAY: u64 = 16;

/// A stray point of 16 bits among those of 8 has a number from here on; lower ones are white.
const SURELY_WIDE: f64 = 512.0;

/// The scale of colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Depth {
    /// From 0 to 1.
    #[serde(rename = "0 to 1")]
    One,
    /// From 0 to 255.
    #[serde(rename = "8 bits")]
    Eight,
    /// From 0 to 65535.
    #[serde(rename = "16 bits")]
    Sixteen,
    /// Between limits of their own, which the file gives; brought to 0 to 65535 when they are read.
    #[serde(rename = "limits of the file")]
    Given,
}

impl std::fmt::Display for Depth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::One => "0 to 1",
            Self::Eight => "8 bits",
            Self::Sixteen => "16 bits",
            Self::Given => "by the limits of the file",
        })
    }
}

/// True for numbers that are of 8 bits in any file.
fn is_narrow(scalar: Scalar) -> bool {
    matches!(scalar, Scalar::U8 | Scalar::I8)
}

/// Byte and type of the colours in rows of these columns that may be of more than 8 bits.
pub(super) fn open_places(columns: &[Column]) -> Vec<(usize, Scalar)> {
    let mut at = 0;
    let mut places = Vec::new();
    for (number, column) in columns.iter().enumerate() {
        // Of several with the same name the first counts.
        let first = columns[..number].iter().all(|c| c.name != column.name);
        if COLORS.contains(&&*column.name) && !is_narrow(column.scalar) && first {
            places.push((at, column.scalar));
        }
        at += column.scalar.bytes();
    }
    places
}

/// Points of a file by their largest colour; merging is commutative.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Up to 1, but not black.
    one: u64,
    /// Up to 255.
    eight: u64,
    /// More.
    more: u64,
    /// Those with more in which all colours are multiples of 256, or all of 257.
    whole: u64,
}

impl Tally {
    /// Takes the colours of a point; NaN has no effect.
    #[inline]
    pub(super) fn add(&mut self, colors: impl Iterator<Item = f64> + Clone) {
        let most = colors.clone().fold(0.0, f64::max);
        if most <= 0.0 {
            // Black is black on any scale.
        } else if most <= 1.0 {
            self.one += 1;
        } else if most < 256.0 {
            self.eight += 1;
        } else {
            self.more += 1;
            let all = |of: f64| colors.clone().all(|c| c % of == 0.0);
            self.whole += u64::from(all(256.0) || all(257.0));
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.one += other.one;
        self.eight += other.eight;
        self.more += other.more;
        self.whole += other.whole;
    }
}

/// The scale of the colours of a file, and how far it is certain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub(super) depth: Depth,
    /// In a file of 8 bits, points whose largest colour is this or more are of 16.
    wide_from: f64,
    /// True if it was not guessed.
    pub(super) certain: bool,
    /// Points of a file of 8 bits with more.
    pub(super) stray: u64,
}

impl Scale {
    /// Of numbers of these types, with what the file says of their scale.
    pub(super) fn of(scalars: &[Scalar], said: Option<Depth>, tally: &Tally) -> Self {
        let wide: Vec<&Scalar> = scalars.iter().filter(|s| !is_narrow(**s)).collect();
        let whole = wide.iter().all(|s| s.is_integer());
        let Tally {
            one, eight, more, ..
        } = *tally;
        let small = one + eight;
        let is_black = small + more == 0;
        // Multiples of 256 and 257 are never small, so small numbers beside them are of 8 bits.
        let of_8_bits = small > more || small > 0 && tally.whole == more;
        let guessed = match whole {
            _ if wide.is_empty() => Depth::Eight,
            true if is_black => Depth::Sixteen,
            false if is_black || one > eight + more => Depth::One,
            _ if of_8_bits => Depth::Eight,
            _ => Depth::Sixteen,
        };
        let usual = whole && guessed == Depth::Sixteen && small == 0;
        let depth = said.unwrap_or(guessed);
        let mixed = more.saturating_mul(STRAY) > small;
        Self {
            depth,
            wide_from: if mixed { 256.0 } else { SURELY_WIDE },
            certain: said.is_some() || wide.is_empty() || is_black || usual,
            stray: if depth == Depth::Eight { more } else { 0 },
        }
    }
}

/// The scale of a file with these columns, as far as it is known: `tally` is none if the colours were not read.
pub fn depth_of(columns: &[Column], said: Option<Depth>, tally: Option<&Tally>) -> Option<Depth> {
    let colors = columns.iter().filter(|c| COLORS.contains(&&*c.name));
    let scalars: Vec<Scalar> = colors.map(|c| c.scalar).collect();
    let narrow = scalars.iter().all(|s| is_narrow(*s));
    let known = said.is_some() || narrow || tally.is_some();
    let scale = || Scale::of(&scalars, said, tally.unwrap_or(&Tally::default()));
    (known && !scalars.is_empty()).then(|| scale().depth)
}

/// The way of the colours of one file to the mesh.
#[derive(Debug, Clone)]
pub(super) struct Tone {
    scale: Scale,
    /// Places of the colours that may be of more than 8 bits.
    places: Vec<(usize, Scalar)>,
    /// True if the mesh has 16 bits.
    wide: bool,
}

impl Tone {
    pub(super) fn new(scale: Scale, columns: &[Column], wide: bool) -> Self {
        Self {
            scale,
            places: open_places(columns),
            wide,
        }
    }

    /// The scale of the colours of a point with these values.
    #[inline]
    pub(super) fn of_point(&self, values: &[u8]) -> Depth {
        if self.scale.depth != Depth::Eight {
            return self.scale.depth;
        }
        let colors = self.places.iter();
        let colors = colors.map(|(at, scalar)| outcrop_ply::real(*scalar, &values[*at..], false));
        match colors.fold(0.0, f64::max) >= self.scale.wide_from {
            true => Depth::Sixteen,
            false => Depth::Eight,
        }
    }

    /// A colour of the type `from` as it is in the mesh.
    #[inline]
    pub(super) fn shade(&self, value: f64, from: Scalar, of_point: Depth) -> f64 {
        let depth = match is_narrow(from) {
            true => Depth::Eight,
            false => of_point,
        };
        match (depth, self.wide) {
            (Depth::One, wide) => (value * if wide { 65535.0 } else { 255.0 }).round(),
            (Depth::Eight, false) => value.round(),
            (Depth::Eight, true) => (value * 257.0).round(),
            // The upper half: right for writers that multiply by 256 and by 257.
            (Depth::Sixteen | Depth::Given, false) => (value / 256.0).floor(),
            (Depth::Sixteen | Depth::Given, true) => value.round(),
        }
    }
}

/// What was taken, in one line: of files with these scales.
pub(super) fn said(scales: &[Scale]) -> String {
    let depths: Vec<Depth> = scales.iter().map(|scale| scale.depth).collect();
    let mut line = depths_shown(&depths).unwrap_or_default();
    let stray: u64 = scales.iter().map(|scale| scale.stray).sum();
    if stray > 0 {
        let points = if stray == 1 {
            "point has"
        } else {
            "points have"
        };
        line += &format!("; {stray} {points} numbers above 255 there, taken as of 16 bits");
    }
    line
}

/// The scales of files with colours in one line; none without any.
pub fn depths_shown(depths: &[Depth]) -> Option<String> {
    let mut each: Vec<(Depth, usize)> = Vec::new();
    let mut sorted = depths.to_vec();
    sorted.sort_unstable();
    for depth in sorted {
        match each.last_mut() {
            Some((last, count)) if *last == depth => *count += 1,
            _ => each.push((depth, 1)),
        }
    }
    match each[..] {
        [] => None,
        [(depth, _)] => Some(format!("colours {depth}")),
        _ => {
            let parts = each.iter().map(|(depth, count)| match count {
                1 => format!("{depth} in 1 file"),
                _ => format!("{depth} in {count} files"),
            });
            Some(format!("colours {}", parts.collect::<Vec<_>>().join(", ")))
        }
    }
}

#[cfg(test)]
mod tests;
