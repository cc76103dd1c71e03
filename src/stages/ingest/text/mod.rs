//! Lines of numbers: XYZ, TXT, CSV, PTS.

pub(super) mod dialect;
mod lines;
pub(super) mod number;

use super::input::Input;
use super::spool::{Sink, SourceWriter, sink_bytes};
use crate::error::{Error, Result};
use dialect::{Dialect, Row};
use lines::{LONGEST_LINE, Lines, SLAB};

/// Reads a text file into the spool; returns what the user should know.
pub(super) fn read(
    input: &Input,
    dialect: &Dialect,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    let slabs = input.bytes.saturating_sub(dialect.start).div_ceil(SLAB);
    let memory = SLAB + LONGEST_LINE + sink_bytes::<f64>();
    writer.units(
        "text lines",
        usize::try_from(slabs).unwrap_or(usize::MAX),
        |_| memory,
        |unit| {
            let start = dialect.start + unit as u64 * SLAB;
            let lines = Lines::read(input, dialect.start, start)?;
            let mut sink = writer.sink::<f64>();
            for (at, line) in lines.iter() {
                take(input, dialect, at, line, &mut sink)?;
            }
            sink.finish()
        },
    )?;
    Ok(Vec::new())
}

/// Compares the points read with those that PTS count lines claim.
pub(super) fn check_claim(input: &Input, dialect: &Dialect, claimed: u64, read: u64) -> Result<()> {
    if dialect.counted && claimed > read {
        return Err(input.error(
            "count line",
            format!("{claimed} points"),
            format!("at most {read}, the number of lines with a point"),
        ));
    }
    Ok(())
}

fn take(
    input: &Input,
    dialect: &Dialect,
    at: u64,
    line: &[u8],
    sink: &mut Sink<'_, f64>,
) -> Result<()> {
    match dialect.row(line, &mut sink.stats.decimals) {
        Row::Blank => Ok(()),
        Row::Point(point) => sink.push(point),
        Row::Count(count) => {
            sink.stats.claimed = sink.stats.claimed.saturating_add(count);
            Ok(())
        }
        Row::Wrong(found) => Err(wrong_row(input, dialect, at, found)),
    }
}

fn wrong_row(input: &Input, dialect: &Dialect, at: u64, found: String) -> Error {
    match lines::number_of(input, at) {
        Ok(number) => input.error(
            format!("line {number}"),
            found,
            format!("three coordinates, {}", dialect.separator.describe()),
        ),
        Err(e) => e,
    }
}
