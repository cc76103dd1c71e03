//! The first lines of a text, from which its layout is inferred.

use super::super::lines::is_end;
use super::cells::Separator;
use outcrop_points::number;

/// Number of data lines used to infer the layout.
pub(super) const SAMPLE: usize = 200;

/// A line with its start and end in the text.
pub(super) type Line<'a> = (usize, usize, &'a [u8]);

pub(super) fn is_blank(line: &[u8]) -> bool {
    line.is_empty() || line.starts_with(b"#") || line.starts_with(b"//") || line.starts_with(b"%")
}

/// The lines of the head that are neither blank nor comments.
pub(super) fn lines(head: &[u8], whole: bool) -> Vec<Line<'_>> {
    let mut found = Vec::new();
    let mut at = 0;
    for line in head.split(|b| is_end(*b)) {
        let end = at + line.len();
        // The last line is incomplete unless the head is the whole file.
        if (end < head.len() || whole) && !is_blank(line.trim_ascii()) {
            found.push((at, end, line));
        }
        at = end + 1;
        if found.len() > SAMPLE {
            break;
        }
    }
    found
}

/// The comments of a part of a text, the last first, without the signs before them.
pub(super) fn comments(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let lines = text.rsplit(|b| is_end(*b));
    let lines = lines.filter(|line| is_blank(line.trim_ascii()));
    lines.filter_map(|line| {
        let sign = |b: &u8| matches!(b, b'#' | b'/' | b'%' | b' ' | b'\t');
        let from = line.iter().position(|b| !sign(b))?;
        Some(&line[from..])
    })
}

/// Bytes of the first `count` lines; none if there are fewer. CR LF is one line end.
pub(super) fn after_lines(head: &[u8], count: u64) -> Option<usize> {
    let mut at = 0;
    for _ in 0..count {
        let end = at + head[at..].iter().position(|b| is_end(*b))?;
        let both = head[end] == b'\r' && head.get(end + 1) == Some(&b'\n');
        at = end + 1 + usize::from(both);
    }
    Some(at)
}

/// The number of points that a line gives, as in PTS.
pub(super) fn count(line: &[u8]) -> Option<u64> {
    std::str::from_utf8(line.trim_ascii()).ok()?.parse().ok()
}

/// A shortened text for error messages.
pub(super) fn shown(text: &[u8]) -> String {
    let cut = &text[..text.len().min(40)];
    let dots = if cut.len() < text.len() { "…" } else { "" };
    format!("{}{dots}", cut.escape_ascii())
}

/// The cells of the sampled lines.
pub(super) struct Table<'a> {
    pub(super) separator: Separator,
    decimal_comma: bool,
    pub(super) rows: Vec<Vec<&'a [u8]>>,
    /// Columns of the longest line, without empty ones at its end.
    pub(super) width: usize,
}

impl<'a> Table<'a> {
    pub(super) fn of(lines: &[&'a [u8]], separator: Separator, decimal_comma: bool) -> Self {
        let row = |line: &&'a [u8]| {
            let mut cells: Vec<&[u8]> = separator.cells(separator.trimmed(line)).collect();
            while cells.last().is_some_and(|cell| cell.is_empty()) {
                cells.pop();
            }
            cells
        };
        let rows: Vec<Vec<&[u8]>> = lines.iter().map(row).collect();
        Self {
            separator,
            decimal_comma,
            width: rows.iter().map(Vec::len).max().unwrap_or(0),
            rows,
        }
    }

    pub(super) fn decimal_comma(&self) -> bool {
        self.decimal_comma
    }

    /// The number in a cell.
    pub(super) fn number(&self, cell: &[u8]) -> Option<f64> {
        number::parse(cell, self.decimal_comma, &mut 0)
    }

    /// The cells of a column in the lines that reach so far.
    pub(super) fn cells(&self, column: usize) -> impl Iterator<Item = &'a [u8]> {
        self.rows
            .iter()
            .filter_map(move |row| row.get(column).copied())
    }

    /// True if a line has a number in the column, and none anything else.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        let number = |cell: &[u8]| self.number(cell).is_some();
        self.cells(column).next().is_some() && self.cells(column).all(number)
    }

    /// True if a column is one of numbers with decimal commas only, which `points` does not take for such, and
    /// no cell has a point.
    pub(super) fn needs_commas(&self, points: &Self) -> bool {
        let dot = |cell: &&[u8]| cell.contains(&b'.') && points.number(cell).is_some();
        (0..self.width).any(|at| self.is_numeric(at) && !points.is_numeric(at))
            && !points.rows.iter().flatten().any(dot)
    }

    /// True if some line has a word in the column that is no number.
    pub(super) fn has_words(&self, column: usize) -> bool {
        let word = |cell: &[u8]| !cell.is_empty() && self.number(cell).is_none();
        self.cells(column).any(word)
    }

    /// The largest value of columns of whole numbers that are not negative, if all lines have one.
    pub(super) fn most(&self, columns: std::ops::Range<usize>) -> Option<f64> {
        let mut most: f64 = 0.0;
        for row in &self.rows {
            for cell in row.get(columns.clone())? {
                let value = self.number(cell)?;
                if value < 0.0 || value.fract() != 0.0 {
                    return None;
                }
                most = most.max(value);
            }
        }
        Some(most)
    }

    /// True if all values of columns are from 0 to 1.
    pub(super) fn in_unit(&self, columns: std::ops::Range<usize>) -> bool {
        let unit = |cell: &&[u8]| self.number(cell).is_some_and(|v| (0.0..=1.0).contains(&v));
        let mut rows = self.rows.iter().map(|row| row.get(columns.clone()));
        rows.all(|cells| cells.is_some_and(|cells| cells.iter().all(unit)))
    }

    /// True if a column counts the lines one by one.
    pub(super) fn counts(&self, column: usize) -> bool {
        let values: Option<Vec<u64>> = self
            .rows
            .iter()
            .map(|row| count(row.get(column)?))
            .collect();
        let one_more = |pair: &[u64]| pair[0].checked_add(1) == Some(pair[1]);
        values.is_some_and(|values| values.len() > 1 && values.windows(2).all(one_more))
    }

    /// True if a column has whole numbers only, written without a fraction.
    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.rows
            .iter()
            .all(|row| row.get(column).is_some_and(|cell| count(cell).is_some()))
    }
}
