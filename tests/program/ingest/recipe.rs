//! Texts of points written in every way, and a plain reading of them: which columns are x, y and z follows from the
//! table that was written, not from the text. The fuzz target of the dialects has the same.

/// What is in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    X,
    Y,
    Z,
    /// The number of the line.
    Id,
    Red,
    Green,
    Blue,
    Intensity,
    Word,
}

use Kind::{Blue, Green, Id, Intensity, Red, Word, X, Y, Z};

const OTHERS: [Kind; 6] = [Id, Red, Green, Blue, Intensity, Word];

/// Names of the coordinates; the last are unknown.
const FAMILIES: [[&str; 3]; 7] = [
    ["X", "Y", "Z"],
    ["x [m]", "y [m]", "z [m]"],
    ["Points:0", "Points:1", "Points:2"],
    ["Easting", "Northing", "Height (m)"],
    ["E", "N", "H"],
    ["X coordinate", "Y coordinate", "Elevation"],
    ["alpha", "beta", "gamma"],
];

const SEPARATORS: [&str; 8] = [" ", "  ", "\t", ",", ", ", ";", "; ", " ,"];

/// Where names are: nowhere, in a line, or in a comment.
const HEADERS: [Option<&str>; 6] = [
    None,
    Some(""),
    Some("# "),
    Some("//"),
    Some("% "),
    Some("#"),
];

/// A text with points.
#[derive(Debug, Clone)]
pub struct Recipe {
    columns: Vec<Kind>,
    family: [&'static str; 3],
    separator: &'static str,
    /// Decimal commas.
    commas: bool,
    /// Quotes around names, and around all cells.
    quotes: [bool; 2],
    header: Option<&'static str>,
    line_end: &'static str,
    mark: bool,
    counted: bool,
    /// Names: 1 without the first, 2 without the last, 3 with one more.
    missing: u8,
    /// Coordinates in thousandths.
    points: Vec<[i64; 3]>,
}

impl Recipe {
    /// The text that bytes stand for; none if there are too few.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let (head, rest) = bytes.split_at_checked(12)?;
        let at = |place: usize, count: usize| usize::from(head[place]) % count;
        let mut columns = vec![X, Y, Z];
        columns.extend(
            OTHERS
                .iter()
                .enumerate()
                .filter(|(bit, _)| head[0] >> bit & 1 == 1)
                .map(|o| *o.1),
        );
        let turn = at(1, columns.len());
        match head[1] >> 5 {
            0..3 => {}
            3..6 => columns.rotate_right(turn),
            6 => columns.reverse(),
            _ => columns.swap(0, turn),
        }
        let separator = SEPARATORS[at(2, SEPARATORS.len())];
        let quotes = [[false, false], [true, false], [true, true]][at(3, 3)];
        let header = HEADERS[at(4, HEADERS.len())];
        let commas = head[5] % 3 == 0 && (!separator.contains(',') || quotes[1]);
        let points = rest.chunks_exact(3).take(30).map(|chunk| {
            // Every coordinate has a fraction.
            [0, 1, 2].map(|axis| i64::from(chunk[axis]) * 398 - 9001)
        });
        let points: Vec<[i64; 3]> = points.collect();
        (points.len() >= 2).then_some(Self {
            columns,
            family: FAMILIES[at(6, FAMILIES.len())],
            separator,
            commas,
            quotes,
            header,
            line_end: ["\n", "\r\n", "\r"][at(7, 3)],
            mark: head[8] % 4 == 0,
            counted: header != Some("") && head[9] % 4 == 0,
            missing: [0, 0, 0, 1, 2, 3][at(10, 6)],
            points,
        })
    }

    fn is_spaced(&self) -> bool {
        self.separator.trim_matches(' ').is_empty()
    }

    /// A cell as it would be with decimal points.
    fn plain(&self, row: usize, kind: Kind) -> String {
        let number = |at: usize| {
            let value = self.points[row][at];
            let sign = if value < 0 { "-" } else { "" };
            format!("{sign}{}.{:03}", value.abs() / 1000, value.abs() % 1000)
        };
        match kind {
            X => number(0),
            Y => number(1),
            Z => number(2),
            Id => (row + 1).to_string(),
            Red => (100 + 2 * row).to_string(),
            Green => (7 + 3 * row).to_string(),
            Blue => (255 - 3 * row).to_string(),
            Intensity => (1000 + 7 * row).to_string(),
            Word if self.is_spaced() && !self.quotes[1] => "tree".to_owned(),
            Word => "big tree".to_owned(),
        }
    }

