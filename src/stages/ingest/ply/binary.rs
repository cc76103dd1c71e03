//! Binary PLY: slabs of records on all threads, or one record after another if vertices contain lists.

use super::super::input::{Input, Range, STREAM_BUFFER};
use super::super::spool::{SourceWriter, sink_bytes};
use super::{Cloud, FromScalar, Vertex};
use crate::error::{Error, Result};
use outcrop_ply::{Element, Encoding, Property, Scalar};
use std::io::{BufReader, Read};

/// Bytes of records read at a time.
const SLAB: u64 = 2 << 20;

fn scalar<T: FromScalar>(bytes: &[u8], kind: Scalar, encoding: Encoding) -> T {
    T::from_double(outcrop_ply::real(kind, bytes, encoding == Encoding::Big))
}

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
                .skip(element)
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
    let rows = (SLAB / bytes).max(1);
    let units = usize::try_from(count.div_ceil(rows)).unwrap_or(usize::MAX);
    let memory = rows * bytes + sink_bytes::<T>();
    let work = |unit: usize| {
        let first = unit as u64 * rows;
        let rows = rows.min(count - first);
        let mut slab = vec![0u8; (rows * bytes) as usize];
        let what = format!("vertices {first} to {}", first + rows - 1);
        input.read_exact_at(start + first * bytes, &mut slab, &what)?;
        let mut sink = writer.sink::<T>();
        for record in slab.chunks_exact(bytes as usize) {
            sink.push(places.map(|(at, kind)| scalar(&record[at..], kind, encoding)))?;
        }
        sink.finish()
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
    writer.whole("PLY vertices", memory, || {
        let mut records = Records::new(input, encoding, start);
        let mut sink = writer.sink::<T>();
        for number in 0..count {
            let point = records
                .point(vertex)
                .map_err(|e| records.error("vertex", number, count, e))?;
            sink.push(point)?;
        }
        sink.finish()
    })
}

/// Reader of records with lists, one after another.
struct Records<'a> {
    input: &'a Input,
    encoding: Encoding,
    source: BufReader<Range<'a>>,
}

impl<'a> Records<'a> {
    fn new(input: &'a Input, encoding: Encoding, at: u64) -> Self {
        Self {
            input,
            encoding,
            source: input.stream(at, input.bytes),
        }
    }

    fn position(&self) -> u64 {
        self.source.get_ref().position() - self.source.buffer().len() as u64
    }

    fn scalar<T: FromScalar>(&mut self, kind: Scalar) -> std::io::Result<T> {
        let mut bytes = [0u8; 8];
        self.source.read_exact(&mut bytes[..kind.bytes()])?;
        Ok(scalar(&bytes, kind, self.encoding))
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

    fn skip(&mut self, element: &Element) -> std::io::Result<()> {
        let mut properties = element.properties.iter();
        properties.try_for_each(|p| self.skip_property(p.1))
    }

    fn point<T: FromScalar>(&mut self, vertex: &Vertex) -> std::io::Result<[T; 3]> {
        let mut point = [T::from_double(0.0); 3];
        for (number, (_, property)) in vertex.element.properties.iter().enumerate() {
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
