//! A compressed mesh: the bytes of the plain file in frames of the Zstandard seekable format. Threads compress
//! parts, another writes them in their order.
//!
//! A part may begin when the writer has given out its number, and the writer gives out a further number for
//! each part that is written. So numbers ascend, no more parts are in memory than were reserved, and whoever
//! has a number has all memory that it needs: nobody waits for a part that cannot go on.

use super::file::{HEADER, MeshFile, note};
use super::{KINDS, Writer};
use crate::error::Result;
use crate::workspace::memory::bytes_of;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::BTreeMap;
use std::ops::Range;
use zstd::bulk::Compressor;
use zstd::zstd_safe::compress_bound;

/// Most bytes of the mesh in a frame: what a reader has to decompress to get at one record. At this level the
/// file is 7 % smaller than with frames of 1 MiB (docs/decisions.md).
const PIECE: usize = 256 << 10;

/// The level of compression: 1 saves a third of the time and makes the file a tenth larger, 6 is slower and no
/// smaller (docs/decisions.md).
const LEVEL: i32 = 3;

/// Bytes of memory of a compressor for pieces at this level; a test asks the library.
const COMPRESSOR: u64 = 4 << 20;

/// Bytes of an entry in the table of frames.
const ENTRY: usize = 8;

/// Magic numbers of the skippable frame with the table, and at the end of the table.
const SKIPPED: u32 = 0x184d_2a5e;
const SEEKABLE: u32 = 0x8f92_eab1;

/// A frame, with the number of bytes that it holds.
struct Frame {
    content: u32,
    bytes: Vec<u8>,
}

/// A part with its number.
type Packed = (usize, Result<Vec<Frame>>);

/// Writes the file.
pub(super) fn write(writer: &Writer<'_>, workspace: &Workspace) -> Result<()> {
    workspace.once("compress", |unit| {
        let whole = write_all(writer, workspace)?;
        note(unit, HEADER, whole);
        Ok(())
    })
}

