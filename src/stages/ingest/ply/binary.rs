//! Binary PLY: slabs of records on all threads, or one by one where vertices hold lists.

use super::super::input::{Input, Range, STREAM_BUFFER};
use super::super::spool::{SourceWriter, sink_bytes};
use super::FromScalar;
use super::header::{Body, Header, Property, Scalar, Vertex};
use crate::error::{Error, Result};
use std::io::{BufReader, Read};

/// Bytes of records read at one time.
const SLAB: u64 = 2 << 20;

/// Bytes of a record of these properties, if it is fixed.
fn record_bytes(properties: &[Property]) -> Option<u64> {
    properties
        .iter()
        .map(|p| match p {
            Property::One(scalar) => Some(scalar.bytes() as u64),
            Property::List { .. } => None,
        })
        .sum()
}

fn scalar<T: FromScalar>(bytes: &[u8], kind: Scalar, body: Body) -> T {
    let mut word = [0u8; 8];
    let bytes = &bytes[..kind.bytes()];
    word[..bytes.len()].copy_from_slice(bytes);
    if body == Body::Big {
        word[..bytes.len()].reverse();
    }
    let value = u64::from_le_bytes(word);
    match kind {
        Scalar::F32 => T::from_single(f32::from_bits(value as u32)),
        Scalar::F64 => T::from_double(f64::from_bits(value)),
        Scalar::I8 => T::from_double(f64::from(value as i8)),
        Scalar::U8 => T::from_double(f64::from(value as u8)),
        Scalar::I16 => T::from_double(f64::from(value as i16)),
        Scalar::U16 => T::from_double(f64::from(value as u16)),
        Scalar::I32 => T::from_double(f64::from(value as i32)),
        Scalar::U32 => T::from_double(f64::from(value as u32)),
    }
}

pub(super) fn read<T: FromScalar>(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let Some(vertex) = &header.vertex else {
        return Ok(());
    };
    let start = skip_elements(input, header, writer)?;
    match record_bytes(&vertex.properties) {
        Some(bytes) => fixed::<T>(input, header.body, vertex, start, bytes, writer),
        None => one_by_one::<T>(input, header.body, vertex, start, writer),
    }
}

/// Where the vertices start.
fn skip_elements(input: &Input, header: &Header, writer: &SourceWriter<'_>) -> Result<u64> {
    let mut at = header.data;
    for element in &header.before {
        if let Some(bytes) = record_bytes(&element.properties) {
            let end = bytes
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
        let mut records = Records::new(input, header.body, at);
        for number in 0..element.count {
            if number % 65536 == 0 {
                writer.workspace.check_cancel()?;
            }
            records
                .skip(&element.properties)
                .map_err(|e| records.error(&element.name, number, element.count, e))?;
        }
        at = records.position();
    }
    Ok(at)
}

fn fixed<T: FromScalar>(
    input: &Input,
    body: Body,
    vertex: &Vertex,
    start: u64,
    bytes: u64,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let present = (input.bytes - start) / bytes;
    if vertex.count > present {
        return Err(input.error(
            "PLY header, element vertex",
            format!("{} vertices", vertex.count),
            format!(
                "at most the {present} records of {bytes} bytes between byte {start} and the end \
                 of the file at byte {}",
                input.bytes
            ),
        ));
    }
    let places = vertex.coordinates.map(|(number, kind)| {
        let before = record_bytes(&vertex.properties[..number]).unwrap_or(0);
        (before as usize, kind)
    });
    let rows = (SLAB / bytes).max(1);
    let units = usize::try_from(vertex.count.div_ceil(rows)).unwrap_or(usize::MAX);
    let memory = rows * bytes + sink_bytes::<T>();
    let work = |unit: usize| {
        let first = unit as u64 * rows;
        let rows = rows.min(vertex.count - first);
        let mut slab = vec![0u8; (rows * bytes) as usize];
        let what = format!("vertices {first} to {}", first + rows - 1);
        input.read_exact_at(start + first * bytes, &mut slab, &what)?;
        let mut sink = writer.sink::<T>();
        for record in slab.chunks_exact(bytes as usize) {
            sink.push(places.map(|(at, kind)| scalar(&record[at..], kind, body)))?;
        }
        sink.finish()
    };
    writer.units("PLY vertices", units, |_| memory, work)
}

fn one_by_one<T: FromScalar>(
    input: &Input,
    body: Body,
    vertex: &Vertex,
    start: u64,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let memory = sink_bytes::<T>() + STREAM_BUFFER as u64;
    writer.whole("PLY vertices", memory, || {
        let mut records = Records::new(input, body, start);
        let mut sink = writer.sink::<T>();
        for number in 0..vertex.count {
            let point = records
                .point(vertex)
                .map_err(|e| records.error("vertex", number, vertex.count, e))?;
            sink.push(point)?;
        }
        sink.finish()
    })
}

/// Reads records with lists, one after the other.
struct Records<'a> {
    input: &'a Input,
    body: Body,
    source: BufReader<Range<'a>>,
}

impl<'a> Records<'a> {
    fn new(input: &'a Input, body: Body, at: u64) -> Self {
        Self {
            input,
            body,
            source: input.stream(at, input.bytes),
        }
    }

    fn position(&self) -> u64 {
        self.source.get_ref().position() - self.source.buffer().len() as u64
    }

    fn scalar<T: FromScalar>(&mut self, kind: Scalar) -> std::io::Result<T> {
        let mut bytes = [0u8; 8];
        self.source.read_exact(&mut bytes[..kind.bytes()])?;
        Ok(scalar(&bytes, kind, self.body))
    }

    fn skip_property(&mut self, property: Property) -> std::io::Result<()> {
        match property {
            Property::One(kind) => self.scalar::<f64>(kind).map(|_| ()),
            Property::List { count, item } => {
                let count = self.scalar::<f64>(count)?;
                if count < 0.0 {
                    return Err(std::io::Error::other(format!("a list of {count} items")));
                }
                let bytes = count as u64 * item.bytes() as u64;
                let skipped =
                    std::io::copy(&mut self.source.by_ref().take(bytes), &mut std::io::sink())?;
                if skipped < bytes {
                    return Err(std::io::ErrorKind::UnexpectedEof.into());
                }
                Ok(())
            }
        }
    }

    fn skip(&mut self, properties: &[Property]) -> std::io::Result<()> {
        properties.iter().try_for_each(|p| self.skip_property(*p))
    }

    fn point<T: FromScalar>(&mut self, vertex: &Vertex) -> std::io::Result<[T; 3]> {
        let mut point = [T::from_single(0.0); 3];
        for (number, property) in vertex.properties.iter().enumerate() {
            let axis = vertex.coordinates.iter().position(|c| c.0 == number);
            match (axis, *property) {
                (Some(axis), Property::One(kind)) => point[axis] = self.scalar(kind)?,
                (_, property) => self.skip_property(property)?,
            }
        }
        Ok(point)
    }

    fn error(&self, element: &str, number: u64, count: u64, error: std::io::Error) -> Error {
        let found = if error.kind() == std::io::ErrorKind::UnexpectedEof {
            "the end of the file".to_owned()
        } else {
            error.to_string()
        };
        self.input.error(
            format!("{element} {number} at byte {}", self.position()),
            found,
            format!("{count} records of element {element}"),
        )
    }
}
