//! PTX: scans as text, each a header with the pose of the scanner and a line for each direction.

mod index;
mod scan;

use super::format::Format;
use super::input::Input;
use super::lines;
use super::number::{self, NOT_FIXED};
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use super::source::Native;
use super::spool::{Sink, SourceWriter, sink_bytes};
use crate::error::Result;
use index::{Index, UNIT};
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
        let lines: Vec<&[u8]> = lines.take(HEADER).collect();
        Ok(Box::new(Scans {
            first: Scan::of(input, 0, &lines)?,
            scanners: OnceCell::new(),
        }))
    }
}

/// A file, of which the first header was read.
struct Scans {
    first: Scan,
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

    fn scanners(&self) -> Vec<[f64; 3]> {
        let all = self.scanners.get().cloned();
        all.unwrap_or_else(|| vec![self.first.scanner])
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let (index, _held) = Index::read(input, target)?;
        let filled = index.scans.iter().filter(|scan| scan.points > 0);
        let _ = self.scanners.set(filled.map(|scan| scan.scanner).collect());
        let memory = UNIT + sink_bytes::<f64>();
        let work = |unit: usize, sink: &mut Sink<'_, f64>| index.take(input, unit, sink);
        target.units("PTX lines", index.units.len(), |_| memory, work)?;
        Ok(Vec::new())
    }
}

impl Scan {
    /// Passes the point of a line on; the error says what was found.
    fn take(&self, line: &[u8], sink: &mut Sink<'_, f64>) -> Result<Result<(), String>> {
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
        sink.push(self.placed(point))?;
        Ok(Ok(()))
    }
}
