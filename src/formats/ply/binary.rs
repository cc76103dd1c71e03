//! Binary PLY: slabs of records on all threads, or one record after another if vertices contain lists.

use super::super::input::{Input, Range, STREAM_BUFFER};
use super::super::scalar::FromScalar;
use super::{Cloud, Vertex, position};
use outcrop_disk::error::{Error, Result};
use outcrop_ply::{Encoding, Field, Numbers, real};
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};
use std::io::BufReader;

/// Bytes of records read at a time.
const SLAB: u64 = 2 << 20;

pub(super) fn read<T: FromScalar>(
    input: &Input,
    cloud: &Cloud,
    vertex: &Vertex,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let start = skip_elements(input, cloud, writer)?;
    match vertex.element.record_bytes() {
        Some(bytes) => fixed::<T>(input, cloud.encoding, vertex, start, bytes as u64, writer),
        None => one_by_one::<T>(input, cloud.encoding, vertex, start, writer),
    }
}

/// Offset of the first vertex.
fn skip_elements(input: &Input, cloud: &Cloud, writer: &SourceWriter<'_>) -> Result<u64> {
    let mut at = cloud.data;
    for element in &cloud.before {
        if let Some(bytes) = element.record_bytes() {
            let end = (bytes as u64)
                .checked_mul(element.count)
                .and_then(|b| b.checked_add(at))
                .filter(|end| *end <= input.bytes);
            at = end.ok_or_else(|| {
                input.error(
                    format!("element {} at byte {at}", element.name),
                    format!("{} records of {bytes} bytes", element.count),
                    format!("at most {} bytes, the rest of the file", input.bytes - at),
                )
            })?;
            continue;
        }
        let mut records = Records::new(input, cloud.encoding, at);
        for number in 0..element.count {
            if number % 65536 == 0 {
                writer.workspace.check_cancel()?;
            }
            records
                .numbers
                .skip_entry(element)
                .map_err(|e| records.error(&element.name, number, element.count, e))?;
        }
        at = records.position();
    }
    Ok(at)
}

fn fixed<T: FromScalar>(
    input: &Input,
    encoding: Encoding,
    vertex: &Vertex,
    start: u64,
    bytes: u64,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let count = vertex.element.count;
    let present = (input.bytes - start) / bytes;
    if count > present {
        return Err(input.error(
            "PLY header, element vertex",
            format!("{count} vertices"),
            format!(
                "at most the {present} records of {bytes} bytes between byte {start} and the end \
                 of the file at byte {}",
                input.bytes
            ),
        ));
    }
    let places = vertex
        .coordinates
        .map(|(number, kind)| (vertex.element.bytes_before(number).unwrap_or(0), kind));
    let columns = vertex.wanted(writer.wanted).into_iter();
    let columns: Vec<_> = columns
        .map(|taken| {
            (
                vertex.element.bytes_before(taken.field.0).unwrap_or(0),
                taken,
            )
        })
        .collect();
    let rows = (SLAB / bytes).max(1);
    let units = usize::try_from(count.div_ceil(rows)).unwrap_or(usize::MAX);
    let memory = rows * bytes + sink_bytes::<T>();
    let big = encoding == Encoding::Big;
    let work = |unit: usize, sink: &mut Sink<'_, T>| {
        let first = unit as u64 * rows;
        let rows = rows.min(count - first);
        let what = format!("vertices {first} to {}", first + rows - 1);
        let slab = input.window(start + first * bytes, (rows * bytes) as usize, &what)?;
        for record in slab.chunks_exact(bytes as usize) {
            let local = places.map(|(at, kind)| real(kind, &record[at..], big));
            let point = vertex.position(local).map(T::from_double);
            sink.push_with(point, |values| {
                for (at, taken) in &columns {
                    taken.put(real(taken.field.1, &record[*at..], big), values);
                }
            })?;
        }
        Ok(())
    };
    writer.units("PLY vertices", units, |_| memory, work)
}

fn one_by_one<T: FromScalar>(
    input: &Input,
    encoding: Encoding,
    vertex: &Vertex,
    start: u64,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let count = vertex.element.count;
    let memory = sink_bytes::<T>() + STREAM_BUFFER as u64;
    let columns = vertex.wanted(writer.wanted);
    let fields: Vec<Field> = columns.iter().map(|taken| taken.field).collect();
    writer.whole("PLY vertices", memory, |sink: &mut Sink<'_, T>| {
        let mut records = Records::new(input, encoding, start);
        let mut others = Vec::with_capacity(columns.len());
        for number in 0..count {
            let point = records
                .numbers
                .point_with(&vertex.element, &vertex.coordinates, &fields, &mut others)
                .map_err(|e| records.error("vertex", number, count, e))?;
            let point = vertex.position(point).map(T::from_double);
            sink.push_with(point, |values| {
                for (value, taken) in others.iter().zip(&columns) {
                    taken.put(*value, values);
                }
            })?;
        }
        Ok(())
    })
}

/// Reader of records with lists, one after another.
struct Records<'a> {
    input: &'a Input,
    numbers: Numbers<BufReader<Range<'a>>>,
}

impl<'a> Records<'a> {
    fn new(input: &'a Input, encoding: Encoding, at: u64) -> Self {
        let numbers = Numbers::new(input.stream(at, input.bytes), encoding);
        Self { input, numbers }
    }

    fn position(&self) -> u64 {
        position(&self.numbers.input)
    }

    fn error(&self, element: &str, number: u64, count: u64, found: String) -> Error {
        self.input.error(
            format!("{element} {number} at byte {}", self.position()),
            found,
            format!("{count} records of element {element}"),
        )
    }
}
