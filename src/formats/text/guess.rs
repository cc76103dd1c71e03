//! The layout of a text, inferred from its first lines.

use super::super::point_format::{Head, Refusal, has_extension};
use super::cells::Separator;
use super::dialect::{Dialect, Row};
use super::found::{Found, Hint};
use super::names;
use super::sample::{self, Line, Table, comments, count, lines, shown};
#[cfg(test)]
use outcrop_points::Layout;

/// The ways of writing, in the order in which they are tried; true for decimal commas.
const STYLES: [(Separator, bool); 8] = [
    (Separator::Tab, false),
    // Before spaces, which words between tabs may have inside.
    (Separator::Tab, true),
    (Separator::Space, false),
    (Separator::Comma, false),
    (Separator::Semicolon, false),
    (Separator::Semicolon, true),
    (Separator::Space, true),
    // Numbers in quotes.
    (Separator::Comma, true),
];

/// Number of lines that must be points for the most part.
const EXPLAINED: usize = 50;

/// Infers the layout; the error explains why this is not a text with points.
pub(super) fn guess(head: &Head) -> Result<Dialect, Refusal> {
    let start = start(head)?;
    let text = &head.bytes[start..];
    let lines = lines(text, head.whole);
    let Some(&(_, _, first)) = lines.first() else {
        return Err(Refusal::Unknown(no_line(head)));
    };
    let mut refused: Option<(Separator, String)> = None;
    for (separator, decimal_comma) in STYLES {
        // Other decimals may explain what the same separator did not, but no other separator.
        if refused.as_ref().is_some_and(|(of, _)| *of != separator) {
            continue;
        }
        let style = Style {
            head,
            text,
            lines: &lines,
            separator,
            decimal_comma,
        };
        match style.dialect(start as u64) {
            Ok(Some(dialect)) => return Ok(dialect),
            Ok(None) => {}
            Err(why) => refused = refused.or(Some((separator, why))),
        }
    }
    Err(match refused {
        Some((_, why)) => Refusal::Columns(why),
        None => Refusal::Unknown(format!(
            "text that is no list of points, \"{}\"",
            shown(first.trim_ascii())
        )),
    })
}

/// Bytes of the byte order mark and of the lines that are passed over.
fn start(head: &Head) -> Result<usize, Refusal> {
    let mark = 3 * usize::from(head.bytes.starts_with(b"\xef\xbb\xbf"));
    // Spreadsheets tell their separator in a line before the names.
    let told = u64::from(head.bytes[mark..].starts_with(b"sep="));
    let skip = head.layout.skip_lines.max(told);
    let after = sample::after_lines(&head.bytes[mark..], skip);
    let short = || Refusal::Unknown(format!("fewer than {skip} lines to pass over"));
    after.map(|after| mark + after).ok_or_else(short)
}

fn no_line(head: &Head) -> String {
    if head.whole {
        return "no line with numbers".into();
    }
    let ends = head.bytes.iter().any(|b| matches!(b, b'\n' | b'\r'));
    let missing = if ends {
        "line with numbers"
    } else {
        "line end"
    };
    format!("no {missing} in the first {} bytes", head.bytes.len())
}

/// The first lines, in one way of writing.
struct Style<'a> {
    head: &'a Head,
    text: &'a [u8],
    lines: &'a [Line<'a>],
    separator: Separator,
    decimal_comma: bool,
}

impl<'a> Style<'a> {
    /// The layout, if the lines are written in this way. The error is that of lines which are, but whose columns
    /// cannot be told.
    fn dialect(&self, before: u64) -> Result<Option<Dialect>, String> {
        let header = self.header();
        let data = &self.lines[usize::from(header.is_some())..];
        let counted = header.is_none() && data.first().is_some_and(|l| count(l.2).is_some());
        let points = data.iter().map(|(.., line)| *line);
        let points: Vec<&[u8]> = points.filter(|l| !counted || count(l).is_none()).collect();
        let table = Table::of(&points, self.separator, self.decimal_comma);
        let other = Table::of(&points, self.separator, true);
        if !self.is_plausible(&table, &points) || !self.decimal_comma && other.needs_commas(&table)
        {
            return Ok(None);
        }
        let Found {
            columns,
            others,
            taken,
            guessed,
        } = self.columns(header, &table, counted)?;
        let dialect = Dialect {
            separator: self.separator,
            decimal_comma: self.decimal_comma,
            columns,
            start: before + header.map_or(0, |_| self.lines[0].1 as u64),
            counted,
            others,
            taken,
            guessed,
        };
        if explains(&dialect, data) {
            return Ok(Some(dialect));
        }
        match &self.head.layout.columns {
            Some(given) => Err(format!(
                "{} columns in \"{}\", and no numbers where the given {given} has x, y and z",
                table.rows[0].len(),
                shown(points[0].trim_ascii()),
            )),
            None => Ok(None),
        }
    }

