//! The points of PCD files: lines, records, or fields one after another.

use super::super::input::{Input, u32_at};
use super::super::lines::{self, LONGEST_LINE, Lines, SLAB as LINES};
use super::super::scalar::FromScalar;
use super::header::{Field, Header, Number};
use super::lzf::{self, Stream};
use super::parts::parts;
use outcrop_disk::error::Result;
use outcrop_ply::Scalar;
use outcrop_points::columns::Wanted;
use outcrop_points::number;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Bytes of records read at a time.
const SLAB: u64 = 2 << 20;

/// Points of a compressed file that are put together at a time.
const BLOCK: usize = 4096;

/// Bytes before compressed data: two sizes.
const SIZES: u64 = 8;

/// The values of a point in a record.
struct Record {
    /// Place and type of x, y and z.
    coordinates: [(usize, Number); 3],
    /// Place and type of the values of wanted columns, and their type in the spool.
    values: Vec<(usize, Number, Scalar)>,
}

impl Record {
    /// A record in which `place` tells the first byte of a field.
    fn of(header: &Header, wanted: &Wanted, place: impl Fn(usize) -> usize) -> Self {
        let parts = parts(header);
        let value = |number: &usize| {
            let part = &parts[*number];
            let at = place(part.field) + part.at;
            (at, part.number, part.column.scalar)
        };
        Self {
            coordinates: header
                .axes
                .map(|axis| (place(axis), header.fields[axis].number)),
            values: wanted.numbers.iter().map(value).collect(),
        }
    }

    /// A record of some fields, one after another.
    fn packed(header: &Header, wanted: &Wanted, fields: &[usize]) -> Self {
        Self::of(header, wanted, |field| {
            let before = fields.iter().take_while(|other| **other != field);
            let bytes = before.map(|other| header.fields[*other].number.bytes());
            bytes.sum::<u64>() as usize
        })
    }

    /// Passes a point on.
    #[inline]
    fn take<T: FromScalar>(&self, record: &[u8], sink: &mut Sink<'_, T>) -> Result<()> {
        let coordinate = |(at, number): (usize, Number)| number.value(&record[at..]);
        let point = self
            .coordinates
            .map(|place| T::from_double(coordinate(place)));
        sink.push_with(point, |values| self.put(record, values))
    }

    /// Appends the values of the wanted columns.
    #[inline]
    fn put(&self, record: &[u8], values: &mut Vec<u8>) {
        for (at, number, scalar) in &self.values {
            scalar.put(number.value(&record[*at..]), values);
        }
    }
}

/// The fields that are read, in the order of the file.
fn fields(header: &Header, wanted: &Wanted) -> Vec<usize> {
    let parts = parts(header);
    let others = wanted.numbers.iter().map(|number| parts[*number].field);
    let mut fields: Vec<usize> = others.chain(header.axes).collect();
    fields.sort_unstable();
    fields.dedup();
    fields
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
    let place = |field: usize| header.before(field, Field::bytes) as usize;
    let record = Record::of(header, writer.wanted, place);
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
    let line = Line::of(header, writer.wanted);
    let work = |unit: usize, sink: &mut Sink<'_, f64>| {
        let lines = Lines::read(input, header.data, header.data + unit as u64 * LINES)?;
        let mut record = vec![0; line.bytes];
        for (at, text) in lines.iter() {
            match line.point(text, &mut record, &mut sink.stats.decimals) {
                Some(Ok(point)) => {
                    sink.push_with(point, |values| line.record.put(&record, values))?;
                }
                Some(Err(found)) => {
                    let place = format!("line {}", lines::number_of(input, at)?);
                    let all = header.before(header.fields.len(), |f| f.count);
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

/// The fields that are read of a line.
struct Line {
    /// Columns of x, y and z.
    axes: [u64; 3],
    /// The other fields: column, type, and place in a record of them.
    others: Vec<(u64, Number, usize)>,
    record: Record,
    /// Bytes of the record.
    bytes: usize,
    /// The last column that is read.
    last: u64,
}

impl Line {
    fn of(header: &Header, wanted: &Wanted) -> Self {
        let column = |field: usize| header.before(field, |f| f.count);
        let mut fields = fields(header, wanted);
        // Coordinates keep their decimals.
        fields.retain(|field| !header.axes.contains(field));
        let record = Record::packed(header, wanted, &fields);
        let (mut others, mut bytes) = (Vec::new(), 0);
        for field in fields {
            let number = header.fields[field].number;
            others.push((column(field), number, bytes));
            bytes += number.bytes() as usize;
        }
        let axes = header.axes.map(column);
        let last = axes.into_iter().chain(others.iter().map(|other| other.0));
        Self {
            last: last.max().unwrap_or(0),
            axes,
            others,
            record,
            bytes,
        }
    }

    /// The point in a line, with its other values in `record`; none if the line is blank, and its begin if it is
    /// no point.
    fn point(
        &self,
        line: &[u8],
        record: &mut [u8],
        decimals: &mut u32,
    ) -> Option<std::result::Result<[f64; 3], String>> {
        let line = line.trim_ascii();
        if line.is_empty() {
            return None;
        }
        let separates = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';');
        let words = line.split(separates).filter(|word| !word.is_empty());
        let (mut point, mut found) = ([0.0; 3], 0);
        for (_, number, at) in &self.others {
            number.put(b"nan", &mut record[*at..]);
        }
        for (column, word) in (0..=self.last).zip(words) {
            if let Some(axis) = self.axes.iter().position(|c| *c == column) {
                let Some(value) = number::parse(word, false, decimals) else {
                    break;
                };
                point[axis] = value;
                found += 1;
            } else if let Some((_, number, at)) = self.others.iter().find(|o| o.0 == column) {
                number.put(word, &mut record[*at..]);
            }
        }
        let shown = &line[..line.len().min(60)];
        Some(match found == 3 {
            true => Ok(point),
            false => Err(format!("\"{}\"", shown.escape_ascii())),
        })
    }
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
    let order = fields(header, writer.wanted);
    let record = Record::packed(header, writer.wanted, &order);
    let bytes: u64 = order.iter().map(|f| header.fields[*f].number.bytes()).sum();
    let streams = order.len() as u64 + 1;
    let memory = streams * lzf::MEMORY + (bytes + 8) * BLOCK as u64 + sink_bytes::<T>();
    writer.whole("PCD fields", memory, |sink: &mut Sink<'_, T>| {
        let cancel = || writer.workspace.check_cancel();
        let mut stream = Stream::new(input, start, start + packed);
        let mut at = 0;
        let mut columns = Vec::with_capacity(order.len());
        for &field in &order {
            let bytes = |f: &Field| match padding || !f.is_padding() {
                true => f.bytes(),
                false => 0,
            };
            let begin = header.before(field, bytes) * points;
            stream.skip(begin - at, cancel)?;
            at = begin;
            columns.push((stream.fork(), header.fields[field].number));
        }
        together(&mut columns, &record, points, sink)
    })
}

/// Puts the values of the columns together to records of points.
fn together<T: FromScalar>(
    columns: &mut [(Stream<'_>, Number)],
    record: &Record,
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
