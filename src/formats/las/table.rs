//! The chunk table: offset and number of points of each chunk.

use super::super::contain::contain;
use super::super::input::{Input, u32_at, u64_at};
use super::Header;
use super::head::LayerHead;
use super::laszip::Laszip;
use laz::laszip::ChunkTable;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;

/// One chunk of compressed points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Offset in the file.
    pub(super) at: u64,
    /// Size in bytes.
    pub(super) bytes: u64,
    /// Number of points to read from it.
    pub(super) points: u64,
}

/// The chunks of a file, and the memory reservation for them.
pub(super) struct Table {
    pub(super) chunks: Vec<Chunk>,
    _memory: Reservation,
}

/// Bytes for one chunk while the table is read: the decoder's entry and our own.
const ENTRY: u64 = (16 + 2 * size_of::<Chunk>()) as u64;

/// Reads the chunk table; `None` if the file has none.
///
/// With chunks of fixed size, the last one is also set to the full number of points.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] if it is damaged, [`outcrop_disk::error::Error::Memory`] if it is too large.
pub(super) fn read(
    input: &Input,
    header: &Header,
    laszip: &Laszip,
    workspace: &Workspace,
) -> Result<Option<Table>> {
    let Some(at) = find(input, header)? else {
        return Ok(None);
    };
    let first = header.data + 8;
    let mut head = [0u8; 8];
    input.read_exact_at(at, &mut head, "chunk table")?;
    let count = u64::from(u32_at(&head, 4));
    // Each chunk starts with an uncompressed record.
    let most = (at - first) / u64::from(header.record_bytes);
    if count > most {
        return Err(input.error(
            format!("chunk table at byte {at}"),
            format!("{count} chunks"),
            format!("at most {most}, for each holds a whole record"),
        ));
    }
    let memory = workspace.reserve("LAZ chunk table", count * ENTRY)?;
    let counted = laszip.chunk_points.is_none();
    let entries = contain(|| ChunkTable::read(&mut input.stream(at, input.bytes), counted));
    let entries = entries.and_then(|r| r.map_err(|e| e.to_string()));
    let entries = entries.map_err(|why| {
        input.error(
            format!("chunk table at byte {at}"),
            why,
            format!("{count} entries"),
        )
    })?;
    let mut chunks = Vec::with_capacity(entries.len());
    let mut start = first;
    for (number, entry) in entries.as_ref().iter().enumerate() {
        // The decoder sign-extends 32-bit sizes.
        let bytes = entry.byte_count & u64::from(u32::MAX);
        let points = laszip
            .chunk_points
            .unwrap_or(entry.point_count & u64::from(u32::MAX));
        if bytes > at - start || (bytes < u64::from(header.record_bytes) && points > 0) {
            return Err(input.error(
                format!("chunk table at byte {at}, entry {number}"),
                format!("a chunk of {bytes} bytes"),
                format!("{} to {} bytes", header.record_bytes, at - start),
            ));
        }
        chunks.push(Chunk {
            at: start,
            bytes,
            points,
        });
        start += bytes;
    }
    Ok(Some(Table {
        chunks,
        _memory: memory,
    }))
}

/// Offset of the chunk table: given at the start of the data or, in files written to a stream, in the last
/// bytes of the file.
fn find(input: &Input, header: &Header) -> Result<Option<u64>> {
    let mut word = [0u8; 8];
    for at in [header.data, input.bytes.saturating_sub(8)] {
        if at < header.data {
            continue;
        }
        input.read_exact_at(at, &mut word, "offset of the chunk table")?;
        let table = u64_at(&word, 0);
        if table >= header.data + 8 && table.checked_add(8).is_some_and(|t| t <= input.bytes) {
            return Ok(Some(table));
        }
    }
    Ok(None)
}

/// Finds the chunks of layered points without a table; each gives its own length.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] if a chunk extends beyond the end of the file.
pub(super) fn walk(
    input: &Input,
    header: &Header,
    laszip: &Laszip,
    workspace: &Workspace,
) -> Result<Table> {
    debug_assert!(header.format.is_extended);
    let mut chunks: Vec<Chunk> = Vec::new();
    let mut at = header.data + 8;
    let mut points = 0;
    let least = u64::from(header.record_bytes) + 8;
    let mut memory = workspace.reserve("LAZ chunk table", 0)?;
    while points < header.claimed && at + least <= input.bytes {
        workspace.check_cancel()?;
        let head = LayerHead::read(input, header, laszip, at)?;
        chunks.push(Chunk {
            at,
            bytes: head.bytes,
            points: head.points,
        });
        if chunks.len().is_power_of_two() {
            drop(memory);
            memory = workspace.reserve("LAZ chunk table", 2 * chunks.len() as u64 * ENTRY)?;
        }
        at += head.bytes;
        points += head.points;
    }
    Ok(Table {
        chunks,
        _memory: memory,
    })
}
