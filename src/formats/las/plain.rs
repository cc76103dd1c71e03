//! Uncompressed LAS: slabs of records, converted on all threads.

use super::super::input::Input;
use super::fields::Fields;
use super::{Header, Record};
use outcrop_disk::error::Result;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Bytes of records read at a time.
const SLAB: u64 = 2 << 20;

pub(super) fn read(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    let mut warnings = Vec::new();
    let record_bytes = u64::from(header.record_bytes);
    let points = count(input, header, &mut warnings)?;
    let rows = (SLAB / record_bytes).max(1);
    let units = usize::try_from(points.div_ceil(rows)).unwrap_or(usize::MAX);
    let fields = Fields::of(header, writer.wanted);
    let record = Record::of(header, writer.classes, &fields);
    let memory = rows * record_bytes + sink_bytes::<i32>();
    writer.units(
        "LAS records",
        units,
        |_| memory,
        |unit, sink: &mut Sink<'_, i32>| {
            let first = unit as u64 * rows;
            let rows = rows.min(points - first);
            let what = format!("records {first} to {}", first + rows - 1);
            let (start, bytes) = (header.data + first * record_bytes, rows * record_bytes);
            let slab = input.window(start, bytes as usize, &what)?;
            for bytes in slab.chunks_exact(header.record_bytes.into()) {
                record.take(bytes, sink)?;
            }
            Ok(())
        },
    )?;
    Ok(warnings)
}

/// Number of points to read: that of the header, if the file contains them.
fn count(input: &Input, header: &Header, warnings: &mut Vec<String>) -> Result<u64> {
    let record_bytes = u64::from(header.record_bytes);
    let until = |end: u64| (end - header.data) / record_bytes;
    // If extended records or waveforms seem to start inside the points, their offset is wrong.
    let present = if header.claimed > until(header.data_end) {
        until(input.bytes)
    } else {
        until(header.data_end)
    };
    let claimed = header.claimed;
    if claimed > present {
        return Err(input.error(
            "point count in the header",
            format!("{claimed} points"),
            format!(
                "at most the {present} records of {record_bytes} bytes between byte {} and the end \
                 of the file at byte {}",
                header.data, input.bytes
            ),
        ));
    }
    let left = header
        .data_end
        .saturating_sub(header.data + claimed * record_bytes);
    let whole_records = left > 0 && left.is_multiple_of(record_bytes);
    if claimed == 0 && whole_records {
        // A writer that was interrupted did not fill in the count.
        warnings.push(format!(
            "the header claims 0 points, the {present} records in the file are read"
        ));
        return Ok(present);
    }
    if whole_records {
        warnings.push(format!(
            "{} records after the {claimed} points that the header claims are not read",
            left / record_bytes
        ));
    }
    Ok(claimed)
}
