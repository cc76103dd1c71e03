//! The columns that the mesh keeps, and the values of the spool in their types.
//!
//! The columns of all files become one list. Its rows are bytes that compare like the values, column by column,
//! so that the smallest of several rows does not depend on who read them. The number of the scanner and the normal,
//! if they are carried, come first: so those of a position are the same whatever columns the mesh keeps.

use super::Spool;
use super::colors::{Scale, Tone, said};
use super::columns::{Attributes, COLORS, Column, SCANNER, Span, row_bytes};
use super::directions::{NORMAL_BYTES, Parts, normal_of};
use super::ranks::Ranks;
use super::source::Source;
use outcrop_ply::{Scalar, real};
use serde::{Deserialize, Serialize};

/// All types, smaller ones first.
const SCALARS: [Scalar; 8] = [
    Scalar::U8,
    Scalar::I8,
    Scalar::U16,
    Scalar::I16,
    Scalar::U32,
    Scalar::I32,
    Scalar::F32,
    Scalar::F64,
];

/// A column of the mesh, for the report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attribute {
    /// Its name.
    pub name: String,
    /// Type of its values in the mesh.
    #[serde(rename = "type")]
    pub scalar: Scalar,
    /// Smallest and largest value in the inputs.
    pub range: [f64; 2],
    /// Input files without it.
    pub files_without: u64,
}

/// Change of a value on its way to the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Change {
    /// None but of the type.
    None,
    /// A colour: by the scale of its point.
    Tone,
    /// The number of a scanner in its file: that in the cloud.
    Scanner,
}

/// The values of one column in the rows of one source.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// Byte in the row, and type; `None` if the source lacks the column.
    from: Option<(usize, Scalar)>,
    change: Change,
    to: Scalar,
}

/// The columns of the mesh, and the way from the rows of each source.
#[derive(Debug, Clone, Default)]
pub struct Carried {
    /// The columns, in the order of the mesh.
    pub columns: Vec<Column>,
    /// The columns for the report.
    pub attributes: Vec<Attribute>,
    /// Warnings and notes, one line each.
    pub warnings: Vec<String>,
    /// For each source, the steps of all columns.
    steps: Vec<Vec<Step>>,
    /// For each source, the way of its colours, if it has any.
    tones: Vec<Option<Tone>>,
    ranks: Ranks,
    /// For each source, the place of the number of the scanner; none if scanners are not carried.
    scanners: Option<Vec<Option<(usize, Scalar)>>>,
    /// For each source, the places of the normal; none if normals are not carried.
    pub(super) normals: Option<Vec<Option<Parts>>>,
}

/// Bytes of the number of a scanner in a row.
const NUMBER: usize = size_of::<u32>();

impl Carried {
    /// True if nothing is carried.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bytes() == 0
    }

    /// Bytes of the values of a point.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let number = if self.scanners.is_some() { NUMBER } else { 0 };
        let normal = if self.normals.is_some() {
            NORMAL_BYTES
        } else {
            0
        };
        number + normal + row_bytes(&self.columns)
    }

    /// True if rows begin with the number of the scanner, from 1, or 0: a word, highest byte first.
    #[must_use]
    pub fn has_scanners(&self) -> bool {
        self.scanners.is_some()
    }

    /// True if the normal follows: two words, highest byte first, of [`direction`](super::direction).
    #[must_use]
    pub fn has_normals(&self) -> bool {
        self.normals.is_some()
    }

    /// The positions of the scanners in the order of their numbers, in the input's unit.
    #[must_use]
    pub fn scanners(&self) -> &[[f64; 3]] {
        let carried = self.scanners.is_some();
        if carried { &self.ranks.positions } else { &[] }
    }

    /// Leaves out the scanners.
    pub fn drop_scanners(&mut self) {
        self.scanners = None;
    }

    /// Appends the row of a point of source `source`, whose values in the spool are `values`.
    pub(super) fn put(&self, source: usize, values: &[u8], row: &mut Vec<u8>) {
        let number = |value| self.ranks.number(source, value);
        if let Some(scanners) = &self.scanners {
            let scanner = scanners[source].map(|(at, scalar)| real(scalar, &values[at..], false));
            row.extend(scanner.map_or(0, number).to_be_bytes());
        }
        if let Some(normals) = &self.normals {
            let words = normal_of(normals[source].as_ref(), values);
            row.extend(words.iter().flat_map(|word| word.to_be_bytes()));
        }
        let tone = self.tones.get(source).and_then(Option::as_ref);
        let tone = tone.map(|tone| (tone, tone.of_point(values)));
        for step in &self.steps[source] {
            let value = match step.from {
                Some((at, scalar)) => real(scalar, &values[at..], false),
                None => f64::NAN,
            };
            let value = match step.change {
                Change::None => value,
                Change::Tone => match (&tone, step.from) {
                    (Some((tone, depth)), Some((_, from))) => tone.shade(value, from, *depth),
                    _ => value,
                },
                Change::Scanner => f64::from(number(value)),
            };
            put_ordered(step.to, value, row);
        }
    }

    /// The bytes of a value of a column of one word, as they are in a row.
    #[must_use]
    pub fn word(column: &Column, value: f64) -> u32 {
        let mut own = Vec::with_capacity(size_of::<u32>());
        put_ordered(column.scalar, value, &mut own);
        own.iter()
            .fold(0, |word, byte| word << 8 | u32::from(*byte))
    }

    /// Appends the little-endian value of a column, whose bytes in a row are `own`.
    pub fn unordered(column: &Column, own: &[u8], values: &mut Vec<u8>) {
        let start = values.len();
        values.extend(own.iter().rev());
        flip(column.scalar, &mut values[start..], false);
    }
}

