//! The layout of points in a text file, inferred from its first lines.

use super::super::columns::{COLORS, Column, INTENSITY, Wanted};
use super::super::number;
use outcrop_ply::Scalar;

/// Number of data lines used to infer the layout.
const SAMPLE: usize = 50;

/// Separator between numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    /// Spaces and tabs.
    Space,
    /// Commas, with or without spaces.
    Comma,
    /// Semicolons, with or without spaces.
    Semicolon,
}

impl Separator {
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::Space => "separated by spaces or tabs",
            Self::Comma => "separated by commas",
            Self::Semicolon => "separated by semicolons",
        }
    }
}

/// The layout of points in a text file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    decimal_comma: bool,
    columns: [usize; 3],
    /// Offset of the data, after byte order mark and header line.
    pub(super) start: u64,
    /// True if lines with a single integer give the number of following points, as in PTS.
    pub(super) counted: bool,
    /// The other columns that have a name, ascending, and their places.
    pub(super) others: Vec<(usize, Column)>,
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
        let line = line.trim_ascii();
        if is_blank(line) {
            return Row::Blank;
        }
        let last = self.columns[0].max(self.columns[1]).max(self.columns[2]);
        let mut point = [0.0; 3];
        let mut columns = 0;
        for (column, token) in self.tokens(line).take(last + 1).enumerate() {
            columns += 1;
            if let Some(axis) = self.columns.iter().position(|c| *c == column) {
                match number::parse(token, self.decimal_comma, decimals) {
                    Some(value) => point[axis] = value,
                    None => return Row::Wrong(format!("\"{}\"", shown(token))),
                }
            }
        }
        if columns <= last {
            return match count(line) {
                Some(count) if self.counted => Row::Count(count),
                _ => Row::Wrong(format!("{columns} columns in \"{}\"", shown(line))),
            };
        }
        Row::Point(point)
    }

    /// Appends the values of the wanted columns of a line; a word that is no number is NaN, or 0 if the type has
    /// none.
    pub(super) fn values(&self, line: &[u8], wanted: &Wanted, values: &mut Vec<u8>) {
        let mut words = self.tokens(line.trim_ascii()).enumerate();
        for number in &wanted.numbers {
            let (place, column) = &self.others[*number];
            let word = words.find(|(at, _)| at == place);
            let value = word.and_then(|(_, w)| number::parse(w, self.decimal_comma, &mut 0));
            column.scalar.put(value.unwrap_or(f64::NAN), values);
        }
    }

    fn tokens<'a>(&self, line: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let separator = self.separator;
        line.split(move |b| match separator {
            Separator::Space => matches!(b, b' ' | b'\t'),
            Separator::Comma => *b == b',',
            Separator::Semicolon => *b == b';',
        })
        .filter(move |t| separator != Separator::Space || !t.is_empty())
        .map(bare)
    }
}

/// A word without spaces and quotes around it.
fn bare(word: &[u8]) -> &[u8] {
    let word = word.trim_ascii();
    let inner = word.strip_prefix(b"\"").and_then(|t| t.strip_suffix(b"\""));
    inner.unwrap_or(word)
}

fn is_blank(line: &[u8]) -> bool {
    line.is_empty() || line.starts_with(b"#") || line.starts_with(b"//")
}

/// A shortened text for error messages.
fn shown(text: &[u8]) -> String {
    let cut = &text[..text.len().min(40)];
    let dots = if cut.len() < text.len() { "…" } else { "" };
    format!("{}{dots}", cut.escape_ascii())
}

fn count(line: &[u8]) -> Option<u64> {
    std::str::from_utf8(line).ok()?.parse().ok()
}

/// The lines of the head that are neither blank nor comments, each with its start and end offset.
pub(super) fn lines(head: &[u8], whole: bool) -> Vec<(usize, usize, &[u8])> {
    let mut found = Vec::new();
    let mut at = 0;
    for line in head.split(|b| matches!(b, b'\n' | b'\r')) {
        let end = at + line.len();
        // The last line is incomplete unless the head is the whole file.
        if (end < head.len() || whole) && !is_blank(line.trim_ascii()) {
            found.push((at, end, line.trim_ascii()));
        }
        at = end + 1;
        if found.len() > SAMPLE {
            break;
        }
    }
    found
}

