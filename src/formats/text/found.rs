//! Which columns of a text are what.

use super::names::{Axes, usual};
use super::sample::{Table, shown};
use outcrop_ply::Scalar;
use outcrop_points::TextColumns;
use outcrop_points::columns::{COLORS, Column, INTENSITY};
use std::ops::Range;

/// The columns that are read.
pub(super) struct Found {
    /// Those of the coordinates.
    pub(super) columns: [usize; 3],
    /// The others with a name, ascending.
    pub(super) others: Vec<(usize, Column)>,
    /// What was taken, in words.
    pub(super) taken: String,
    /// True if the file does not say so plainly.
    pub(super) guessed: bool,
}

/// Names that do not suit the columns.
pub(super) struct Mismatch {
    pub(super) why: String,
    /// True if a comment may say something else.
    pub(super) is_prose: bool,
}

/// What is known of a file without names.
pub(super) struct Hint {
    /// Lines count the points.
    pub(super) counted: bool,
    /// It is PTS: an intensity, a colour, or both follow the coordinates.
    pub(super) pts: bool,
    /// Its name says that it has colours, from 0 to 1.
    pub(super) floats: bool,
}

/// The largest value of 8 bits, and of 16.
const BYTE: f64 = 255.0;
const WORD: f64 = 65535.0;

/// Most columns of which a message says which are not read.
const MOST_READ: usize = 100;

/// Most names in a message.
const LISTED: usize = 40;

/// The names of columns, for messages.
pub(super) fn listed(names: &[String]) -> String {
    let quoted = |name: &String| format!("\"{}\"", shown(name.as_bytes()));
    let some: Vec<String> = names.iter().take(LISTED).map(quoted).collect();
    let more = if names.len() > LISTED { ", …" } else { "" };
    format!("{}{more}", some.join(", "))
}

impl Found {
    /// The columns that the caller names.
    pub(super) fn given(given: &TextColumns, table: &Table<'_>) -> Self {
        let names = given.names();
        let axes = given.axes();
        let others = others(names, axes, 0, table);
        let doubt = (names.len() > table.width).then(|| {
            let (named, width) = (names.len(), table.width);
            format!("{named} columns are named, lines have {width}")
        });
        let shown = axes.map(|at| names.get(at).cloned().unwrap_or_default());
        Self::of(axes, others, &shown, doubt.is_some(), doubt, table)
    }

    /// The columns by their names.
    pub(super) fn named(
        names: &[String],
        axes: &Axes,
        table: &Table<'_>,
    ) -> Result<Self, Mismatch> {
        let width = table.width;
        let first = axes.places.iter().all(|at| *at < 3);
        let numeric = |shift: usize| axes.places.iter().all(|at| table.is_numeric(at + shift));
        let open = names.last().is_some_and(|name| name.contains("[]"));
        let fits = names.len() == width || open && names.len() <= width;
        let mut doubt = axes.doubt.clone();
        let mut shift = 0;
        if !fits {
            let unnamed = names.len() + 1 == width;
            let (index, words) = (is_index(table), table.has_words(width.max(1) - 1));
            let fewer = names.len() < width && first && numeric(0);
            let cut = names.len() > width && table.separator.keeps_empty() && numeric(0);
            doubt = Some(if unnamed && index && !words && numeric(1) {
                shift = 1;
                "column 1 counts the lines and has no name".to_owned()
            } else if unnamed && words && numeric(0) {
                format!("column {width} has no name")
            } else if fewer || cut {
                format!("{} columns have names, lines have {width}", names.len())
            } else {
                let together = axes.places.windows(2).all(|pair| pair[0] + 1 == pair[1]);
                let (count, list) = (names.len(), listed(names));
                return Err(Mismatch {
                    why: format!("{count} names for lines of {width} columns, {list}"),
                    is_prose: !axes.plain || !together || count > width,
                });
            });
        }
        let place = axes.places.map(|at| at + shift);
        let others = others(names, axes.places, shift, table);
        let shown = axes.places.map(|at| names[at].clone());
        let plain = axes.plain && place == [0, 1, 2] && doubt.is_none();
        Ok(Self::of(place, others, &shown, !plain, doubt, table))
    }

    /// The columns by the look of their numbers.
    ///
    /// # Errors
    /// A description of columns the first of which is likely to be no coordinate.
    pub(super) fn unnamed(table: &Table<'_>, hint: &Hint) -> Result<Self, String> {
        let width = table.width;
        if width > 3 && is_numbered(table) {
            let line = table.rows[0].iter().map(|cell| shown(cell));
            let line: Vec<String> = line.take(LISTED).collect();
            return Err(format!(
                "{width} columns without names, the first of which seems to number the points, \"{}\"",
                line.join(" ")
            ));
        }
        let colors = |at: usize| {
            table
                .most(at..at + 3)
                .is_some_and(|most| (2.0..=BYTE).contains(&most))
        };
        let opaque = || {
            table.most(6..7) == Some(BYTE) && table.cells(6).all(|c| table.number(c) == Some(BYTE))
        };
        let color_at = match width {
            0..6 => None,
            6 if hint.counted => Some(3),
            7 if hint.counted && (colors(4) || !colors(3)) => Some(4),
            7 if hint.pts && colors(4) => Some(4),
            6 if hint.floats && table.in_unit(3..6) => Some(3),
            7.. if colors(3) && colors(4) => opaque().then_some(3),
            _ if colors(3) => Some(3),
            7 if colors(4) => Some(4),
            _ => None,
        };
        let intensity = color_at == Some(4) || width == 4 && hint.pts;
        let mut others: Vec<(usize, Column)> = Vec::new();
        others.extend(intensity.then(|| (3, Column::new(INTENSITY, Scalar::F32))));
        if let Some(at) = color_at {
            let scalar = color_scalar(table, [at, at + 1, at + 2]);
            others.extend((at..).zip(COLORS.map(|name| Column::new(name, scalar))));
        }
        let taken = 3 + others.len();
        let plain = width == 3 || hint.counted && (width != 6 || colors(3));
        let guessed = taken != width || !plain;
        let names = [String::new(), String::new(), String::new()];
        Ok(Self::of([0, 1, 2], others, &names, guessed, None, table))
    }

