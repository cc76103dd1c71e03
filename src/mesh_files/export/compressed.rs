//! A compressed mesh: the bytes of the plain file in frames of the Zstandard seekable format. All threads
//! compress parts, and the calling thread writes them in their order.

use super::file::MeshFile;
use super::parts::Parts;
use super::write::{KINDS, Writer};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Unit, Workspace};
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

/// Writes the file; returns its place.
pub(super) fn write_all<P: Parts>(writer: &Writer<'_, P>, workspace: &Workspace) -> Result<Place> {
    let (bytes, blocks) = (writer.file.layout.bytes, writer.parts.count());
    let count = KINDS * blocks;
    let sizes = (0..count).map(|part| writer.start(part + 1) - writer.start(part));
    let most = compress_bound(sizes.max().unwrap_or(0) as usize) as u64;
    let memory = |block| writer.memory(workspace, block) + COMPRESSOR + most;
    let part = (0..blocks).map(memory).max().unwrap_or(0);
    // The header is a frame, and each part may end with a short one.
    let entries = 1 + count + (bytes / PIECE as u64) as usize;
    let table = (entries * ENTRY + 64) as u64 + most;
    let room = workspace.memory.available().saturating_sub(table);
    let threads = (room / part.max(1)).clamp(1, workspace.threads as u64);
    let _held = workspace.reserve("export: frames", threads * part + table)?;

    let mut out = Appender {
        file: &writer.file,
        end: 0,
        crc: crc32fast::Hasher::new(),
        table: Vec::with_capacity(entries * ENTRY + 64),
    };
    let header = pack(&writer.file.layout.header).map_err(|e| writer.file.failed("compress", e))?;
    out.append(&header)?;
    let make = |part| {
        workspace.check_cancel()?;
        pack_part(writer, &workspace.unit(), part)
    };
    let mut written = 0;
    workspace.pipe(threads as usize, count, make, |frames| {
        written += 1;
        workspace
            .observer
            .advance(u64::from(written > (KINDS - 1) * blocks));
        out.append(&frames)
    })?;
    out.finish()
}

/// Encodes and compresses a part.
fn pack_part<P: Parts>(writer: &Writer<'_, P>, unit: &Unit<'_>, part: usize) -> Result<Vec<Frame>> {
    let mut bytes = Vec::new();
    writer.encode(unit, part, &mut bytes)?;
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
