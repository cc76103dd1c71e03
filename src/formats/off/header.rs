//! The first lines of OFF: a word that says what a vertex has, and the numbers of vertices, faces and edges.

use super::super::lines::is_end;
use super::super::point_format::Refusal;
use outcrop_ply::Scalar;
use outcrop_points::columns::{COLORS, Column};
use outcrop_points::number;

/// What the first lines say.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) vertices: u64,
    /// Offset of the lines behind them.
    pub(super) start: u64,
    /// What a vertex has behind its coordinates.
    pub(super) columns: Vec<Column>,
    /// What was guessed.
    pub(super) taken: Option<String>,
}

/// Lines of vertices that decide the type of colours.
const SAMPLE: usize = 200;

/// True for a line without a vertex.
pub(super) fn is_comment(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.is_empty() || line.starts_with(b"#")
}

/// The words of a line, before a comment.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = line.split(u8::is_ascii_whitespace);
    let words = words.filter(|word| !word.is_empty());
    words.take_while(|word| !word.starts_with(b"#"))
}

/// The lines of a text that are no comments, each with the offset of its end.
fn lines(text: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let mut at = 0;
    let lines = text.split(|b| is_end(*b)).map(move |line| {
        at += line.len() + 1;
        ((at - 1).min(text.len()), line)
    });
    lines.filter(|(_, line)| !is_comment(line))
}

fn mark(head: &[u8]) -> usize {
    3 * usize::from(head.starts_with(b"\xef\xbb\xbf"))
}

/// The letters before `OFF` in the first word, in any case.
fn letters(head: &[u8]) -> Option<&[u8]> {
    let (_, line) = lines(&head[mark(head)..]).next()?;
    let word = words(line).next()?;
    let (before, off) = word.split_at(word.len().checked_sub(3)?);
    let known = before.iter().all(|b| b"STCNstcn4".contains(b));
    (off.eq_ignore_ascii_case(b"OFF") && known).then_some(before)
}

/// True for OFF that is read.
pub(super) fn recognize(head: &[u8]) -> Result<bool, Refusal> {
    let Some(letters) = letters(head) else {
        return Ok(false);
    };
    let first = lines(&head[mark(head)..]).next();
    let mut more = first
        .map(|(_, line)| words(line).skip(1))
        .into_iter()
        .flatten();
    if more.any(|word| word.eq_ignore_ascii_case(b"BINARY")) {
        return Err(Refusal::Foreign("binary OFF"));
    }
    if letters.contains(&b'4') || letters.contains(&b'n') {
        return Err(Refusal::Foreign("OFF with other than three coordinates"));
    }
    Ok(true)
}

/// The header of a file of which this is the beginning; the error says what was found and expected.
pub(super) fn header(head: &[u8], whole: bool) -> Result<Header, (String, &'static str)> {
    const COUNTS: &str = "the numbers of vertices, faces and edges";
    let mark = mark(head);
    let text = &head[mark..];
    let has = |letter: u8| letters(head).is_some_and(|l| l.contains(&letter));
    let mut lines = lines(text);
    let (mut end, first) = lines.next().unwrap_or_default();
    let mut counts: Vec<&[u8]> = words(first).skip(1).collect();
    if counts.is_empty() {
        let (after, line) = lines.next().unwrap_or((text.len(), &[]));
        end = after;
        counts = words(line).collect();
    }
    let number = counts
        .first()
        .and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
    let Some(vertices) = number.filter(|_| counts.len() >= 2) else {
        let shown = counts.join(&b' ');
        let shown = format!("\"{}\"", shown[..shown.len().min(60)].escape_ascii());
        return Err((shown, COUNTS));
    };
    let start = (end + 1).min(text.len());
    let count = usize::try_from(vertices).unwrap_or(usize::MAX).min(SAMPLE);
    let mut rows: Vec<Vec<&[u8]>> = lines
        .take(count)
        .map(|(_, line)| words(line).collect())
        .collect();
    // The last line may be cut off.
    if !whole && rows.len() < count {
        rows.pop();
    }
    let mut columns = Vec::new();
    if has(b'N') {
        let normal = ["nx", "ny", "nz"].map(|name| Column::new(name, Scalar::F64));
        columns.extend(normal);
    }
    let most = bytes(&rows, 3 + columns.len());
    let lone = columns.is_empty() && matches!(width(&rows), 6 | 7) && most.is_some_and(|m| m > 1.0);
    let guessed = lone && !has(b'C');
    if has(b'C') || guessed {
        let scalar = if most.is_some() {
            Scalar::U8
        } else {
            Scalar::F64
        };
        columns.extend(COLORS.map(|name| Column::new(name, scalar)));
    }
    Ok(Header {
        vertices,
        start: (mark + start) as u64,
        columns,
        taken: guessed.then(|| "colours 8 bits from columns 4–6 of the vertices".to_owned()),
    })
}

/// Words of the shortest line.
fn width(rows: &[Vec<&[u8]>]) -> usize {
    rows.iter().map(Vec::len).min().unwrap_or(0)
}

/// The largest of three numbers of all rows, if they are whole and of 8 bits.
fn bytes(rows: &[Vec<&[u8]>], at: usize) -> Option<f64> {
    let mut most = None;
    for row in rows {
        for word in row.get(at..at + 3)? {
            let value = number::parse(word, false, &mut 0)?;
            let byte =
                value.fract() == 0.0 && (0.0..=255.0).contains(&value) && !word.contains(&b'.');
            most = Some(f64::max(most.unwrap_or(0.0), value)).filter(|_| byte);
            most?;
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_read() {
        let names = |text: &str| {
            let header = header(text.as_bytes(), true).unwrap();
            let names = header.columns.iter().map(|c| c.name.clone());
            (
                header.vertices,
                header.start,
                names.collect::<Vec<_>>().join(" "),
            )
        };
        for (text, vertices, start, columns) in [
            ("OFF\n2 0 0\n1 2 3\n", 2, 10, ""),
            ("OFF 2 0 0\n1 2 3\n", 2, 10, ""),
            (
                "# a\n\nCOFF # b\n# c\n1 0 0 # d\n1 2 3 255 0 7 9\n",
                1,
                28,
                "red green blue",
            ),
            (
                "CNOFF\r\n1 0 0\r\n1 2 3 0 0 1 9 9 9\r\n",
                1,
                13,
                "nx ny nz red green blue",
            ),
            ("OFF\n1 0 0\n1 2 3 255 7 0\n", 1, 10, "red green blue"),
            ("OFF\n1 0 0\n1 2 3 0.5 7 0\n", 1, 10, ""),
        ] {
            assert_eq!(
                names(text),
                (vertices, start, columns.to_owned()),
                "{text:?}"
            );
        }
        for text in ["OFF\n", "OFF\n2\n", "OFF\na b c\n", "OFF -1 0 0\n"] {
            assert!(header(text.as_bytes(), true).is_err(), "{text:?}");
        }
        for (text, read) in [
            ("off\n1 0 0\n", Ok(true)),
            ("OFFSET 1 2\n", Ok(false)),
            ("1 2 3\n", Ok(false)),
            ("OFF BINARY\n", Err(Refusal::Foreign("binary OFF"))),
        ] {
            assert_eq!(recognize(text.as_bytes()), read, "{text:?}");
        }
        assert!(recognize(b"4OFF\n1 0 0\n").is_err());
    }
}
