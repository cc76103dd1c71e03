//! The cells of a line of text.

/// What is between the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    /// Spaces and tabs.
    Space,
    /// One tab; cells may be empty, or have spaces inside.
    Tab,
    /// Commas, with or without spaces.
    Comma,
    /// Semicolons, with or without spaces.
    Semicolon,
}

impl Separator {
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::Space => "separated by spaces or tabs",
            Self::Tab => "separated by tabs",
            Self::Comma => "separated by commas",
            Self::Semicolon => "separated by semicolons",
        }
    }

    /// True if a cell may be empty.
    pub(super) fn keeps_empty(self) -> bool {
        self != Self::Space
    }

    fn is(self, byte: u8) -> bool {
        match self {
            Self::Space => matches!(byte, b' ' | b'\t'),
            Self::Tab => byte == b'\t',
            Self::Comma => byte == b',',
            Self::Semicolon => byte == b';',
        }
    }

    /// The line without what is before and behind its cells. A tab there is the end of an empty cell.
    pub(super) fn trimmed(self, line: &[u8]) -> &[u8] {
        match self {
            Self::Tab => line,
            _ => line.trim_ascii(),
        }
    }

    /// The cells of a trimmed line none of which begins with a quote.
    pub(super) fn plain(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        line.split(move |b| match self {
            Self::Space => matches!(b, b' ' | b'\t'),
            Self::Tab => *b == b'\t',
            Self::Comma => *b == b',',
            Self::Semicolon => *b == b';',
        })
        .filter(move |t| self != Self::Space || !t.is_empty())
        .map(<[u8]>::trim_ascii)
    }

    /// The cells of a trimmed line, without quotes around them. A cell that begins with a quote ends behind the
    /// next one that is not doubled, whatever is between.
    pub(super) fn cells(self, line: &[u8]) -> Cells<'_> {
        Cells {
            separator: self,
            rest: Some(line),
        }
    }
}

/// The cells of a line.
pub(super) struct Cells<'a> {
    separator: Separator,
    /// What follows; none behind the last cell.
    rest: Option<&'a [u8]>,
}

impl<'a> Iterator for Cells<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let separator = self.separator;
        let mut rest = self.rest.take()?;
        if separator == Separator::Space {
            rest = rest.trim_ascii_start();
            if rest.is_empty() {
                return None;
            }
        }
        let blank = |b: &u8| b.is_ascii_whitespace() && !separator.is(*b);
        let begin = rest.iter().take_while(|b| blank(b)).count();
        let quoted = closing(&rest[begin..]).map_or(0, |end| begin + end);
        let end = rest[quoted..].iter().position(|b| separator.is(*b));
        let Some(end) = end.map(|end| quoted + end) else {
            return Some(bare(rest));
        };
        self.rest = Some(&rest[end + 1..]);
        Some(bare(&rest[..end]))
    }
}

/// Bytes up to the quote that closes the one at the beginning; none without either.
fn closing(text: &[u8]) -> Option<usize> {
    text.strip_prefix(b"\"")?;
    let mut at = 1;
    loop {
        at += text[at..].iter().position(|b| *b == b'"')? + 1;
        if text.get(at) != Some(&b'"') {
            return Some(at);
        }
        at += 1;
    }
}

/// A word without spaces and quotes around it.
fn bare(word: &[u8]) -> &[u8] {
    let word = word.trim_ascii();
    let inner = word.strip_prefix(b"\"").and_then(|t| t.strip_suffix(b"\""));
    inner.unwrap_or(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(separator: Separator, line: &str) -> Vec<String> {
        let line = separator.trimmed(line.as_bytes());
        let cells = separator.cells(line).map(String::from_utf8_lossy);
        cells.map(std::borrow::Cow::into_owned).collect()
    }

    #[test]
    fn quotes_hold_a_cell_together() {
        use Separator::{Comma, Semicolon, Space, Tab};
        for (separator, line, want) in [
            (Comma, "a, \"b, c\" ,d", &["a", "b, c", "d"][..]),
            (Comma, ",x,", &["", "x", ""]),
            (Comma, "\"a\"\",\"\"b\",c", &["a\"\",\"\"b", "c"]),
            (Comma, "\"a,b", &["\"a", "b"]),
            (Semicolon, "\"a;b\";c", &["a;b", "c"]),
            (Space, "  \"a b\"\t c  d ", &["a b", "c", "d"]),
            (Tab, "\ta b\t\"c\td\"\t", &["", "a b", "c\td", ""]),
            (Tab, " a \t b ", &["a", "b"]),
            (Space, "", &[]),
            (Comma, "\"\"", &[""]),
            (Comma, "\"", &["\""]),
        ] {
            assert_eq!(cells(separator, line), want, "{line:?}");
        }
    }

    #[test]
    fn lines_without_quotes_have_the_same_cells_either_way() {
        for line in ["1 2  3", "a,b,,c", "1;2; 3", "1\t\t2", " 1,2 3;4\t5 ", ""] {
            for separator in [
                Separator::Space,
                Separator::Tab,
                Separator::Comma,
                Separator::Semicolon,
            ] {
                let line = separator.trimmed(line.as_bytes());
                let plain: Vec<&[u8]> = separator.plain(line).collect();
                let cells: Vec<&[u8]> = separator.cells(line).collect();
                assert_eq!(plain, cells, "{line:?} {separator:?}");
            }
        }
    }
}
