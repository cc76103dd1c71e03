//! PTX: scans as text, each a header with the pose of the scanner and a line for each direction.

mod index;
mod scan;

use super::columns::{COLORS, Column, INTENSITY, SCANNER, Wanted};
use super::format::Format;
use super::input::Input;
use super::lines;
use super::native::Native;
use super::number::{self, NOT_FIXED};
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use super::spool::{Sink, SourceWriter, sink_bytes};
use crate::error::Result;
use index::{Index, UNIT};
use outcrop_ply::Scalar;
use scan::{HEADER, Scan, Shape, shape, words};
use std::cell::OnceCell;

impl Format {
    /// Scans as text, with poses.
    pub const PTX: Self = Self::new("ptx", "PTX");
}

/// Bytes of a line with a point: the minimum.
const LEAST: u64 = 6;

/// The format PTX.
pub(super) struct Ptx;

impl PointFormat for Ptx {
    fn names(&self) -> &'static str {
        "PTX"
    }

    fn formats(&self) -> &'static [Format] {
        &[Format::PTX]
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ptx"]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        Ok(shape(&head.bytes) == Shape::Header)
    }

    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>> {
        let lines = head.bytes.split(|b| lines::is_end(*b));
        let lines = lines.map(<[u8]>::trim_ascii).filter(|l| !l.is_empty());
        let lines: Vec<&[u8]> = lines.take(HEADER + 1).collect();
        let point = lines.get(HEADER).copied().unwrap_or_default();
        Ok(Box::new(Scans {
            first: Scan::of(input, 0, &lines[..lines.len().min(HEADER)])?,
            words: words(point).count(),
            scanners: OnceCell::new(),
        }))
    }
}

/// A file, of which the first header was read.
struct Scans {
    first: Scan,
    /// Words of its first line.
    words: usize,
    /// The positions of all scanners, when they are known.
    scanners: OnceCell<Vec<[f64; 3]>>,
}

impl PointFile for Scans {
    fn claims(&self, input: &Input) -> Claims {
        // Further scans may follow, so a number of points is an estimate.
        let least = self.first.points.min(input.bytes / LEAST);
        Claims {
            text: true,
            points: None,
            likely_points: least.max(input.bytes / 40),
            ..Claims::new(input, Format::PTX, Native::F64, 0, LEAST)
        }
    }

    fn columns(&self) -> Vec<Column> {
        columns(self.words)
    }

    fn scanners(&self) -> Vec<[f64; 3]> {
        let all = self.scanners.get().cloned();
        all.unwrap_or_else(|| vec![self.first.scanner])
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let (index, _held) = Index::read(input, target)?;
        let filled = index.scans.iter().filter(|scan| scan.points > 0);
        let _ = self.scanners.set(filled.map(|scan| scan.scanner).collect());
        let memory = UNIT + sink_bytes::<f64>();
        let work =
            |unit: usize, sink: &mut Sink<'_, f64>| index.take(input, unit, target.wanted, sink);
        target.units("PTX lines", index.units.len(), |_| memory, work)?;
        Ok(Vec::new())
    }
}

/// The columns of lines of so many words: an intensity behind the coordinates, and a colour behind that; and the
/// scanner.
fn columns(words: usize) -> Vec<Column> {
    let color = COLORS.map(|name| Column::new(name, Scalar::U8));
    let all = [Column::new(INTENSITY, Scalar::F32)]
        .into_iter()
        .chain(color);
    let count = match words {
        0..4 => 0,
        4..7 => 1,
        7.. => 4,
    };
    let scanner = Column::new(SCANNER, Scalar::U16);
    all.take(count).chain([scanner]).collect()
}

impl Scan {
    /// Passes the point of a line on; the error says what was found.
    fn take(
        &self,
        line: &[u8],
        wanted: &Wanted,
        sink: &mut Sink<'_, f64>,
    ) -> Result<Result<(), String>> {
        let mut point = [0.0; 3];
        let mut decimals = 0;
        let mut found = 0;
        for (to, word) in point.iter_mut().zip(words(line)) {
            let Some(value) = number::parse(word, false, &mut decimals) else {
                break;
            };
            *to = value;
            found += 1;
        }
        if found < 3 {
            let shown = &line[..line.len().min(60)];
            return Ok(Err(format!("\"{}\"", shown.escape_ascii())));
        }
        // The scanner writes this where nothing came back.
        if point == [0.0; 3] {
            sink.invalid();
            return Ok(Ok(()));
        }
        let decimals = match self.decimals {
            NOT_FIXED => NOT_FIXED,
            fixed => fixed.max(decimals),
        };
        sink.stats.decimals = sink.stats.decimals.max(decimals);
        sink.push_with(self.placed(point), |values| {
            let mut others = words(line).skip(3).take(4);
            let mut next = 0;
            for (number, column) in wanted.numbers.iter().zip(&wanted.columns) {
                if column.name == SCANNER {
                    values.extend(self.number.to_le_bytes());
                    continue;
                }
                let word = others.nth(number - next);
                next = number + 1;
                let value = word.and_then(|w| number::parse(w, false, &mut 0));
                column.scalar.put(value.unwrap_or(f64::NAN), values);
            }
        })?;
        Ok(Ok(()))
    }
}
