//! The layout of points in a text file.

use super::cells::Separator;
use super::sample::{count, is_blank, shown};
use outcrop_points::columns::{Column, Wanted};
use outcrop_points::number;

/// The layout of points in a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    pub(super) decimal_comma: bool,
    /// The columns of the coordinates.
    pub(super) columns: [usize; 3],
    /// Offset of the data, after byte order mark and header line.
    pub(super) start: u64,
    /// True if lines with a single integer give the number of following points, as in PTS.
    pub(super) counted: bool,
    /// The other columns that have a name, ascending, and their places.
    pub(super) others: Vec<(usize, Column)>,
    /// Which columns are read as what.
    pub(super) taken: String,
    /// True if the file does not say so plainly.
    pub(super) guessed: bool,
}

/// The content of a line.
pub(super) enum Row {
    Blank,
    Point([f64; 3]),
    Count(u64),
    /// Anything else, with a description.
    Wrong(String),
}

impl Dialect {
    /// Parses a line; `decimals` is raised to the largest number of decimals found.
    pub(super) fn row(&self, line: &[u8], decimals: &mut u32) -> Row {
        let text = line.trim_ascii();
        if is_blank(text) {
            return Row::Blank;
        }
        let line = self.separator.trimmed(line);
        let last = self.columns[0].max(self.columns[1]).max(self.columns[2]);
        let mut point = [0.0; 3];
        let mut columns = 0;
        for (column, token) in self.separator.plain(line).take(last + 1).enumerate() {
            if token.first() == Some(&b'"') {
                return self.quoted(line, decimals);
            }
            columns += 1;
            if let Some(axis) = self.columns.iter().position(|c| *c == column) {
                match number::parse(token, self.decimal_comma, decimals) {
                    Some(value) => point[axis] = value,
                    None => return Row::Wrong(format!("\"{}\"", shown(token))),
                }
            }
        }
        if columns <= last {
            return self.short(text, columns);
        }
        Row::Point(point)
    }

    /// As [`Dialect::row`], for a line with quotes.
    #[cold]
    fn quoted(&self, line: &[u8], decimals: &mut u32) -> Row {
        let cells: Vec<&[u8]> = self.separator.cells(line).collect();
        let mut point = [0.0; 3];
        for (value, column) in point.iter_mut().zip(self.columns) {
            let Some(cell) = cells.get(column) else {
                return self.short(line.trim_ascii(), cells.len());
            };
            match number::parse(cell, self.decimal_comma, decimals) {
                Some(number) => *value = number,
                None => return Row::Wrong(format!("\"{}\"", shown(cell))),
            }
        }
        Row::Point(point)
    }

    /// A line that has no more than `columns`.
    #[cold]
    fn short(&self, line: &[u8], columns: usize) -> Row {
        match count(line) {
            Some(count) if self.counted => Row::Count(count),
            _ => Row::Wrong(format!("{columns} columns in \"{}\"", shown(line))),
        }
    }

    /// Appends the values of the wanted columns of a line; a word that is no number is NaN, or 0 if the type has
    /// none.
    pub(super) fn values(&self, line: &[u8], wanted: &Wanted, values: &mut Vec<u8>) {
        let line = self.separator.trimmed(line);
        match line.contains(&b'"') {
            true => self.put(self.separator.cells(line), wanted, values),
            false => self.put(self.separator.plain(line), wanted, values),
        }
    }

    fn put<'a>(
        &self,
        words: impl Iterator<Item = &'a [u8]>,
        wanted: &Wanted,
        values: &mut Vec<u8>,
    ) {
        let mut words = words.enumerate();
        for number in &wanted.numbers {
            let (place, column) = &self.others[*number];
            let word = words.find(|(at, _)| at == place);
            let value = word.and_then(|(_, w)| number::parse(w, self.decimal_comma, &mut 0));
            column.scalar.put(value.unwrap_or(f64::NAN), values);
        }
    }
}