/// Infers the layout; the error explains why this is not a text with points.
pub(super) fn guess(head: &[u8], whole: bool) -> Result<Dialect, String> {
    let mark = 3 * usize::from(head.starts_with(b"\xef\xbb\xbf"));
    let lines = lines(&head[mark..], whole);
    let Some(&(_, first_end, first)) = lines.first() else {
        if whole {
            return Err("no line with numbers".into());
        }
        let ends = head.iter().any(|b| matches!(b, b'\n' | b'\r'));
        let missing = if ends {
            "line with numbers"
        } else {
            "line end"
        };
        return Err(format!("no {missing} in the first {} bytes", head.len()));
    };
    let styles = [
        (Separator::Space, false),
        (Separator::Comma, false),
        (Separator::Semicolon, false),
        (Separator::Semicolon, true),
        (Separator::Space, true),
    ];
    for (separator, decimal_comma) in styles {
        let mut dialect = Dialect {
            separator,
            decimal_comma,
            columns: [0, 1, 2],
            start: mark as u64,
            counted: count(first).is_some(),
            others: Vec::new(),
        };
        if explains(&dialect, &lines) {
            dialect.others = dialect.commented_columns(&head[mark..], &lines);
            if dialect.counted && dialect.others.is_empty() {
                dialect.others = dialect.counted_columns(&lines);
            }
            return Ok(dialect);
        }
        // The first line may contain column names.
        if lines.len() > 1 && is_header(first) {
            dialect.start = (mark + first_end) as u64;
            dialect.columns = named_columns(first).unwrap_or([0, 1, 2]);
            dialect.counted = false;
            if explains(&dialect, &lines[1..]) {
                let (_, _, second) = lines[1];
                dialect.others = dialect.named_others(first, second);
                return Ok(dialect);
            }
        }
    }
    Err(format!(
        "text that is no list of points, \"{}\"",
        shown(first)
    ))
}

impl Dialect {
    /// The columns of PTS: an intensity, a colour, or both.
    fn counted_columns(&self, lines: &[(usize, usize, &[u8])]) -> Vec<(usize, Column)> {
        let mut widths = lines.iter().map(|(_, _, line)| self.tokens(line).count());
        let width = widths.find(|width| *width >= 3).unwrap_or(3);
        let intensity = matches!(width, 4 | 7).then(|| Column::new(INTENSITY, Scalar::F32));
        let color = COLORS.map(|name| Column::new(name, Scalar::U8));
        let color = color.into_iter().filter(|_| matches!(width, 6 | 7));
        (3..).zip(intensity.into_iter().chain(color)).collect()
    }

    /// The columns but the coordinates, named by the last comment above the points, as CloudCompare does, if the
    /// coordinates come first in it.
    fn commented_columns(
        &self,
        head: &[u8],
        lines: &[(usize, usize, &[u8])],
    ) -> Vec<(usize, Column)> {
        let first = lines.first().map_or(0, |(start, ..)| *start);
        let above = head[..first].split(|b| matches!(b, b'\n' | b'\r'));
        let last = above.map(<[u8]>::trim_ascii).rfind(|line| !line.is_empty());
        let names = last.and_then(|l| l.strip_prefix(b"//").or_else(|| l.strip_prefix(b"#")));
        let mut points = lines.iter().filter(|(.., line)| count(line).is_none());
        match (names, points.next()) {
            (Some(names), Some((.., line))) if named_columns(names) == Some([0, 1, 2]) => {
                self.named_others(names, line)
            }
            _ => Vec::new(),
        }
    }

    /// The columns with names but the coordinates, if a line has as many words as there are names.
    fn named_others(&self, header: &[u8], line: &[u8]) -> Vec<(usize, Column)> {
        let names: Vec<&[u8]> = words(header).collect();
        if names.len() != self.tokens(line).count() {
            return Vec::new();
        }
        let column = |name: &[u8]| {
            let name = String::from_utf8_lossy(name);
            Column::new(&name, Scalar::F64)
        };
        let columns = names.into_iter().map(column).enumerate();
        let others =
            columns.filter(|(at, column)| !self.columns.contains(at) && !column.name.is_empty());
        others.collect()
    }
}

