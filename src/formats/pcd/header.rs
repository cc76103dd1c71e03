//! The header of a PCD file: lines of a keyword and its values, up to `DATA`.

use super::super::input::Input;
use outcrop_disk::error::{Error, Result};
use outcrop_ply::{Scalar, real};

/// Most bytes of a header.
pub(super) const LONGEST: usize = 1 << 20;

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    /// One that PLY has, too.
    Scalar(Scalar),
    I64,
    U64,
}

impl Number {
    /// The type of a letter of `TYPE`, in upper or lower case, and a number of `SIZE`.
    fn of(letter: &str, bytes: &str) -> Option<Self> {
        Some(match (&*letter.to_ascii_uppercase(), bytes) {
            ("I", "1") => Self::Scalar(Scalar::I8),
            ("I", "2") => Self::Scalar(Scalar::I16),
            ("I", "4") => Self::Scalar(Scalar::I32),
            ("I", "8") => Self::I64,
            ("U", "1") => Self::Scalar(Scalar::U8),
            ("U", "2") => Self::Scalar(Scalar::U16),
            ("U", "4") => Self::Scalar(Scalar::U32),
            ("U", "8") => Self::U64,
            ("F", "4") => Self::Scalar(Scalar::F32),
            ("F", "8") => Self::Scalar(Scalar::F64),
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Scalar(scalar) => scalar.bytes() as u64,
            Self::I64 | Self::U64 => 8,
        }
    }

    /// Puts the number that a word stands for into the first bytes, as a binary file has it; what is no number
    /// becomes NaN, or 0 if there is none.
    pub(super) fn put(self, word: &[u8], bytes: &mut [u8]) {
        let text = std::str::from_utf8(word).unwrap_or_default();
        let word = match self {
            Self::Scalar(Scalar::F32) => {
                let single: u32 = text.parse().unwrap_or(f32::NAN).to_bits();
                u64::from(single)
            }
            Self::Scalar(Scalar::F64) => text.parse().unwrap_or(f64::NAN).to_bits(),
            _ => match (text.parse::<i64>(), text.parse::<f64>()) {
                (Ok(whole), _) => whole.cast_unsigned(),
                // Beyond the range of i64, or with a point.
                (_, Ok(real)) if real >= 0.0 => real as u64,
                (_, Ok(real)) => (real as i64).cast_unsigned(),
                _ => 0,
            },
        };
        let length = self.bytes() as usize;
        bytes[..length].copy_from_slice(&word.to_le_bytes()[..length]);
    }

    /// The number in the first bytes; the caller has checked the length.
    #[inline]
    pub(super) fn value(self, bytes: &[u8]) -> f64 {
        let mut word = [0; 8];
        match self {
            Self::Scalar(scalar) => real(scalar, bytes, false),
            Self::I64 => {
                word.copy_from_slice(&bytes[..8]);
                i64::from_le_bytes(word) as f64
            }
            Self::U64 => {
                word.copy_from_slice(&bytes[..8]);
                u64::from_le_bytes(word) as f64
            }
        }
    }
}

/// Values of a point: one or more numbers of one type.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) number: Number,
    /// Numbers in each point.
    pub(super) count: u64,
}

impl Field {
    /// True for bytes without a meaning, which align the fields after them.
    pub(super) fn is_padding(&self) -> bool {
        self.name == "_"
    }

    /// Bytes in each point of a binary file.
    pub(super) fn bytes(&self) -> u64 {
        self.number.bytes().saturating_mul(self.count)
    }
}

/// The way in which the points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Body {
    /// A point in each line.
    Text,
    /// One record after another.
    Binary,
    /// One field after another, compressed by LZF.
    Compressed,
}

/// A header.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    /// Numbers of the fields x, y and z.
    pub(super) axes: [usize; 3],
    /// Number of points.
    pub(super) points: u64,
    pub(super) body: Body,
    /// Position of the sensor, if it is not the default.
    pub(super) sensor: Option<[f64; 3]>,
    /// Offset of the first byte after the header.
    pub(super) data: u64,
}

impl Header {
    /// Reads and checks the header.
    ///
    /// # Errors
    /// [`Error::Input`] with the number of the line.
    pub(super) fn read(input: &Input) -> Result<Self> {
        let head = input.head(LONGEST)?;
        let mut lines = Lines::default();
        let mut at = 0;
        for (number, line) in head.split_inclusive(|b| *b == b'\n').enumerate() {
            at += line.len() as u64;
            let text = String::from_utf8_lossy(line);
            let mut words = text.split_ascii_whitespace();
            let Some(key) = words.next() else { continue };
            let values: Vec<String> = words.map(str::to_owned).collect();
            if key == "DATA" && line.ends_with(b"\n") {
                return lines.end(input, (number + 1, &values), at);
            }
            lines.take(key, (number + 1, values));
        }
        let found = match head.len() < LONGEST {
            true => "the end of the file".to_owned(),
            false => format!("no line DATA in {LONGEST} bytes"),
        };
        Err(input.error("PCD header", found, "a line DATA"))
    }

    /// Bytes of a record, with or without padding.
    pub(super) fn record_bytes(&self, padding: bool) -> u64 {
        let fields = self.fields.iter().filter(|f| padding || !f.is_padding());
        fields.fold(0, |sum, field| sum.saturating_add(field.bytes()))
    }

    /// Sum of a quantity of the fields before a field.
    pub(super) fn before(&self, field: usize, each: impl Fn(&Field) -> u64) -> u64 {
        let fields = self.fields[..field].iter();
        fields.fold(0, |sum, field| sum.saturating_add(each(field)))
    }
}

/// A line: its number, and the words after the keyword.
type Line = (usize, Vec<String>);