    fn name(&self, kind: Kind) -> &'static str {
        match kind {
            X => self.family[0],
            Y => self.family[1],
            Z => self.family[2],
            Id => "Point ID",
            Red => "R",
            Green => "G",
            Blue => "B",
            Intensity => "Intensity",
            Word => "Code",
        }
    }

    /// The names, each with its column.
    fn names(&self) -> Vec<(&'static str, Option<Kind>)> {
        let mut names: Vec<_> = self
            .columns
            .iter()
            .map(|kind| (self.name(*kind), Some(*kind)))
            .collect();
        match self.missing {
            1 => drop(names.remove(0)),
            2 => drop(names.pop()),
            3 => names.push(("Extra", None)),
            _ => {}
        }
        names
    }

    /// The text.
    pub fn text(&self) -> String {
        let cell = |text: String, quoted: bool| {
            let needed = self.is_spaced() && text.contains(' ');
            if quoted || needed {
                format!("\"{text}\"")
            } else {
                text
            }
        };
        let mut lines = Vec::new();
        if let Some(sign) = self.header {
            let names = self.names().into_iter();
            let names = names.map(|(name, _)| cell(name.to_owned(), self.quotes[0]));
            let names: Vec<String> = names.collect();
            lines.push(format!("{sign}{}", names.join(self.separator)));
        }
        if self.counted {
            lines.push(self.points.len().to_string());
        }
        for row in 0..self.points.len() {
            let cells = self.columns.iter().map(|kind| {
                let plain = self.plain(row, *kind);
                let text = if self.commas {
                    plain.replace('.', ",")
                } else {
                    plain
                };
                cell(text, self.quotes[1])
            });
            lines.push(cells.collect::<Vec<_>>().join(self.separator));
        }
        let mark = if self.mark { "\u{feff}" } else { "" };
        format!("{mark}{}{}", lines.join(self.line_end), self.line_end)
    }

    /// True if no line has a word in the column.
    fn is_number(&self, column: usize) -> bool {
        self.columns.get(column).is_some_and(|kind| *kind != Word)
    }

    /// The columns of x, y and z; none if they cannot be told.
    fn columns(&self) -> Option<[usize; 3]> {
        let width = self.columns.len();
        let names = self.names();
        let place = |kind| names.iter().position(|name| name.1 == Some(kind));
        let known = self.family != FAMILIES[6];
        let [Some(x), Some(y), Some(z)] = [X, Y, Z].map(place).map(|at| at.filter(|_| known))
        else {
            return self.without_names(self.header == Some(""));
        };
        if self.header.is_none() {
            return self.without_names(false);
        }
        let named = [x, y, z];
        let numbers = |shift: usize| named.iter().all(|at| self.is_number(at + shift));
        let (first, last) = (self.columns[0], self.columns[width - 1]);
        let shift = match self.missing {
            0 => Some(0),
            3 => (!self.is_spaced() && numbers(0)).then_some(0),
            _ if matches!(first, Id | Word) && last != Word && numbers(1) => Some(1),
            _ if last == Word && numbers(0) => Some(0),
            _ if named.iter().all(|at| *at < 3) && numbers(0) => Some(0),
            _ => None,
        };
        match shift {
            Some(shift) => Some(named.map(|at| at + shift)),
            None if self.header == Some("") => None,
            None if self.missing == 3 => self.without_names(false),
            // A comment may be prose, unless x, y and z stand side by side in it.
            None if [y, z] == [x + 1, x + 2] && names.len() >= 3 && self.is_plain() => None,
            None => self.without_names(false),
        }
    }

    /// True if names are x, y and z themselves.
    fn is_plain(&self) -> bool {
        self.family == FAMILIES[0] || self.family == FAMILIES[1]
    }

    /// The same, by the look of the numbers.
    fn without_names(&self, refused: bool) -> Option<[usize; 3]> {
        let coordinate = |at: usize| matches!(self.columns.get(at), Some(X | Y | Z));
        let whole = !matches!(self.columns[0], X | Y | Z | Word);
        let counts = self.columns[0] == Id && self.points.len() > 2;
        let numbered = whole && (1..4).all(coordinate) && (counts || self.columns.contains(&Word));
        let numbers = (0..3).all(|at| self.is_number(at));
        (!refused && !numbered && numbers).then_some([0, 1, 2])
    }

    /// The coordinates in thousandths, sorted; none if the text must be refused.
    pub fn expected(&self) -> Option<Vec<[i64; 3]>> {
        let columns = self.columns()?;
        let value = |row, column: usize| {
            let text = self.plain(row, self.columns[column]);
            (text.parse::<f64>().unwrap_or(f64::NAN) * 1000.0).round() as i64
        };
        let mut all: Vec<[i64; 3]> = (0..self.points.len())
            .map(|row| columns.map(|column| value(row, column)))
            .collect();
        all.sort_unstable();
        Some(all)
    }
}
