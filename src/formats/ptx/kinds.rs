//! What lines of a PTX file have behind the coordinates: by the number of their words.

use super::super::lines;
use super::scan::{HEADER, words};
use outcrop_ply::Scalar;
use outcrop_points::columns::{COLORS, Column, INTENSITY, SCANNER, Wanted};

/// Words of a line with coordinates, an intensity and a colour; whatever follows is passed over.
pub(super) const MOST_WORDS: usize = 7;

/// What some lines of a file have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Kinds(u8);

const INTENSE: u8 = 1;
const COLOURED: u8 = 2;
const COLOURLESS: u8 = 4;

impl Kinds {
    /// Of a file of which the lines are not known.
    pub(super) const ALL: Self = Self(INTENSE | COLOURED);

    /// Of a line of so many words.
    pub(super) fn of(words: usize) -> Self {
        Self(match words {
            0..=3 => COLOURLESS,
            4 | 5 => INTENSE | COLOURLESS,
            6 => COLOURED,
            _ => INTENSE | COLOURED,
        })
    }

    /// Of the points of a file of which all bytes are at hand.
    pub(super) fn of_head(head: &[u8]) -> Self {
        let all = head.split(|b| lines::is_end(*b)).map(<[u8]>::trim_ascii);
        let mut kinds = 0;
        let mut left = 0;
        let mut header: Vec<&[u8]> = Vec::new();
        for line in all.filter(|line| !line.is_empty()) {
            if left > 0 {
                left -= 1;
                if !words(line).take(3).all(is_zero) {
                    kinds |= Self::of(words(line).take(MOST_WORDS).count()).0;
                }
                continue;
            }
            header.push(line);
            if header.len() == HEADER {
                let number = |at: usize| std::str::from_utf8(header[at]).ok()?.parse::<u64>().ok();
                let sides = [number(0), number(1)].map(Option::unwrap_or_default);
                left = sides[0].saturating_mul(sides[1]);
                header.clear();
            }
        }
        Self(kinds)
    }

    pub(super) fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    pub(super) fn bits(self) -> u8 {
        self.0
    }

    fn has(self, kind: u8) -> bool {
        self.0 & kind != 0
    }

    /// True if some lines have a colour, and some none.
    pub(super) fn is_partly_coloured(self) -> bool {
        self.has(COLOURED) && self.has(COLOURLESS)
    }
}

/// True for a word like `0` or `-0.000`.
fn is_zero(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|word| word.parse() == Ok(0.0))
}

/// The columns of lines of these kinds: an intensity, a colour, and the scanner.
pub(super) fn columns(kinds: Kinds) -> Vec<Column> {
    let intensity = kinds
        .has(INTENSE)
        .then(|| Column::new(INTENSITY, Scalar::F32));
    let color = COLORS.map(|name| Column::new(name, Scalar::U8));
    let color = color.into_iter().filter(|_| kinds.has(COLOURED));
    let scanner = Column::new(SCANNER, Scalar::U16);
    intensity
        .into_iter()
        .chain(color)
        .chain([scanner])
        .collect()
}

/// A wanted value of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Value {
    Intensity,
    /// Red, green or blue.
    Colour(usize),
    /// The number of the scanner, which is not in the line.
    Scanner,
}

impl Value {
    /// The wanted ones, in their order.
    pub(super) fn all(wanted: &Wanted) -> Vec<Self> {
        let value = |column: &Column| match COLORS.iter().position(|name| *name == column.name) {
            Some(part) => Self::Colour(part),
            None if column.name == SCANNER => Self::Scanner,
            None => Self::Intensity,
        };
        wanted.columns.iter().map(value).collect()
    }

    pub(super) fn is_scanner(self) -> bool {
        self == Self::Scanner
    }

    pub(super) fn scalar(self) -> Scalar {
        match self {
            Self::Intensity => Scalar::F32,
            Self::Colour(_) => Scalar::U8,
            Self::Scanner => Scalar::U16,
        }
    }

    /// Its word in a line of so many, if it has one.
    #[inline]
    pub(super) fn place(self, words: usize) -> Option<usize> {
        let kinds = Kinds::of(words);
        match self {
            Self::Intensity => kinds.has(INTENSE).then_some(3),
            Self::Colour(part) => kinds
                .has(COLOURED)
                .then_some(words.min(MOST_WORDS) - 3 + part),
            Self::Scanner => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_words_tells_what_they_are() {
        for (words, want) in [
            (3, [None; 4]),
            (4, [Some(3), None, None, None]),
            (5, [Some(3), None, None, None]),
            (6, [None, Some(3), Some(4), Some(5)]),
            (7, [Some(3), Some(4), Some(5), Some(6)]),
        ] {
            let values = [
                Value::Intensity,
                Value::Colour(0),
                Value::Colour(1),
                Value::Colour(2),
            ];
            assert_eq!(values.map(|value| value.place(words)), want, "{words}");
        }
        assert_eq!(Value::Scanner.place(7), None);
    }
}