/// The lines of a header by keyword; the last one of a kind counts.
#[derive(Default)]
struct Lines {
    fields: Line,
    sizes: Option<Line>,
    types: Option<Line>,
    counts: Option<Line>,
    width: Option<Line>,
    height: Option<Line>,
    points: Option<Line>,
    viewpoint: Line,
}

impl Lines {
    fn take(&mut self, key: &str, line: Line) {
        match key {
            "FIELDS" | "COLUMNS" => self.fields = line,
            "SIZE" => self.sizes = Some(line),
            "TYPE" => self.types = Some(line),
            "COUNT" => self.counts = Some(line),
            "WIDTH" => self.width = Some(line),
            "HEIGHT" => self.height = Some(line),
            "POINTS" => self.points = Some(line),
            "VIEWPOINT" => self.viewpoint = line,
            // Comments, VERSION.
            _ => {}
        }
    }

    fn end(self, input: &Input, (number, data): (usize, &[String]), at: u64) -> Result<Header> {
        let word = data.first().map(|word| word.to_ascii_lowercase());
        let body = match word.as_deref() {
            Some("ascii") => Body::Text,
            Some("binary") => Body::Binary,
            Some("binary_compressed") => Body::Compressed,
            _ => {
                let other = data.first().map_or("", String::as_str);
                let found = format!("DATA \"{}\"", other.escape_debug());
                let expected = "ascii, binary or binary_compressed";
                return Err(wrong(input, number, found, expected));
            }
        };
        let fields = self.fields(input)?;
        let axes = ["x", "y", "z"].map(|name| axis(input, self.fields.0, &fields, name));
        let [x, y, z] = axes;
        Ok(Header {
            axes: [x?, y?, z?],
            points: self.points(input)?,
            sensor: self.sensor(),
            fields,
            body,
            data: at,
        })
    }

    fn fields(&self, input: &Input) -> Result<Vec<Field>> {
        let names = &self.fields.1;
        if names.is_empty() {
            return Err(input.error("PCD header", "no line FIELDS", "the names of the fields"));
        }
        let values = |line: Option<&Line>, key: &str| match line {
            None => Err(input.error("PCD header", format!("no line {key}"), "one before DATA")),
            Some((number, values)) if values.len() != names.len() => Err(wrong(
                input,
                *number,
                format!("{} values of {key}", values.len()),
                format!("{}, one for each field", names.len()),
            )),
            Some((number, values)) => Ok((*number, values.clone())),
        };
        let sizes = values(self.sizes.as_ref(), "SIZE")?;
        let types = values(self.types.as_ref(), "TYPE")?;
        let counts = match &self.counts {
            None => (0, vec!["1".to_owned(); names.len()]),
            some => values(some.as_ref(), "COUNT")?,
        };
        let field = |(at, name): (usize, &String)| {
            let number = Number::of(&types.1[at], &sizes.1[at]).ok_or_else(|| {
                let found = format!(
                    "field {name}: type {} of {} bytes",
                    types.1[at], sizes.1[at]
                );
                let expected = "F of 4 or 8 bytes, I or U of 1, 2, 4 or 8";
                wrong(input, types.0, found.escape_debug().to_string(), expected)
            })?;
            let count = counts.1[at].parse().map_err(|_| {
                let found = format!("COUNT \"{}\"", counts.1[at].escape_debug());
                wrong(input, counts.0, found, "a number of values, 0 or more")
            })?;
            let name = name.clone();
            Ok(Field {
                name,
                number,
                count,
            })
        };
        names.iter().enumerate().map(field).collect()
    }

    /// The position in `VIEWPOINT`; a line that cannot be understood is as none, for it moves no point.
    fn sensor(&self) -> Option<[f64; 3]> {
        let numbers = self.viewpoint.1.iter().map(|word| word.parse().ok());
        let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
        let [x, y, z, ..] = numbers[..] else {
            return None;
        };
        let finite = numbers.iter().all(|number| number.is_finite());
        let default = numbers == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        (finite && !default).then_some([x, y, z])
    }

    /// The number of points: that of `POINTS`, else the product of `WIDTH` and `HEIGHT`.
    fn points(&self, input: &Input) -> Result<u64> {
        let count = |line: &Line| {
            let word = line.1.first().map_or("", String::as_str);
            word.parse::<u64>().map_err(|_| {
                let found = format!("\"{}\"", word.escape_debug());
                wrong(input, line.0, found, "a number of points, 0 or more")
            })
        };
        if let Some(points) = &self.points {
            return count(points);
        }
        let Some(width) = &self.width else {
            return Err(input.error("PCD header", "no line POINTS", "the number of points"));
        };
        let rows = self.height.as_ref().map_or(Ok(1), count)?;
        Ok(count(width)?.saturating_mul(rows))
    }
}

/// The number of the field called `name`, in lower or upper case.
fn axis(input: &Input, line: usize, fields: &[Field], name: &str) -> Result<usize> {
    let upper = name.to_ascii_uppercase();
    for wanted in [name, &upper] {
        let mut found = (0..fields.len()).filter(|at| fields[*at].name == *wanted);
        let Some(first) = found.next() else { continue };
        let others = found.count();
        if others > 0 {
            let found = format!("{} fields {wanted}", others + 1);
            return Err(wrong(input, line, found, "one"));
        }
        let count = fields[first].count;
        if count != 1 {
            let found = format!("field {wanted} with {count} values");
            return Err(wrong(input, line, found, "one value"));
        }
        return Ok(first);
    }
    let found = format!("no field {name}");
    Err(wrong(input, line, found, "the fields x, y and z"))
}

fn wrong(input: &Input, line: usize, found: String, expected: impl Into<String>) -> Error {
    input.error(format!("PCD header, line {line}"), found, expected)
}