/// Appends a value in bytes that compare like values.
fn put_ordered(scalar: Scalar, value: f64, row: &mut Vec<u8>) {
    let start = row.len();
    scalar.put(value, row);
    flip(scalar, &mut row[start..], true);
    row[start..].reverse();
}

/// Turns little-endian values into unsigned integers of the same order, or back.
fn flip(scalar: Scalar, bytes: &mut [u8], forth: bool) {
    let Some(top) = bytes.last_mut() else {
        return;
    };
    let sign = *top >> 7 == 1;
    match scalar {
        Scalar::U8 | Scalar::U16 | Scalar::U32 => {}
        Scalar::I8 | Scalar::I16 | Scalar::I32 => *top ^= 0x80,
        // Of negative floats the larger has the smaller bits.
        Scalar::F32 | Scalar::F64 if sign == forth => bytes.iter_mut().for_each(|b| *b = !*b),
        Scalar::F32 | Scalar::F64 => *top ^= 0x80,
    }
}

/// The smallest type that has all values of both.
fn common(a: Scalar, b: Scalar) -> Scalar {
    let bits = |s: Scalar| match s {
        Scalar::F32 => 24,
        Scalar::F64 => 53,
        _ => 8 * s.bytes(),
    };
    let signed = |s: Scalar| matches!(s, Scalar::I8 | Scalar::I16 | Scalar::I32);
    let holds = |t: Scalar, s: Scalar| match (t.is_integer(), s.is_integer()) {
        _ if t == s => true,
        (true, true) if signed(t) => bits(t) > bits(s) || signed(s) && bits(t) >= bits(s),
        (true, true) => !signed(s) && bits(t) >= bits(s),
        (true, false) => false,
        (false, _) => bits(t) >= bits(s),
    };
    let both = |t: &Scalar| holds(*t, a) && holds(*t, b);
    SCALARS.into_iter().find(both).unwrap_or(Scalar::F64)
}

fn is_color(name: &str) -> bool {
    COLORS.contains(&name)
}

/// Number, byte and type of a column in the rows of a source.
fn place(source: &Source, name: &str) -> Option<(usize, usize, Scalar)> {
    let number = source.columns.iter().position(|c| c.name == name)?;
    let at = row_bytes(&source.columns[..number]);
    Some((number, at, source.columns[number].scalar))
}

/// The sources with kept points.
fn used(sources: &[Source]) -> impl Iterator<Item = &Source> {
    sources.iter().filter(|s| s.stats.kept > 0)
}

/// The span of a column over all sources.
fn span(sources: &[Source], name: &str) -> Span {
    let mut all = Span::default();
    for source in used(sources) {
        if let Some((number, ..)) = place(source, name) {
            all.merge(&source.spans[number]);
        }
    }
    all
}

/// The scale of the colours of a source, if some were read.
fn scale(source: &Source) -> Option<Scale> {
    let places = COLORS.map(|name| place(source, name));
    let scalars: Vec<Scalar> = places.into_iter().flatten().map(|p| p.2).collect();
    (!scalars.is_empty()).then(|| Scale::of(&scalars, source.depth, &source.tally))
}

