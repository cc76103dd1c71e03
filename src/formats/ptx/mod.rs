//! PTX: scans as text, each a header with the pose of the scanner and a line for each direction.

mod index;
mod kinds;
mod scan;

use super::input::Input;
use super::lines;
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use index::{Index, UNIT};
use kinds::{Kinds, MOST_WORDS, Value, columns};
use outcrop_disk::error::Result;
use outcrop_points::Format;
use outcrop_points::columns::{COLORS, Column};
use outcrop_points::native::Native;
use outcrop_points::number::{self, NOT_FIXED};
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};
use scan::{HEADER, Scan, Shape, shape, words};
use std::cell::OnceCell;

/// Bytes of a line with a point: the minimum.
const LEAST: u64 = 6;

/// The format PTX.
pub(super) struct Ptx;

impl PointFormat for Ptx {
    fn names(&self) -> &'static str {
        "PTX"
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
        let lines: Vec<&[u8]> = lines.take(HEADER).collect();
        let first = Scan::of(input, 0, &lines[..lines.len().min(HEADER)])?;
        Ok(Box::new(Scans {
            // Further scans may have what the first does not.
            likely: match head.whole {
                true => Kinds::of_head(&head.bytes),
                false => Kinds::ALL,
            },
            first,
            kinds: OnceCell::new(),
            scanners: OnceCell::new(),
        }))
    }
}

/// A file, of which the first header was read.
struct Scans {
    first: Scan,
    /// What its lines may have.
    likely: Kinds,
    /// What they have, when they were read.
    kinds: OnceCell<Kinds>,
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
        columns(self.likely)
    }

    fn found(&self) -> Vec<Column> {
        columns(self.kinds.get().copied().unwrap_or(self.likely))
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
        let kinds = Kinds::from_bits(target.stats().kinds);
        let _ = self.kinds.set(kinds);
        let colors = target.wanted.columns.iter().any(|c| c.name == COLORS[0]);
        let some = (colors && kinds.is_partly_coloured()).then(|| {
            "lines of some points have no colour: these are black, or as points with the same position".to_owned()
        });
        Ok(some.into_iter().collect())
    }
}

impl Scan {
    /// Passes the point of a line on, and what the line has if `look`; the error says what was found.
    fn take(
        &self,
        line: &[u8],
        (wanted, look): (&[Value], bool),
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
        let mut all: [&[u8]; MOST_WORDS] = [&[]; MOST_WORDS];
        let mut count = 0;
        if look {
            for (to, word) in all.iter_mut().zip(words(line)) {
                *to = word;
                count += 1;
            }
            sink.stats.kinds |= Kinds::of(count).bits();
        }
        sink.push_with(self.placed(point), |values| {
            for value in wanted {
                match value.place(count) {
                    _ if value.is_scanner() => values.extend(self.number.to_le_bytes()),
                    Some(at) => {
                        let number = number::parse(all[at], false, &mut 0);
                        value.scalar().put(number.unwrap_or(f64::NAN), values);
                    }
                    None => value.scalar().put(f64::NAN, values),
                }
            }
        })?;
        Ok(Ok(()))
    }
}