/// True if the first data line is a point. Errors in later lines are reported when they are read.
fn explains(dialect: &Dialect, lines: &[(usize, usize, &[u8])]) -> bool {
    let mut decimals = 0;
    let mut points = 0;
    let mut wrong = 0;
    for (_, _, line) in lines.iter().take(SAMPLE) {
        match dialect.row(line, &mut decimals) {
            Row::Point(_) => points += 1,
            Row::Wrong(_) if points == 0 => return false,
            Row::Wrong(_) => wrong += 1,
            Row::Blank | Row::Count(_) => {}
        }
    }
    points > wrong
}

pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| matches!(b, b' ' | b'\t' | b',' | b';'))
        .map(bare)
        .filter(|w| !w.is_empty())
}

/// True for a line of column names: every word starts with a letter or a sign that no number starts with.
fn is_header(line: &[u8]) -> bool {
    let mut decimals = 0;
    words(line).all(|w| number::parse(w, false, &mut decimals).is_none())
}

/// The columns named x, y and z.
fn named_columns(header: &[u8]) -> Option<[usize; 3]> {
    let find = |name: &str| words(header).position(|w| w.eq_ignore_ascii_case(name.as_bytes()));
    Some([find("x")?, find("y")?, find("z")?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &str) -> Vec<[f64; 3]> {
        let dialect = guess(text.as_bytes(), true).unwrap();
        let mut decimals = 0;
        text.as_bytes()[dialect.start as usize..]
            .split(|b| matches!(b, b'\n' | b'\r'))
            .filter_map(|line| match dialect.row(line, &mut decimals) {
                Row::Point(p) => Some(p),
                Row::Wrong(why) => panic!("{why}"),
                Row::Blank | Row::Count(_) => None,
            })
            .collect()
    }

    #[test]
    fn reads_every_way_of_writing() {
        let want = [[1.5, 2.0, -3.25], [4.0, 5.0, 6.0]];
        for text in [
            "1.5 2 -3.25\n4 5 6\n",
            "1.5\t2\t-3.25\r\n4\t5\t6",
            "1.5,2,-3.25\r4,5,6\r",
            "1.5, 2, -3.25, 9\n4, 5, 6, 9\n",
            "1.5;2;-3.25\n4;5;6\n",
            "1,5;2;-3,25\n4;5;6\n",
            "1,5 2 -3,25\n4 5 6\n",
            "# note\n\nX Y Z\n1.5 2 -3.25\n4 5 6\n",
            "//X,Y,Z\n1.5,2,-3.25\n4,5,6\n",
            "\u{feff}1.5 2 -3.25\n4 5 6\n",
            "2\n1.5 2 -3.25 -100 1 2 3\n4 5 6 -100 1 2 3\n",
            "\"z\",\"x\",\"y\"\n-3.25,1.5,2\n6,4,5\n",
            "\"X\",\"Y\",\"Z\"\n1.5 2 -3.25\n4 5 6\n",
        ] {
            assert_eq!(points(text), want, "{text:?}");
        }
    }

    #[test]
    fn comments_name_columns() {
        let names = |text: &str| {
            let dialect = guess(text.as_bytes(), true).unwrap();
            let others = dialect.others.into_iter();
            others
                .map(|(at, column)| format!("{at} {}", column.name))
                .collect::<Vec<_>>()
        };
        let named = ["3 nx", "4 ny", "5 nz"];
        for text in [
            "//X Y Z Nx Ny Nz\n1 2 3 0 0 1\n",
            "//X Y Z Nx Ny Nz\n1\n1 2 3 0 0 1\n",
            "# scan\n\n# x,y,z,Nx,Ny,Nz\n1,2,3,0,0,1\n",
            "X Y Z Nx Ny Nz\n1 2 3 0 0 1\n",
        ] {
            assert_eq!(names(text), named, "{text:?}");
        }
        for text in [
            "//X Y Z Nx Ny\n1 2 3 0 0 1\n",
            "//Nx Ny Nz X Y Z\n1 2 3 0 0 1\n",
            "//X Y Z Nx Ny Nz\n# note\n1 2 3 0 0 1\n",
            "1 2 3 0 0 1\n",
        ] {
            assert_eq!(names(text), [""; 0], "{text:?}");
        }
    }

    #[test]
    fn refuses_what_is_no_list_of_points() {
        for text in [
            "",
            "# only a note\n",
            "some prose here\nand more\n",
            "1 2\n3 4\n",
        ] {
            assert!(guess(text.as_bytes(), true).is_err(), "{text:?}");
        }
    }
}
