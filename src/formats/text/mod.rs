//! Lines of numbers: XYZ, TXT, CSV, PTS.

mod cells;
mod dialect;
mod foreign;
mod found;
mod guess;
mod names;
mod sample;

use super::input::Input;
use super::lines::{self, LONGEST_LINE, Lines, SLAB};
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use dialect::{Dialect, Row};
use outcrop_disk::error::Result;
use outcrop_points::Format;
use outcrop_points::columns::{Column, Wanted};
use outcrop_points::native::Native;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Bytes of a line with a point: the minimum, and a typical value.
const LINE: [u64; 2] = [6, 30];

/// The format with one point in a line.
pub(super) struct Text;

impl PointFormat for Text {
    fn names(&self) -> &'static str {
        "text (XYZ, CSV, PTS)"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["xyz", "txt", "csv", "pts", "asc", "xyzrgb", "xyzn", "neu"]
    }

    /// Any text may contain numbers.
    fn has_signature(&self) -> bool {
        false
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        let bytes = &head.bytes;
        if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
            return Err(Refusal::Unknown("UTF-16 text".into()));
        }
        if let Some(name) = foreign::name(bytes) {
            return Err(Refusal::Foreign(name));
        }
        if bytes.contains(&0) {
            let why = format!("{}, binary data", head.shown());
            return Err(Refusal::Unknown(why));
        }
        guess::guess(head).map(|_| true)
    }

    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>> {
        let wrong = |why| match why {
            Refusal::Foreign(name) | Refusal::Instead(name, _) => {
                input.error("format", name, self.names())
            }
            Refusal::Columns(why) | Refusal::Unknown(why) => {
                input.error("format", why, self.names())
            }
        };
        Ok(Box::new(guess::guess(head).map_err(wrong)?))
    }
}

impl PointFile for Dialect {
    fn claims(&self, input: &Input) -> Claims {
        let [least, usual] = LINE;
        Claims {
            text: true,
            points: None,
            ..Claims::new(input, Format::TEXT, Native::F64, input.bytes / usual, least)
        }
    }

    fn columns(&self) -> Vec<Column> {
        self.others
            .iter()
            .map(|(_, column)| column.clone())
            .collect()
    }

    fn taken(&self) -> Option<(&str, bool)> {
        Some((&self.taken, self.guessed))
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let slabs = input.bytes.saturating_sub(self.start).div_ceil(SLAB);
        let memory = SLAB + LONGEST_LINE + sink_bytes::<f64>();
        let work = |unit: usize, sink: &mut Sink<'_, f64>| {
            let start = self.start + unit as u64 * SLAB;
            let lines = Lines::read(input, self.start, start)?;
            for (at, line) in lines.iter() {
                take(input, self, target.wanted, (at, line), sink)?;
            }
            Ok(())
        };
        let slabs = usize::try_from(slabs).unwrap_or(usize::MAX);
        target.units("text lines", slabs, |_| memory, work)?;
        let stats = target.stats();
        if self.counted && stats.claimed > stats.read {
            return Err(input.error(
                "count line",
                format!("{} points", stats.claimed),
                format!("at most {}, the number of lines with a point", stats.read),
            ));
        }
        Ok(Vec::new())
    }
}

fn take(
    input: &Input,
    dialect: &Dialect,
    wanted: &Wanted,
    (at, line): (u64, &[u8]),
    sink: &mut Sink<'_, f64>,
) -> Result<()> {
    match dialect.row(line, &mut sink.stats.decimals) {
        Row::Blank => {}
        Row::Point(point) => {
            sink.push_with(point, |values| dialect.values(line, wanted, values))?;
        }
        Row::Count(count) => {
            sink.stats.claimed = sink.stats.claimed.saturating_add(count);
        }
        Row::Wrong(found) => {
            let place = format!("line {}", lines::number_of(input, at)?);
            let expected = format!("three coordinates, {}", dialect.separator.describe());
            return Err(input.error(place, found, expected));
        }
    }
    Ok(())
}