    fn of(
        columns: [usize; 3],
        others: Vec<(usize, Column)>,
        names: &[String; 3],
        guessed: bool,
        doubt: Option<String>,
        table: &Table<'_>,
    ) -> Self {
        let mut parts = vec![format!("x y z from {}{}", places(&columns), quoted(names))];
        let place = |name: &str| others.iter().find(|(_, c)| c.name == name);
        if let [Some(red), Some(green), Some(blue)] = COLORS.map(place) {
            let at = [red.0, green.0, blue.0];
            let scale = match red.1.scalar {
                Scalar::U8 => "8 bits",
                Scalar::U16 => "16 bits",
                _ if at.iter().all(|at| table.in_unit(*at..at + 1)) => "0 to 1",
                _ => "as numbers",
            };
            parts.push(format!("colours {scale} from {}", places(&at)));
        }
        if let Some((at, _)) = place(INTENSITY) {
            parts.push(format!("intensity from {}", places(&[*at])));
        }
        let read = |at: &usize| columns.contains(at) || others.iter().any(|(place, _)| place == at);
        if table.width > MOST_READ {
            parts.push(format!("lines have {} columns", table.width));
        } else {
            let unread: Vec<usize> = (0..table.width).filter(|at| !read(at)).collect();
            parts.extend((!unread.is_empty()).then(|| format!("{} not read", places(&unread))));
        }
        parts.extend(table.decimal_comma().then(|| "decimal commas".to_owned()));
        parts.extend(doubt);
        Self {
            columns,
            others,
            taken: parts.join("; "),
            guessed,
        }
    }
}

/// The other columns with names, `shift` columns behind their names.
fn others(
    names: &[String],
    axes: [usize; 3],
    shift: usize,
    table: &Table<'_>,
) -> Vec<(usize, Column)> {
    let named = names.iter().map(|name| usual(name)).enumerate();
    let other = named.filter(|(at, name)| !axes.contains(at) && !name.is_empty());
    let mut others: Vec<(usize, Column)> = other
        .map(|(at, name)| {
            (
                at + shift,
                Column {
                    name,
                    scalar: Scalar::F64,
                },
            )
        })
        .collect();
    let place = |name: &str| others.iter().position(|(_, c)| c.name == name);
    if let [Some(red), Some(green), Some(blue)] = COLORS.map(place) {
        let scalar = color_scalar(table, [red, green, blue].map(|of| others[of].0));
        for of in [red, green, blue] {
            others[of].1.scalar = scalar;
        }
    }
    others
}

/// The type of colours in these columns.
fn color_scalar(table: &Table<'_>, columns: [usize; 3]) -> Scalar {
    let most = columns.map(|at| table.most(at..at + 1));
    match most
        .iter()
        .try_fold(0.0, |all: f64, most| Some(all.max((*most)?)))
    {
        Some(most) if most <= BYTE => Scalar::U8,
        Some(most) if most <= WORD => Scalar::U16,
        _ => Scalar::F64,
    }
}

/// True if the first column is that of row names, as statistics programs write them: it counts the lines.
fn is_index(table: &Table<'_>) -> bool {
    table.counts(0) || table.has_words(0)
}

/// True if lines look like a number of a point, its coordinates, and perhaps a description.
fn is_numbered(table: &Table<'_>) -> bool {
    let words = (0..table.width).any(|at| table.has_words(at));
    let fraction = |cell: &[u8]| table.number(cell).is_some_and(|v| v.fract() != 0.0);
    let coordinate = |at: usize| table.is_numeric(at) && table.cells(at).any(fraction);
    table.is_whole(0)
        && (1..4).all(coordinate)
        && (words || table.rows.len() > 2 && table.counts(0))
}

/// `columns 4–6`, with the first as 1.
fn places(columns: &[usize]) -> String {
    let together = columns.windows(2).all(|pair| pair[0] + 1 == pair[1]);
    match columns {
        [one] => format!("column {}", one + 1),
        [first, .., last] if together => format!("columns {}", range(*first..last + 1)),
        _ => {
            let numbers: Vec<String> = columns.iter().map(|at| (at + 1).to_string()).collect();
            format!("columns {}", numbers.join(", "))
        }
    }
}

fn range(columns: Range<usize>) -> String {
    match columns.len() {
        1 => columns.end.to_string(),
        _ => format!("{}–{}", columns.start + 1, columns.end),
    }
}

/// ` "X Y Z"`, or each name for itself if there are spaces in one; nothing without names.
fn quoted(names: &[String; 3]) -> String {
    if names.iter().all(String::is_empty) {
        return String::new();
    }
    let names = names.each_ref().map(|name| shown(name.as_bytes()));
    match names.iter().any(|name| name.contains(' ')) {
        true => format!(" \"{}\"", names.join("\", \"")),
        false => format!(" \"{}\"", names.join(" ")),
    }
}
