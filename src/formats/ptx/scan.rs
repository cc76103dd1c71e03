//! The header of a scan in a PTX file.

use super::super::input::Input;
use super::super::lines;
use outcrop_disk::error::{Error, Result};
use outcrop_points::number::{self, NOT_FIXED};
use serde::{Deserialize, Serialize};

/// Lines of a header: columns, rows, position and three axes of the scanner, and four rows of a matrix.
pub(super) const HEADER: usize = 10;

/// Numbers in each of these lines.
const NUMBERS: [usize; HEADER] = [1, 1, 3, 3, 3, 3, 4, 4, 4, 4];

/// The outcome of [`shape`].
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// The lines of a header.
    Header,
    Other,
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Tells if a file begins with a header.
pub(super) fn shape(head: &[u8]) -> Shape {
    let lines = head.split(|b| lines::is_end(*b));
    let lines = lines.map(<[u8]>::trim_ascii).filter(|l| !l.is_empty());
    let mut found = 0;
    for (line, wanted) in lines.zip(NUMBERS) {
        if numbers(line).is_none_or(|all| all.len() != wanted) {
            return Shape::Other;
        }
        found += 1;
    }
    match found == HEADER {
        true => Shape::Header,
        false => Shape::Other,
    }
}

/// The numbers of a line; none if a word is no number, or there are more than in any line of a header.
fn numbers(line: &[u8]) -> Option<Vec<f64>> {
    let mut decimals = 0;
    let all = words(line).take(5);
    all.map(|word| number::parse(word, false, &mut decimals))
        .collect()
}

/// A scan.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Scan {
    /// Lines after the header.
    pub(super) points: u64,
    /// Its number among the scans with points; [`NO_SCANNER`](outcrop_points::columns::NO_SCANNER) for too large
    /// ones.
    pub(super) number: u16,
    /// Position of the scanner, in the coordinates of the cloud.
    pub(super) scanner: [f64; 3],
    /// Images of the axes, and of the origin, in the coordinates of the cloud.
    axes: [[f64; 3]; 4],
    /// Decimals of the origin if the axes stay as they are, else [`NOT_FIXED`].
    pub(super) decimals: u32,
}

impl Scan {
    /// The scan that begins with these lines, the first of which is at `at`.
    ///
    /// # Errors
    /// [`Error::Input`] if they are no header.
    pub(super) fn of(input: &Input, at: u64, header: &[&[u8]]) -> Result<Self> {
        let wrong = |number: usize, expected: &str| {
            let line = header.get(number).copied().unwrap_or_default();
            let shown = format!("\"{}\"", line[..line.len().min(60)].escape_ascii());
            wrong(input, at, number, shown, expected)
        };
        let mut rows = [[0.0; 4]; HEADER];
        for (number, wanted) in NUMBERS.into_iter().enumerate() {
            let line = header.get(number).copied().unwrap_or_default();
            let found = numbers(line).filter(|all| all.len() == wanted);
            let finite = found.filter(|all| all.iter().all(|v| v.is_finite()));
            let Some(all) = finite else {
                return Err(wrong(number, EXPECTED[number])?);
            };
            rows[number][..wanted].copy_from_slice(&all);
        }
        let counts = [0, 1].map(|number| {
            let text = std::str::from_utf8(header[number]).ok();
            text.and_then(|text| text.parse::<u64>().ok())
        });
        let [Some(columns), Some(lines)] = counts else {
            return Err(wrong(usize::from(counts[0].is_some()), "a whole number")?);
        };
        let matrix = [rows[6], rows[7], rows[8], rows[9]];
        for (number, (row, last)) in matrix.iter().zip([0.0, 0.0, 0.0, 1.0]).enumerate() {
            if row[3] != last {
                let expected = format!("{last} as the last number, for points are in rows");
                return Err(wrong(6 + number, &expected)?);
            }
        }
        let axes = matrix.map(|[x, y, z, _]| [x, y, z]);
        let unit = axes[..3] == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut decimals = 0;
        for word in words(header[9]).take(3) {
            number::parse(word, false, &mut decimals);
        }
        // If the points were moved already, only the third line tells where the scanner was.
        let [x, y, z, _] = rows[2];
        Ok(Self {
            points: columns.saturating_mul(lines),
            number: 0,
            scanner: match unit && axes[3] == [0.0; 3] {
                true => [x, y, z],
                false => axes[3],
            },
            axes,
            decimals: if unit { decimals } else { NOT_FIXED },
        })
    }

    /// A point of the scanner in the coordinates of the cloud.
    #[inline]
    pub(super) fn placed(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [a, b, c, origin] = self.axes;
        std::array::from_fn(|k| a[k] * x + b[k] * y + c[k] * z + origin[k])
    }
}

/// The lines of a header, for messages.
const EXPECTED: [&str; HEADER] = [
    "the number of columns of a scan",
    "the number of rows of a scan",
    "the position of the scanner, three numbers",
    "an axis of the scanner, three numbers",
    "an axis of the scanner, three numbers",
    "an axis of the scanner, three numbers",
    "a row of the transformation, four numbers",
    "a row of the transformation, four numbers",
    "a row of the transformation, four numbers",
    "a row of the transformation, four numbers",
];

/// The error of a line of a header, which begins at `at`.
fn wrong(input: &Input, at: u64, number: usize, found: String, expected: &str) -> Result<Error> {
    let line = lines::number_of(input, at)? + number as u64;
    Ok(input.error(format!("PTX header, line {line}"), found, expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_its_first_lines() {
        let head = "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
        assert_eq!(shape(head.as_bytes()), Shape::Header);
        assert_eq!(shape(head.replace('\n', "\r\n").as_bytes()), Shape::Header);
        assert_eq!(shape(&head.as_bytes()[..40]), Shape::Other);
        assert_eq!(shape(b"2\n1 2 3\n4 5 6\n"), Shape::Other);
        assert_eq!(shape(b""), Shape::Other);
    }
}
