//! Frames of the spool: checksummed parts of a scratch file.
//!
//! A frame is `magic, source, points, CRC-32` (four `u32`), followed by the coordinates. The CRC also covers
//! the other header words. A unit of work writes its frames one after another, as one section of the file;
//! frames are numbered in the order of units.
//!
//! The values of wanted columns are in a file of their own, in frames of the same points.

use super::columns::row_bytes;
use super::coordinate::Coordinate;
use super::middle::Middle;
use super::native::Native;
use super::source::Source;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::place::Place;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Most points in a frame.
pub(super) const FRAME: usize = 1 << 14;

const MAGIC: u32 = 0x4c50_534f;
/// Bytes of the header of a frame.
pub(super) const HEADER: usize = 16;

/// A frame of the spool.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Frame {
    /// The segment of the file.
    pub(super) segment: u32,
    /// Offset in the segment.
    pub(super) offset: u64,
    /// Number of points.
    pub(super) points: u32,
    /// Number of these that are far from all others and left out.
    pub(super) far: u32,
    /// The middle of floating-point values.
    pub(super) middle: Option<Middle>,
}

/// The name of the file with the values of the spool `name`.
pub fn values_of(name: &str) -> String {
    format!("{name}.values")
}

/// Frames that a unit writes one after another, as one section of a file.
pub(super) struct FrameWriter<'a> {
    file: &'a Arc<ScratchFile>,
    /// The bytes of the next frame, behind room for its header.
    pub(super) bytes: Vec<u8>,
    pub(super) frames: Vec<Frame>,
    /// The place of all frames.
    whole: Place,
    crc: crc32fast::Hasher,
}

impl<'a> FrameWriter<'a> {
    /// Writes to `file`; there is room for a frame of `room` bytes.
    pub(super) fn new(file: &'a Arc<ScratchFile>, room: usize) -> Self {
        let mut bytes = Vec::with_capacity(HEADER + room);
        bytes.resize(HEADER, 0);
        Self {
            file,
            bytes,
            frames: Vec::new(),
            whole: Place::default(),
            crc: crc32fast::Hasher::new(),
        }
    }

    /// Writes the bytes behind the header as a frame of `points` points.
    pub(super) fn write(&mut self, unit: &Unit<'_>, source: u32, points: usize) -> Result<()> {
        let words = [MAGIC, source, points as u32, 0];
        self.bytes[..HEADER].copy_from_slice(bytemuck::bytes_of(&words));
        let crc = frame_crc(&self.bytes[..12], &self.bytes[HEADER..]);
        self.bytes[12..HEADER].copy_from_slice(&crc.to_ne_bytes());
        let place = self.file.append(unit.worker(), &self.bytes, points)?;
        self.crc.update(&self.bytes);
        self.frames.push(Frame {
            segment: place.segment,
            offset: place.offset,
            points: points as u32,
            ..Frame::default()
        });
        if self.frames.len() == 1 {
            self.whole = place;
        } else {
            self.whole.bytes += place.bytes;
            self.whole.records += points;
        }
        self.bytes.truncate(HEADER);
        Ok(())
    }

    /// Ends the section; returns the frames.
    pub(super) fn finish(mut self, unit: &Unit<'_>, section: u32) -> Result<Vec<Frame>> {
        if !self.frames.is_empty() {
            self.whole.crc = self.crc.finalize();
            self.file.put(unit, section, self.whole)?;
        }
        Ok(self.frames)
    }
}

fn frame_crc(head: &[u8], body: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(body);
    hasher.finalize()
}

/// Buffer for reading one frame.
#[derive(Debug, Default)]
pub(super) struct FrameBuffer {
    /// Number of the source.
    pub(super) source: usize,
    /// Number of points.
    pub(super) points: usize,
    /// Coordinates, in `u64` words so that every coordinate type is aligned.
    words: Vec<u64>,
}

impl FrameBuffer {
    /// The points, which must have coordinates of type `T`.
    pub(super) fn points<T: Coordinate>(&self) -> &[[T; 3]] {
        let all: &[T] = bytemuck::cast_slice(&self.words);
        &bytemuck::cast_slice(&all[..self.points * 3])[..self.points]
    }

    /// The coordinates of a point, as in its file.
    pub(super) fn native(&self, native: Native, point: usize) -> [f64; 3] {
        match native {
            Native::Las { .. } => self.points::<i32>()[point].map(f64::from),
            Native::F32 => self.points::<f32>()[point].map(f64::from),
            Native::F64 => self.points::<f64>()[point],
        }
    }
}

/// Reads a frame of the spool `file`.
pub(super) fn read_frame(
    file: &ScratchFile,
    sources: &[Source],
    at: Frame,
    frame: &mut FrameBuffer,
) -> Result<()> {
    let bytes = |source: &Source| source.native.point_bytes();
    frame.source = read_body(file, sources, at, bytes, &mut frame.words)?;
    frame.points = at.points as usize;
    Ok(())
}

/// Reads a frame of the file of values of a spool; returns the number of its source.
pub(super) fn read_values(
    file: &ScratchFile,
    sources: &[Source],
    at: Frame,
    words: &mut Vec<u64>,
) -> Result<usize> {
    let bytes = |source: &Source| row_bytes(&source.columns);
    read_body(file, sources, at, bytes, words)
}

/// Reads the content of a frame, with a number of bytes for each point that depends on the source; returns the
/// number of the source.
fn read_body(
    file: &ScratchFile,
    sources: &[Source],
    at: Frame,
    point_bytes: impl Fn(&Source) -> usize,
    content: &mut Vec<u64>,
) -> Result<usize> {
    let (segment, offset) = (at.segment, at.offset);
    let mut words = [0u32; 4];
    file.read(segment, offset, bytemuck::bytes_of_mut(&mut words))?;
    let [magic, source, points, crc] = words;
    let (source, points) = (source as usize, points as usize);
    let fits =
        magic == MAGIC && source < sources.len() && points <= FRAME && points == at.points as usize;
    if !fits {
        let (points, sources) = (at.points, sources.len());
        let found = format!("frame header {words:08x?}");
        let expected = format!("a frame of {points} points of one of {sources} sources");
        return Err(file.damaged(segment, offset, found, expected));
    }
    let bytes = points * point_bytes(&sources[source]);
    content.clear();
    content.resize(bytes.div_ceil(8), 0);
    let body = &mut bytemuck::cast_slice_mut::<u64, u8>(content)[..bytes];
    file.read(segment, offset + HEADER as u64, body)?;
    let found = frame_crc(&bytemuck::bytes_of(&words)[..12], body);
    if found != crc {
        let checksum = |crc: u32| format!("checksum {crc:08x}");
        return Err(file.damaged(segment, offset, checksum(found), checksum(crc)));
    }
    Ok(source)
}