    /// The first line, if it has words only, which may be names.
    fn header(&self) -> Option<&'a [u8]> {
        let (.., first) = *self.lines.first().filter(|_| self.lines.len() > 1)?;
        let table = Table::of(&[first], self.separator, self.decimal_comma);
        let cells = table.rows.first()?;
        let no_number = cells.iter().all(|cell| table.number(cell).is_none());
        let named = || names::axes(&names_of(first, self.separator)).is_some();
        (!cells.is_empty() && (no_number || named())).then_some(first)
    }

    /// True if the first line has three numbers, and with tabs if all lines have some.
    fn is_plausible(&self, table: &Table<'_>, points: &[&[u8]]) -> bool {
        let numbers = |row: &Vec<&[u8]>| row.iter().filter(|c| table.number(c).is_some()).count();
        let tabs = || points.iter().all(|line| line.contains(&b'\t'));
        table.rows.first().is_some_and(|row| numbers(row) >= 3)
            && (self.separator != Separator::Tab || tabs())
    }

    /// The columns: those that the caller gives, the first line names, or a comment above the points; else by
    /// the look of the numbers.
    fn columns(
        &self,
        header: Option<&[u8]>,
        table: &Table<'_>,
        counted: bool,
    ) -> Result<Found, String> {
        if let Some(given) = &self.head.layout.columns {
            return Ok(Found::given(given, table));
        }
        let mut refused = None;
        let header = header.filter(|line| line.iter().any(|b| b.is_ascii_alphabetic() || *b > 127));
        if let Some(line) = header {
            match self.named(line, table, false) {
                Named::Found(found) => return Ok(found),
                Named::Mismatch(why) => return Err(why),
                Named::Unknown => {}
            }
        }
        for comment in comments(&self.text[..self.first_point(counted)]).take(MOST_COMMENTS) {
            match self.named(comment, table, true) {
                Named::Found(found) => return Ok(found),
                Named::Mismatch(why) => refused = refused.or(Some(why)),
                Named::Unknown => {}
            }
        }
        if let Some(why) = refused {
            return Err(why);
        }
        if let Some(line) = header {
            let names = named(line, self.separator);
            return Err(format!("{names}, which are not called x, y and z"));
        }
        Found::unnamed(table, &self.hint(counted))
    }

    fn hint(&self, counted: bool) -> Hint {
        let named = |extension| has_extension(&self.head.path, &[extension]);
        Hint {
            counted,
            pts: counted || named("pts"),
            floats: named("xyzrgb"),
        }
    }

    /// Offset of the first line that is neither a comment nor a count.
    fn first_point(&self, counted: bool) -> usize {
        let mut lines = self.lines.iter();
        let first = lines.find(|(.., line)| !counted || count(line).is_none());
        first.map_or(0, |(start, ..)| *start)
    }

    /// The columns by the names in a line, which may be separated in another way than the numbers.
    fn named(&self, line: &[u8], table: &Table<'_>, comment: bool) -> Named {
        let ways = [
            self.separator,
            Separator::Tab,
            Separator::Comma,
            Separator::Semicolon,
        ];
        let ways = ways.into_iter().filter(|way| *way != Separator::Space);
        let mut refused = None;
        let mut split = false;
        for way in ways.chain([Separator::Space]) {
            let names = names_of(line, way);
            // What other separators part is no list with spaces between.
            if split && way == Separator::Space {
                break;
            }
            split |= names.len() >= 3;
            let Some(axes) = names::axes(&names) else {
                continue;
            };
            match Found::named(&names, &axes, table) {
                Ok(found) => return Named::Found(found),
                Err(wrong) if comment && wrong.is_prose => {}
                Err(wrong) => refused = refused.or(Some(wrong.why)),
            }
        }
        refused.map_or(Named::Unknown, Named::Mismatch)
    }
}

/// The outcome of names.
enum Named {
    Found(Found),
    /// There are coordinates among them, but not for these columns.
    Mismatch(String),
    Unknown,
}

/// The names in a line, without empty ones at its end. One with `[]` stands for the rest of a line.
fn names_of(line: &[u8], separator: Separator) -> Vec<String> {
    let sign = |b: &u8| matches!(b, b'#' | b'/' | b'%');
    let from = line.iter().position(|b| !sign(b)).unwrap_or(line.len());
    let cells = separator.cells(separator.trimmed(&line[from..]));
    let mut names: Vec<String> = Vec::new();
    for cell in cells.take(MOST_NAMES) {
        let name = String::from_utf8_lossy(cell).into_owned();
        let rest = name.contains("[]");
        names.push(name);
        if rest {
            break;
        }
    }
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    names
}

/// Most columns that are named.
const MOST_NAMES: usize = 1024;

/// Most comments above the points that are looked at.
const MOST_COMMENTS: usize = 50;

/// The names in a line, for a message.
fn named(line: &[u8], separator: Separator) -> String {
    let others = [
        Separator::Tab,
        Separator::Comma,
        Separator::Semicolon,
        Separator::Space,
    ];
    let own = names_of(line, separator);
    let ways = others.map(|way| names_of(line, way));
    let many = |names: &Vec<String>| names.len() >= 3;
    let names = [own.clone()].into_iter().chain(ways).find(many);
    super::found::listed(&names.unwrap_or(own))
}

/// True if the first data line is a point. Errors in later lines are reported when they are read.
fn explains(dialect: &Dialect, lines: &[Line<'_>]) -> bool {
    let mut decimals = 0;
    let mut points = 0;
    let mut wrong = 0;
    for (.., line) in lines.iter().take(EXPLAINED) {
        match dialect.row(line, &mut decimals) {
            Row::Point(_) => points += 1,
            Row::Wrong(_) if points == 0 => return false,
            Row::Wrong(_) => wrong += 1,
            Row::Blank | Row::Count(_) => {}
        }
    }
    points > wrong
}

/// The head of a text of this name, for tests.
#[cfg(test)]
pub(super) fn head(name: &str, text: &str, layout: Layout) -> Head {
    Head {
        path: name.into(),
        bytes: text.into(),
        whole: true,
        layout,
    }
}

#[cfg(test)]
mod tests;