impl Spool {
    /// True if values of columns were read.
    #[must_use]
    pub fn has_values(&self) -> bool {
        used(&self.sources).any(|s| !s.columns.is_empty())
    }

    /// The columns of the mesh: those wanted that some file has, colours with 8 bits or, if `wide`, 16.
    #[must_use]
    pub fn carried(&self, attributes: &Attributes, wide: bool) -> Carried {
        let sources = &self.sources;
        let mut names = attributes.names();
        names.retain(|name| used(sources).any(|s| place(s, name).is_some()));
        let mut carried = Carried {
            ranks: Ranks::of(sources, &self.stats),
            ..Carried::default()
        };
        if *attributes == Attributes::Auto {
            let constant = |name: &str| {
                let span = span(sources, name);
                span.min >= span.max
            };
            let gray = COLORS.iter().all(|name| constant(name));
            let (dull, kept) = names.into_iter().partition(|name| match is_color(name) {
                true => gray,
                false => constant(name),
            });
            names = kept;
            let dull: Vec<&str> = dull;
            if !dull.is_empty() {
                let list = dull.join(", ");
                let note = format!("the same at all points, so not kept: {list}");
                carried.warnings.push(note);
            }
        }
        carried.steps = vec![Vec::new(); sources.len()];
        for name in names {
            self.carry(name, wide, &mut carried);
        }
        if carried.columns.iter().any(|c| is_color(&c.name)) {
            let tone = |s: &Source| Some(Tone::new(scale(s)?, &s.columns, wide));
            carried.tones = sources.iter().map(tone).collect();
            let scales: Vec<Scale> = used(sources).filter_map(scale).collect();
            if scales.iter().any(|scale| !scale.certain || scale.stray > 0) {
                carried.warnings.push(said(&scales));
            }
        }
        carried
    }

    /// The same, and the scanners of the points if they were read and a file gives any.
    #[must_use]
    pub fn with_scanners(&self, mut carried: Carried) -> Carried {
        if !carried.ranks.positions.is_empty() {
            let from = |(number, source): (usize, &Source)| {
                let place = place(source, SCANNER).filter(|_| carried.ranks.has(number));
                place.map(|(_, at, scalar)| (at, scalar))
            };
            let from = self.sources.iter().enumerate().map(from);
            carried.scanners = Some(from.collect());
        }
        carried
    }

    /// Adds the column `name`.
    fn carry(&self, name: &str, wide: bool, carried: &mut Carried) {
        let sources = &self.sources;
        let scalars = used(sources).filter_map(|s| Some(place(s, name)?.2));
        let scalar = match (is_color(name), wide) {
            (true, true) => Scalar::U16,
            (true, false) => Scalar::U8,
            _ => scalars.reduce(common).unwrap_or(Scalar::U8),
        };
        let ranks = &carried.ranks;
        let scanners = ranks.positions.len();
        let scalar = match name == SCANNER && scanners > usize::from(u16::MAX) {
            true => common(scalar, Scalar::U32),
            false => scalar,
        };
        for (number, (source, steps)) in sources.iter().zip(&mut carried.steps).enumerate() {
            let from = place(source, name).map(|(_, at, scalar)| (at, scalar));
            let change = match from {
                Some(_) if is_color(name) => Change::Tone,
                Some(_) if name == SCANNER && ranks.has(number) => Change::Scanner,
                _ => Change::None,
            };
            steps.push(Step {
                from,
                change,
                to: scalar,
            });
        }
        let lacking = |s: &&Source| place(s, name).is_none();
        let files_without = used(sources).filter(lacking).count() as u64;
        if files_without > 0 {
            let filled = if scalar.is_integer() { "0" } else { "NaN" };
            let all = used(sources).count();
            let note =
                format!("{files_without} of {all} files have no {name}; their points get {filled}");
            carried.warnings.push(note);
        }
        let Span { min, max } = match name == SCANNER && scanners > 0 {
            true => Span {
                min: 0.0,
                max: scanners as f64,
            },
            false => span(sources, name),
        };
        carried.attributes.push(Attribute {
            name: name.to_owned(),
            scalar,
            range: [min, max].map(|x| if x.is_finite() { x } else { 0.0 }),
            files_without,
        });
        carried.columns.push(Column {
            name: name.to_owned(),
            scalar,
        });
    }
}

#[cfg(test)]
mod tests;
