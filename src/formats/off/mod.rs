//! OFF: the vertices of a mesh as text, a vertex a line. Its faces are no points and not read.

mod header;

use super::input::Input;
use super::lines::{self, LONGEST_LINE, Lines, SLAB, is_end};
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use header::{Header, header, is_comment, words};
use outcrop_disk::error::{Error, Result};
use outcrop_points::Format;
use outcrop_points::columns::{Column, Wanted};
use outcrop_points::native::Native;
use outcrop_points::number;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};
use serde::{Deserialize, Serialize};
use std::io::BufRead;

/// Bytes of a line with a vertex: the minimum.
const LEAST: u64 = 6;

/// The format OFF.
pub(super) struct Off;

impl PointFormat for Off {
    fn names(&self) -> &'static str {
        "OFF"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["off", "coff", "noff"]
    }

    /// Any text may begin with such a word.
    fn has_signature(&self) -> bool {
        false
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        header::recognize(&head.bytes)
    }

    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>> {
        let header = header(&head.bytes, head.whole);
        let wrong = |(found, expected): (String, &str)| input.error("OFF header", found, expected);
        Ok(Box::new(header.map_err(wrong)?))
    }
}

/// Where the lines of the vertices end.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Extent {
    end: u64,
    /// Lines with a vertex.
    vertices: u64,
}

impl PointFile for Header {
    fn claims(&self, input: &Input) -> Claims {
        Claims {
            text: true,
            ..Claims::new(input, Format::OFF, Native::F64, self.vertices, LEAST)
        }
    }

    fn columns(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn taken(&self) -> Option<(&str, bool)> {
        self.taken.as_deref().map(|taken| (taken, true))
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let name = target.step("OFF vertices");
        let extent = target.workspace.once(&name, |_| self.extent(input))?;
        if extent.vertices < self.vertices {
            return Err(input.error(
                "OFF header",
                format!("{} vertices", self.vertices),
                format!("at most {}, the number of lines after it", extent.vertices),
            ));
        }
        let slabs = extent.end.saturating_sub(self.start).div_ceil(SLAB);
        let memory = SLAB + LONGEST_LINE + sink_bytes::<f64>();
        let work = |unit: usize, sink: &mut Sink<'_, f64>| {
            let start = self.start + unit as u64 * SLAB;
            let lines = Lines::read(input, self.start, start)?;
            for (at, line) in lines.iter().take_while(|(at, _)| *at < extent.end) {
                self.take(input, (at, line), target.wanted, sink)?;
            }
            Ok(())
        };
        let slabs = usize::try_from(slabs).unwrap_or(usize::MAX);
        target.units("OFF lines", slabs, |_| memory, work)?;
        Ok(Vec::new())
    }
}

impl Header {
    /// Passes over as many lines as there are vertices.
    fn extent(&self, input: &Input) -> Result<Extent> {
        let mut source = input.stream(self.start, input.bytes);
        let mut at = self.start;
        let mut vertices = 0;
        // The first byte of the line that is no space, if there was one.
        let mut first = None;
        let mut length = 0;
        while vertices < self.vertices {
            let buffer = source.fill_buf();
            let buffer = buffer.map_err(|e| Error::io(&input.path, "read", e))?;
            if buffer.is_empty() {
                vertices += u64::from(first.is_some_and(|b| b != b'#'));
                break;
            }
            let end = buffer.iter().position(|b| is_end(*b));
            let line = &buffer[..end.unwrap_or(buffer.len())];
            first = first.or(line.iter().copied().find(|b| !b.is_ascii_whitespace()));
            length += line.len() as u64;
            if length > LONGEST_LINE {
                return Err(lines::too_long(input, at, LONGEST_LINE));
            }
            let used = line.len() + usize::from(end.is_some());
            if end.is_some() {
                vertices += u64::from(first.is_some_and(|b| b != b'#'));
                (first, length) = (None, 0);
            }
            source.consume(used);
            at += used as u64;
        }
        Ok(Extent { end: at, vertices })
    }

    /// Takes the vertex of a line.
    fn take(
        &self,
        input: &Input,
        (at, line): (u64, &[u8]),
        wanted: &Wanted,
        sink: &mut Sink<'_, f64>,
    ) -> Result<()> {
        if is_comment(line) {
            return Ok(());
        }
        let mut point = [0.0; 3];
        let mut found = 0;
        for (to, word) in point.iter_mut().zip(words(line)) {
            let Some(value) = number::parse(word, false, &mut sink.stats.decimals) else {
                break;
            };
            *to = value;
            found += 1;
        }
        if found < 3 {
            let place = format!("line {}", lines::number_of(input, at)?);
            let shown = line.trim_ascii();
            let shown = format!("\"{}\"", shown[..shown.len().min(60)].escape_ascii());
            return Err(input.error(place, shown, "a vertex, three numbers or more in a line"));
        }
        sink.push_with(point, |values| {
            let mut others = words(line).skip(3);
            let mut next = 0;
            for (number, column) in wanted.numbers.iter().zip(&wanted.columns) {
                let word = others.nth(number - next);
                next = number + 1;
                let value = word.and_then(|w| number::parse(w, false, &mut 0));
                column.scalar.put(value.unwrap_or(f64::NAN), values);
            }
        })
    }
}