/// Writes the file; returns its place.
fn write_all(writer: &Writer<'_>, workspace: &Workspace) -> Result<Place> {
    let (bytes, blocks) = (writer.file.layout.bytes, writer.blocks.count());
    let count = KINDS * blocks;
    let sizes = (0..count).map(|part| writer.start(part + 1) - writer.start(part));
    let most = compress_bound(sizes.max().unwrap_or(0) as usize) as u64;
    let ahead = workspace.memory.available() / 4 / most;
    let ahead = ahead.clamp(1, 2 * workspace.threads as u64);
    // The header is a frame, and each part may end with a short one.
    let entries = 1 + count + (bytes / PIECE as u64) as usize;
    let table = (entries * ENTRY + 64) as u64;
    let _held = workspace.reserve("export: frames", ahead * most + table)?;
    let memory = |block| writer.memory(workspace, block) + COMPRESSOR + most;
    let largest = (0..blocks).map(memory).max().unwrap_or(0);

    let (allow, allowed) = bounded(ahead as usize);
    let (hand_on, arriving) = bounded(ahead as usize);
    let mut out = Appender {
        file: &writer.file,
        end: 0,
        crc: crc32fast::Hasher::new(),
        table: Vec::with_capacity(table as usize),
    };
    std::thread::scope(|scope| {
        let written = scope.spawn(move || {
            out.append_in_order(0..count, &allow, &arriving)?;
            out.finish()
        });
        let work = |unit: &Unit<'_>| {
            // If there is no number, or nobody to take the part, the writer failed.
            let Ok(part) = allowed.recv() else {
                return Ok(());
            };
            unit.give_back(largest - memory(part % blocks));
            let _ = hand_on.send((part, pack_part(writer, unit, part)));
            unit.advance(u64::from(part / blocks == KINDS - 1));
            Ok(())
        };
        let outcome = workspace.for_each_unit("export: block", count, |_| largest, work);
        drop(hand_on);
        let written = written.join();
        outcome.and(written.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// Encodes and compresses a part.
fn pack_part(writer: &Writer<'_>, unit: &Unit<'_>, part: usize) -> Result<Vec<Frame>> {
    let mut bytes = Vec::new();
    writer.encode(unit, part, &mut bytes)?;
    let _held = unit.hold(bytes_of(&bytes) + COMPRESSOR);
    pack(&bytes).map_err(|e| writer.file.failed("compress", e))
}

/// Compresses `bytes`, a frame for each piece.
fn pack(bytes: &[u8]) -> std::io::Result<Vec<Frame>> {
    let mut compressor = Compressor::new(LEVEL)?;
    compressor.include_checksum(true)?;
    let frame = |piece: &[u8]| {
        Ok(Frame {
            content: piece.len() as u32,
            bytes: compressor.compress(piece)?,
        })
    };
    bytes.chunks(PIECE).map(frame).collect()
}

/// Writes frames one after another.
struct Appender<'a> {
    file: &'a MeshFile<'a>,
    /// Offset of the next frame.
    end: u64,
    /// Checksum of the file.
    crc: crc32fast::Hasher,
    /// The entries of the table: the sizes of each frame, compressed and not.
    table: Vec<u8>,
}

impl Appender<'_> {
    /// Writes the header, and the parts `numbers` in their order; gives out the numbers.
    fn append_in_order(
        &mut self,
        mut numbers: Range<usize>,
        allow: &Sender<usize>,
        arriving: &Receiver<Packed>,
    ) -> Result<()> {
        let (mut next, mut waiting) = (numbers.start, BTreeMap::new());
        // The channel has room for all numbers that are given out and not written.
        let first = numbers.by_ref().take(allow.capacity().unwrap_or(1));
        first.for_each(|part| _ = allow.send(part));
        let header = pack(&self.file.layout.header).map_err(|e| self.file.failed("compress", e))?;
        self.append(&header)?;
        for (part, frames) in arriving {
            waiting.insert(part, frames?);
            while let Some(frames) = waiting.remove(&next) {
                self.append(&frames)?;
                next += 1;
                numbers.next().map(|part| allow.send(part));
            }
        }
        Ok(())
    }

    fn append(&mut self, frames: &[Frame]) -> Result<()> {
        for Frame { bytes, content } in frames {
            self.put(bytes)?;
            for size in [bytes.len() as u32, *content] {
                self.table.extend_from_slice(&size.to_le_bytes());
            }
        }
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.put(bytes, self.end)?;
        self.crc.update(bytes);
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// Writes the table, a frame that decompressors skip; returns the place of the whole file.
    fn finish(mut self) -> Result<Place> {
        let mut table = std::mem::take(&mut self.table);
        let frames = (table.len() / ENTRY) as u32;
        table.extend_from_slice(&frames.to_le_bytes());
        // No checksums in the entries: the frames have their own.
        table.push(0);
        table.extend_from_slice(&SEEKABLE.to_le_bytes());
        self.put(&SKIPPED.to_le_bytes())?;
        self.put(&(table.len() as u32).to_le_bytes())?;
        self.put(&table)?;
        Ok(Place {
            bytes: self.end as usize,
            crc: self.crc.finalize(),
            ..Place::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compressor_takes_less_than_is_reserved_for_it() {
        let mut compressor = Compressor::new(LEVEL).unwrap();
        let mut random = oorandom::Rand32::new(1);
        let piece: Vec<u8> = (0..PIECE)
            .map(|_| random.rand_range(0..200) as u8)
            .collect();
        compressor.compress(&piece).unwrap();
        let bytes = compressor.context_mut().sizeof() as u64;
        assert!(bytes < COMPRESSOR && bytes > COMPRESSOR / 8, "{bytes}");
    }

    #[test]
    fn pieces_are_frames_of_their_own() {
        let bytes: Vec<u8> = (0..PIECE as u32 + 5).map(|n| (n % 251) as u8).collect();
        let frames = pack(&bytes).unwrap();
        let contents = frames.iter().map(|f| f.content as usize);
        assert!(contents.eq([PIECE, 5]));
        let parts = frames
            .iter()
            .map(|f| zstd::decode_all(&f.bytes[..]).unwrap());
        assert!(parts.collect::<Vec<_>>().concat() == bytes);
        assert!(pack(&[]).unwrap().is_empty());
    }
}
