//! The points of PCD files: lines, records, or fields one after another.

use super::super::input::{Input, u32_at};
use super::super::lines::{self, LONGEST_LINE, Lines, SLAB as LINES};
use super::super::number;
use super::super::scalar::FromScalar;
use super::super::spool::{Sink, SourceWriter, sink_bytes};
use super::header::{Field, Header, Number};
use super::lzf::{self, Stream};
use crate::error::Result;

/// Bytes of records read at a time.
const SLAB: u64 = 2 << 20;

/// Points of a compressed file that are put together at a time.
const BLOCK: usize = 4096;

/// Bytes before compressed data: two sizes.
const SIZES: u64 = 8;

/// The values of a point in a record: place and type of x, y and z.
#[derive(Debug, Clone, Copy)]
struct Record([(usize, Number); 3]);

impl Record {
    /// Passes a point on.
    #[inline]
    fn take<T: FromScalar>(&self, record: &[u8], sink: &mut Sink<'_, T>) -> Result<()> {
        let coordinate = |(at, number): (usize, Number)| number.value(&record[at..]);
        sink.push(self.0.map(|place| T::from_double(coordinate(place))))
    }
}

/// Reads one record after another.
pub(super) fn binary<T: FromScalar>(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let (count, bytes) = (header.points, header.record_bytes(true));
    let present = input.bytes.saturating_sub(header.data) / bytes;
    if count > present {
        return Err(input.error(
            "PCD header",
            format!("{count} points"),
            format!(
                "at most the {present} records of {bytes} bytes between byte {} and the end of \
                 the file at byte {}",
                header.data, input.bytes
            ),
        ));
    }
    if count == 0 {
        return Ok(());
    }
    let place = |axis: usize| {
        let at = header.before(axis, Field::bytes) as usize;
        (at, header.fields[axis].number)
    };
    let record = Record(header.axes.map(place));
    let rows = (SLAB / bytes).max(1);
    let units = usize::try_from(count.div_ceil(rows)).unwrap_or(usize::MAX);
    let memory = rows * bytes + sink_bytes::<T>();
    let work = |unit: usize, sink: &mut Sink<'_, T>| {
        let first = unit as u64 * rows;
        let rows = rows.min(count - first);
        let what = format!("points {first} to {}", first + rows - 1);
        let start = header.data + first * bytes;
        let slab = input.window(start, (rows * bytes) as usize, &what)?;
        for bytes in slab.chunks_exact(bytes as usize) {
            record.take(bytes, sink)?;
        }
        Ok(())
    };
    writer.units("PCD records", units, |_| memory, work)
}

/// Reads lines; the numbers are taken as they are written.
pub(super) fn text(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    let slabs = input.bytes.saturating_sub(header.data).div_ceil(LINES);
    let slabs = usize::try_from(slabs).unwrap_or(usize::MAX);
    let memory = LINES + LONGEST_LINE + sink_bytes::<f64>();
    let columns = header.axes.map(|axis| header.before(axis, |f| f.count));
    let all = header.before(header.fields.len(), |f| f.count);
    let work = |unit: usize, sink: &mut Sink<'_, f64>| {
        let lines = Lines::read(input, header.data, header.data + unit as u64 * LINES)?;
        for (at, line) in lines.iter() {
            match point(line, columns, &mut sink.stats.decimals) {
                Some(Ok(point)) => sink.push(point)?,
                Some(Err(found)) => {
                    let place = format!("line {}", lines::number_of(input, at)?);
                    return Err(input.error(place, found, format!("{all} numbers")));
                }
                None => {}
            }
        }
        Ok(())
    };
    writer.units("PCD lines", slabs, |_| memory, work)?;
    let (claimed, present) = (header.points, writer.stats().read);
    if claimed > present {
        return Err(input.error(
            "PCD header",
            format!("{claimed} points"),
            format!("at most {present}, the number of lines after it"),
        ));
    }
    let more = present > claimed;
    let warning = format!("the header claims {claimed} points, the {present} in the file are read");
    Ok(more.then_some(warning).into_iter().collect())
}

