//! PLY with numbers as text, one record in a line.

use super::super::input::{Input, Range, STREAM_BUFFER};
use super::super::scalar::FromScalar;
use super::{Cloud, Taken, Vertex, position};
use outcrop_disk::error::{Error, Result};
use outcrop_ply::Property;
use outcrop_points::number;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};
use std::io::{BufRead, BufReader};

/// Longest accepted line, in bytes.
const LONGEST_LINE: usize = 1 << 20;

pub(super) fn read<T: FromScalar>(
    input: &Input,
    cloud: &Cloud,
    vertex: &Vertex,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let memory = sink_bytes::<T>() + (STREAM_BUFFER + LONGEST_LINE) as u64;
    writer.whole("PLY lines", memory, |sink| {
        vertices::<T>(input, cloud, vertex, writer, sink)
    })
}

fn vertices<T: FromScalar>(
    input: &Input,
    cloud: &Cloud,
    vertex: &Vertex,
    writer: &SourceWriter<'_>,
    sink: &mut Sink<'_, T>,
) -> Result<()> {
    let mut lines = Lines {
        input,
        source: input.stream(cloud.data, input.bytes),
        line: Vec::new(),
        at: cloud.data,
    };
    for element in &cloud.before {
        for number in 0..element.count {
            if number % 65536 == 0 {
                writer.workspace.check_cancel()?;
            }
            lines.next(&element.name, number, element.count)?;
        }
    }
    let columns = vertex.wanted(writer.wanted);
    let mut others = vec![f64::NAN; columns.len()];
    // An origin with more decimals than the numbers of the points.
    let moved = vertex.place.and_then(|place| place.origin());
    sink.stats.decimals = moved.map_or(0, decimals_of);
    for number in 0..vertex.element.count {
        lines.next("vertex", number, vertex.element.count)?;
        let decimals = &mut sink.stats.decimals;
        let point = lines.point(vertex, number, decimals, &columns, &mut others)?;
        let point = match moved {
            None => point,
            Some(_) => vertex.position(point.map(Into::into)).map(T::from_double),
        };
        sink.push_with(point, |values| {
            for (value, taken) in others.iter().zip(&columns) {
                taken.put(*value, values);
            }
        })?;
    }
    Ok(())
}

/// Decimals of the coordinates of an origin.
fn decimals_of(origin: [f64; 3]) -> u32 {
    let mut decimals = 0;
    for coordinate in origin {
        // Displayed without an exponent, and with no more digits than tell it from others.
        number::parse(coordinate.to_string().as_bytes(), false, &mut decimals);
    }
    decimals
}

struct Lines<'a> {
    input: &'a Input,
    source: BufReader<Range<'a>>,
    line: Vec<u8>,
    /// Offset of the line.
    at: u64,
}

impl Lines<'_> {
    /// Reads the next line that is not blank.
    fn next(&mut self, element: &str, number: u64, count: u64) -> Result<()> {
        let wrong = |input: &Input, at: u64, found: &str| {
            Err(input.error(
                format!("{element} {number} at byte {at}"),
                found,
                format!("{count} lines of element {element}"),
            ))
        };
        self.line.clear();
        loop {
            self.at = position(&self.source);
            let buffer = match self.source.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) => return Err(Error::io(&self.input.path, "read a line", e)),
            };
            if buffer.is_empty() {
                if self.line.trim_ascii().is_empty() {
                    return wrong(self.input, self.at, "the end of the file");
                }
                return Ok(());
            }
            let end = buffer.iter().position(|b| matches!(b, b'\n' | b'\r'));
            let taken = end.unwrap_or(buffer.len());
            if self.line.len() + taken > LONGEST_LINE {
                return wrong(self.input, self.at, "a line of more than 1 MiB");
            }
            self.line.extend_from_slice(&buffer[..taken]);
            self.source.consume(taken + usize::from(end.is_some()));
            if end.is_some() {
                if !self.line.trim_ascii().is_empty() {
                    return Ok(());
                }
                self.line.clear();
            }
        }
    }

    /// The point in the line, with the values of `columns` in `others`: NaN for what is no number.
    fn point<T: FromScalar>(
        &self,
        vertex: &Vertex,
        number: u64,
        decimals: &mut u32,
        columns: &[Taken],
        others: &mut [f64],
    ) -> Result<[T; 3]> {
        let mut point = [T::from_double(0.0); 3];
        others.fill(f64::NAN);
        let mut words = self
            .line
            .split(u8::is_ascii_whitespace)
            .filter(|w| !w.is_empty());
        let mut found = 0;
        for (column, (_, property)) in vertex.element.properties.iter().enumerate() {
            let Some(word) = words.next() else {
                break;
            };
            if let Property::List { .. } = property {
                let mut none = 0;
                let items = number::parse(word, false, &mut none);
                let Some(items) = items.filter(|n| *n >= 0.0 && n.fract() == 0.0) else {
                    break;
                };
                for _ in 0..items as u64 {
                    if words.next().is_none() {
                        break;
                    }
                }
            }
            if let Some(axis) = vertex.coordinates.iter().position(|c| c.0 == column) {
                let Some(value) = T::parse(word, decimals) else {
                    break;
                };
                point[axis] = value;
                found += 1;
            } else if let Some(at) = columns.iter().position(|c| c.field.0 == column) {
                let mut none = 0;
                others[at] = number::parse(word, false, &mut none).unwrap_or(f64::NAN);
            }
        }
        if found == 3 {
            return Ok(point);
        }
        let shown = &self.line[..self.line.len().min(60)];
        Err(self.input.error(
            format!(
                "vertex {number}, line before byte {}",
                position(&self.source)
            ),
            format!("\"{}\"", shown.escape_ascii()),
            format!("{} numbers", vertex.element.properties.len()),
        ))
    }
}
