//! LAZ: chunks are decoded on all threads if their offsets are known, else one after another.

use super::super::input::{Input, STREAM_BUFFER};
use super::chunks::Decoder;
use super::fields::Fields;
use super::head::LayerHead;
use super::laszip::{self, Laszip};
use super::table::{self, Chunk, Table};
use super::{Header, Record, skip};
use laz::LazItemType;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Memory of the decoder's models, without those of extra bytes.
const MODELS: u64 = 1 << 20;
/// Memory of the models of one extra byte: 256 symbols with their tables, in layers for each of four channels.
const MODELS_PER_BYTE: u64 = 4 << 10;
const MODELS_PER_BYTE_IN_LAYERS: u64 = 4 * MODELS_PER_BYTE;
/// Chunks of whole points up to this size are read into memory first.
const IN_MEMORY: u64 = 8 << 20;
/// Most points for each byte of a file, and number of points that is always accepted. Scans take several
/// bytes for a point; rows of a grid, or identical points, take a twenty-fifth of a byte, so a small file
/// could claim any number.
const PER_BYTE: u64 = 64;
const FEW: u64 = 1 << 23;

pub(super) fn read(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    let mut warnings = Vec::new();
    let workspace = writer.workspace;
    let laszip = laszip::read(input, header)?;
    if header.claimed == 0 && header.data + 8 > input.bytes {
        return Ok(warnings);
    }
    plausible(input, header.claimed)?;
    let fields = Fields::of(header, writer.wanted);
    let decoder = Decoder {
        input,
        header,
        laszip: &laszip,
        record: Record::of(header, writer.classes, &fields),
    };
    let mut table = match chunks(input, header, &laszip, workspace)? {
        Some(table) => table,
        None => {
            input.expect(std::iter::once(header.data..input.bytes), workspace)?;
            one_by_one(&decoder, writer)?;
            return Ok(warnings);
        }
    };
    limit(input, header, &laszip, &mut table, &mut warnings)?;
    warnings.extend(skip::outside(input, header, &mut table.chunks, writer)?);
    let parts = table.chunks.iter().map(|c| c.at..c.at + c.bytes);
    input.expect(parts, workspace)?;
    in_parallel(&decoder, &table.chunks, writer)?;
    Ok(warnings)
}

/// The chunks; none if they are only known after the points before them have been decoded.
fn chunks(
    input: &Input,
    header: &Header,
    laszip: &Laszip,
    workspace: &Workspace,
) -> Result<Option<Table>> {
    let table = match laszip.stream {
        true => None,
        false => table::read(input, header, laszip, workspace)?,
    };
    match table {
        None if header.format.is_extended => {
            table::walk(input, header, laszip, workspace).map(Some)
        }
        table => Ok(table),
    }
}

/// The chunks of a small file with their points, which must be known.
pub(super) fn table_of(
    input: &Input,
    header: &Header,
    laszip: &Laszip,
    workspace: &Workspace,
    warnings: &mut Vec<String>,
) -> Result<Table> {
    let Some(mut table) = chunks(input, header, laszip, workspace)? else {
        return Err(input.error("chunk table", "none", "one"));
    };
    limit(input, header, laszip, &mut table, warnings)?;
    Ok(table)
}

/// Rejects a number of points that is impossible for the size of the file.
pub(super) fn plausible(input: &Input, points: u64) -> Result<()> {
    let most = FEW + PER_BYTE * input.bytes;
    if points <= most {
        return Ok(());
    }
    Err(input.error(
        "point count",
        format!("{points} points in {} compressed bytes", input.bytes),
        format!("at most {most}; if they are really so much alike, give them as LAS"),
    ))
}

/// Memory of the models for all items.
fn models(laszip: &Laszip) -> u64 {
    let extra = laszip.items.iter().map(|item| match item.item_type() {
        LazItemType::Byte(bytes) => u64::from(bytes) * MODELS_PER_BYTE,
        LazItemType::Byte14(bytes) => u64::from(bytes) * MODELS_PER_BYTE_IN_LAYERS,
        _ => 0,
    });
    MODELS + extra.sum::<u64>()
}