/// The point in a line; none if the line is blank, and the words found if they are no point.
fn point(
    line: &[u8],
    columns: [u64; 3],
    decimals: &mut u32,
) -> Option<std::result::Result<[f64; 3], String>> {
    let line = line.trim_ascii();
    if line.is_empty() {
        return None;
    }
    let separates = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';');
    let words = line.split(separates).filter(|word| !word.is_empty());
    let last = columns.into_iter().max().unwrap_or(0);
    let (mut point, mut found) = ([0.0; 3], 0);
    for (column, word) in (0..=last).zip(words) {
        let Some(axis) = columns.iter().position(|c| *c == column) else {
            continue;
        };
        let Some(value) = number::parse(word, false, decimals) else {
            break;
        };
        point[axis] = value;
        found += 1;
    }
    let shown = &line[..line.len().min(60)];
    Some(match found == 3 {
        true => Ok(point),
        false => Err(format!("\"{}\"", shown.escape_ascii())),
    })
}

/// Reads fields one after another, each from a stream of its own that begins at the field.
pub(super) fn compressed<T: FromScalar>(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let (packed, content) = sizes(input, header)?;
    let points = header.points;
    let padding = match content {
        0 if points == 0 => return Ok(()),
        all if Some(all) == points.checked_mul(header.record_bytes(false)) => false,
        all if Some(all) == points.checked_mul(header.record_bytes(true)) => true,
        _ => {
            let bytes = header.record_bytes(false);
            let expected = format!("{points} points of {bytes} bytes");
            let place = format!("size of the content at byte {}", header.data + 4);
            return Err(input.error(place, format!("{content} bytes"), expected));
        }
    };
    let start = header.data + SIZES;
    let mut order = header.axes;
    order.sort_unstable();
    let buffers = order.map(|f| header.fields[f].number.bytes() as usize * BLOCK);
    let all: usize = buffers.iter().sum();
    let memory = 4 * lzf::MEMORY + 2 * all as u64 + sink_bytes::<T>();
    writer.whole("PCD fields", memory, |sink: &mut Sink<'_, T>| {
        let cancel = || writer.workspace.check_cancel();
        let mut stream = Stream::new(input, start, start + packed);
        let mut at = 0;
        let mut columns = Vec::with_capacity(order.len());
        for field in order {
            let bytes = |f: &Field| match padding || !f.is_padding() {
                true => f.bytes(),
                false => 0,
            };
            let begin = header.before(field, bytes) * points;
            stream.skip(begin - at, cancel)?;
            at = begin;
            columns.push((stream.fork(), header.fields[field].number));
        }
        let places = header.axes.map(|axis| {
            let before = order.iter().take_while(|field| **field != axis);
            let at: u64 = before.map(|f| header.fields[*f].number.bytes()).sum();
            (at as usize, header.fields[axis].number)
        });
        together(&mut columns, Record(places), points, sink)
    })
}

/// Puts the values of the columns together to records of points.
fn together<T: FromScalar>(
    columns: &mut [(Stream<'_>, Number)],
    record: Record,
    points: u64,
    sink: &mut Sink<'_, T>,
) -> Result<()> {
    let bytes: usize = columns.iter().map(|c| c.1.bytes() as usize).sum();
    let mut records = vec![0; bytes * BLOCK];
    let mut column = vec![0; 8 * BLOCK];
    let mut left = points;
    while left > 0 {
        let count = BLOCK.min(usize::try_from(left).unwrap_or(BLOCK));
        let mut at = 0;
        for (stream, number) in columns.iter_mut() {
            let size = number.bytes() as usize;
            stream.read(&mut column[..count * size])?;
            let values = column.chunks_exact(size);
            for (record, value) in records.chunks_exact_mut(bytes).zip(values).take(count) {
                record[at..at + size].copy_from_slice(value);
            }
            at += size;
        }
        for bytes in records.chunks_exact(bytes).take(count) {
            record.take(bytes, sink)?;
        }
        left -= count as u64;
    }
    Ok(())
}

/// The number of compressed bytes, and of bytes of content.
fn sizes(input: &Input, header: &Header) -> Result<(u64, u64)> {
    let mut head = [0; SIZES as usize];
    input.read_exact_at(header.data, &mut head, "sizes of the compressed data")?;
    let (packed, content) = (u64::from(u32_at(&head, 0)), u64::from(u32_at(&head, 4)));
    let present = input.bytes.saturating_sub(header.data + SIZES);
    if packed > present {
        return Err(input.error(
            format!("size of the compressed data at byte {}", header.data),
            format!("{packed} bytes"),
            format!("at most {present}, the rest of the file"),
        ));
    }
    let most = packed * lzf::MOST_PER_BYTE;
    if content > most {
        return Err(input.error(
            format!("size of the content at byte {}", header.data + 4),
            format!("{content} bytes in {packed} compressed ones"),
            format!("at most {most}"),
        ));
    }
    Ok((packed, content))
}