fn in_parallel(decoder: &Decoder<'_>, chunks: &[Chunk], writer: &SourceWriter<'_>) -> Result<()> {
    let fixed = models(decoder.laszip) + sink_bytes::<i32>();
    let layered = decoder.header.format.is_extended;
    let memory = |unit: usize| {
        let bytes = chunks[unit].bytes;
        fixed
            + match layered || bytes <= IN_MEMORY {
                true => bytes,
                false => STREAM_BUFFER as u64,
            }
    };
    let work = |unit: usize, sink: &mut Sink<'_, i32>| {
        let chunk = chunks[unit];
        if layered {
            decoder.layers(chunk, sink)?;
        } else if chunk.bytes <= IN_MEMORY {
            let size = chunk.bytes as usize;
            let bytes = decoder.input.window(chunk.at, size, "LAZ chunk")?;
            decoder.stream(&bytes[..], chunk.at, chunk.points, sink)?;
        } else {
            let source = decoder.input.stream(chunk.at, chunk.at + chunk.bytes);
            decoder.stream(source, chunk.at, chunk.points, sink)?;
        }
        Ok(())
    };
    writer.units("LAZ chunks", chunks.len(), memory, work)
}

/// Decodes a file in which the offset of a chunk is only known after the previous one has been decoded.
fn one_by_one(decoder: &Decoder<'_>, writer: &SourceWriter<'_>) -> Result<()> {
    let (input, header) = (decoder.input, decoder.header);
    let (start, per_chunk) = match (decoder.laszip.stream, decoder.laszip.chunk_points) {
        (true, _) => (header.data, u64::MAX),
        (_, Some(points)) => (header.data + 8, points),
        (_, None) => {
            return Err(input.error(
                format!("offset of the chunk table at byte {}", header.data),
                "no chunk table",
                "one, for the chunks are of different sizes",
            ));
        }
    };
    let memory = models(decoder.laszip) + sink_bytes::<i32>() + STREAM_BUFFER as u64;
    writer.whole("LAZ stream", memory, |sink: &mut Sink<'_, i32>| {
        let mut at = start;
        let mut source = input.stream(at, input.bytes);
        let mut left = header.claimed;
        while left > 0 {
            let points = left.min(per_chunk);
            source = decoder.stream(source, at, points, sink)?;
            at = source.get_ref().at - source.buffer().len() as u64;
            left -= points;
        }
        Ok(())
    })
}

/// Limits the points of the chunks to the number given in the header.
fn limit(
    input: &Input,
    header: &Header,
    laszip: &Laszip,
    table: &mut Table,
    warnings: &mut Vec<String>,
) -> Result<()> {
    let claimed = header.claimed;
    let layered = header.format.is_extended;
    if claimed == 0 && layered {
        // Each chunk has its own number of points.
        for chunk in &mut table.chunks {
            chunk.points = LayerHead::read(input, header, laszip, chunk.at)?.points;
        }
    }
    let present: u64 = table.chunks.iter().map(|c| c.points).sum();
    if claimed > present {
        return Err(input.error(
            "point count in the header",
            format!("{claimed} points"),
            format!(
                "at most {present}, those of the {} chunks",
                table.chunks.len()
            ),
        ));
    }
    // With chunks of fixed size, the number of points in the last one only follows from the header.
    let counted = laszip.chunk_points.is_none();
    if claimed == 0 && present > 0 {
        if !layered && !counted {
            return Err(input.error(
                "point count in the header",
                "0 points",
                format!("the number of points in the {} chunks", table.chunks.len()),
            ));
        }
        warnings.push(format!(
            "the header claims 0 points, the {present} in the chunks are read"
        ));
        return plausible(input, present);
    }
    let full = laszip.chunk_points.unwrap_or(1);
    if present - claimed >= full {
        let about = if counted { "" } else { "up to " };
        warnings.push(format!(
            "{about}{} points after the {claimed} that the header claims are not read",
            present - claimed
        ));
    }
    let mut left = claimed;
    for chunk in &mut table.chunks {
        chunk.points = chunk.points.min(left);
        left -= chunk.points;
    }
    table.chunks.retain(|c| c.points > 0);
    Ok(())
}
