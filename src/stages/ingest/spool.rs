//! The spool: all points in their native form, in checksummed frames of one scratch file.
//!
//! A frame is `magic, source, points, CRC-32` (four `u32`), followed by the coordinates. The CRC also covers
//! the other header words. Several threads may append frames; their order has no meaning.

use super::classes::Classes;
use super::source::Source;
use super::stats::SourceStats;
use crate::error::Result;
use crate::workspace::Workspace;
use crate::workspace::file::ScratchFile;
use crate::workspace::place::Place;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Most points in a frame.
pub(super) const FRAME: usize = 1 << 14;

const MAGIC: u32 = 0x4c50_534f;
const HEADER: usize = 16;

/// A coordinate as a file stores it.
pub(super) trait Coordinate: bytemuck::Pod + PartialEq {
    /// False for infinity and NaN.
    fn is_finite(self) -> bool;
    /// The value, converted exactly.
    fn value(self) -> f64;
    /// The highest power of two of which the value is a multiple; `i32::MAX` for zero.
    fn exponent(self) -> i32;
}

impl Coordinate for i32 {
    fn is_finite(self) -> bool {
        true
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn exponent(self) -> i32 {
        0
    }
}

impl Coordinate for f32 {
    fn is_finite(self) -> bool {
        self.is_finite()
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn exponent(self) -> i32 {
        f64::from(self).exponent()
    }
}

impl Coordinate for f64 {
    fn is_finite(self) -> bool {
        self.is_finite()
    }
    fn value(self) -> f64 {
        self
    }
    fn exponent(self) -> i32 {
        let bits = self.to_bits();
        let power = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        match (power, fraction) {
            (0, 0) => i32::MAX,
            (0, _) => -1074 + fraction.trailing_zeros() as i32,
            _ => power - 1075 + (fraction | 1 << 52).trailing_zeros() as i32,
        }
    }
}

/// The scratch file; it is deleted on drop.
#[derive(Debug)]
pub(super) struct SpoolFile {
    pub(super) file: ScratchFile,
    /// Frames by number; the numbers have no meaning.
    frames: Mutex<BTreeMap<u32, Place>>,
}

impl SpoolFile {
    /// Opens the spool `name`, with the frames that earlier attempts of the run completed.
    pub(super) fn open(workspace: &Workspace, name: &str) -> Result<Self> {
        let (file, frames) = workspace.keep_file(name)?;
        Ok(Self {
            file,
            frames: Mutex::new(frames.into_iter().collect()),
        })
    }

    fn places(&self) -> MutexGuard<'_, BTreeMap<u32, Place>> {
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The number of each frame, and its number of points.
    pub(super) fn frames(&self) -> Vec<(u32, u64)> {
        let places = self.places();
        let frames = places.iter();
        frames
            .map(|(n, place)| (*n, place.records as u64))
            .collect()
    }

    fn append(&self, frame: &[u8], points: usize) -> Result<()> {
        let place = Place {
            offset: self.file.append(frame)?,
            bytes: frame.len(),
            records: points,
            crc: if self.file.is_kept() {
                crc32fast::hash(frame)
            } else {
                0
            },
        };
        let number = {
            let mut places = self.places();
            let number = places.last_key_value().map_or(0, |(last, _)| last + 1);
            places.insert(number, place);
            number
        };
        self.file.put(number, place)
    }
}

/// Receives the points of one source, from several threads.
pub(super) struct SourceWriter<'a> {
    pub(super) workspace: &'a Workspace,
    file: &'a SpoolFile,
    source: u32,
    /// The classes to keep, if points have a class.
    pub(super) classes: &'a Classes,
    stats: Mutex<SourceStats>,
}

impl<'a> SourceWriter<'a> {
    pub(super) fn new(
        workspace: &'a Workspace,
        file: &'a SpoolFile,
        source: u32,
        classes: &'a Classes,
    ) -> Self {
        Self {
            workspace,
            file,
            source,
            classes,
            stats: Mutex::default(),
        }
    }

    /// A buffer for one unit; its points are counted when it is finished.
    pub(super) fn sink<T: Coordinate>(&self) -> Sink<'_, T> {
        let mut bytes = Vec::with_capacity(HEADER + FRAME * size_of::<[T; 3]>());
        bytes.resize(HEADER, 0);
        Sink {
            target: self,
            bytes,
            points: Vec::with_capacity(FRAME),
            stats: SourceStats::default(),
            reported: 0,
        }
    }

    /// Reads units of the source on all threads, as [`Workspace::units`]; `work` fills and finishes a sink
    /// for each.
    pub(super) fn units(
        &self,
        name: &'static str,
        count: usize,
        bytes: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(usize) -> Result<SourceStats> + Sync,
    ) -> Result<()> {
        let step = format!("{name} of source {}", self.source);
        self.workspace
            .units((step, name), count, bytes, work, |_, stats| {
                let mut all = self.stats.lock().unwrap_or_else(PoisonError::into_inner);
                all.merge(&stats);
                Ok(())
            })
    }

    /// Reads the source as one unit that takes `bytes` of memory.
    pub(super) fn whole(
        &self,
        name: &'static str,
        bytes: u64,
        work: impl Fn() -> Result<SourceStats> + Sync,
    ) -> Result<()> {
        self.units(name, 1, |_| bytes, |_| work())
    }

    /// Statistics of the finished units.
    pub(super) fn stats(&self) -> SourceStats {
        *self.stats.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bytes of one [`Sink`].
pub(super) const fn sink_bytes<T>() -> u64 {
    (HEADER + 2 * FRAME * size_of::<[T; 3]>()) as u64
}

/// Collects points of one source into frames.
pub(super) struct Sink<'a, T: Coordinate> {
    target: &'a SourceWriter<'a>,
    bytes: Vec<u8>,
    points: Vec<[T; 3]>,
    /// Statistics so far; extents and kept points are added when a frame is full.
    pub(super) stats: SourceStats,
    reported: u64,
}

impl<T: Coordinate> Sink<'_, T> {
    /// Adds a point, unless a coordinate is not finite.
    #[inline]
    pub(super) fn push(&mut self, point: [T; 3]) -> Result<()> {
        self.stats.read += 1;
        if !point.iter().all(|c| c.is_finite()) {
            self.stats.dropped += 1;
            return Ok(());
        }
        self.points.push(point);
        if self.points.len() == FRAME {
            self.flush()?;
        }
        Ok(())
    }

    /// Counts a point that is flagged as withheld.
    #[inline]
    pub(super) fn withhold(&mut self) {
        self.stats.read += 1;
        self.stats.withheld += 1;
    }

    /// Counts a point whose class is not wanted.
    #[inline]
    pub(super) fn leave_out(&mut self) {
        self.stats.read += 1;
        self.stats.unwanted += 1;
    }

    fn flush(&mut self) -> Result<()> {
        let workspace = self.target.workspace;
        workspace.check_cancel()?;
        workspace.advance(self.stats.read - self.reported);
        self.reported = self.stats.read;
        if self.points.is_empty() {
            return Ok(());
        }
        self.stats.kept += self.points.len() as u64;
        for point in &self.points {
            for (axis, coordinate) in point.iter().enumerate() {
                let value = coordinate.value();
                self.stats.min[axis] = self.stats.min[axis].min(value);
                self.stats.max[axis] = self.stats.max[axis].max(value);
                self.stats.exponent = self.stats.exponent.min(coordinate.exponent());
            }
        }
        self.bytes.truncate(HEADER);
        let words = [MAGIC, self.target.source, self.points.len() as u32, 0];
        self.bytes[..HEADER].copy_from_slice(bytemuck::bytes_of(&words));
        self.bytes
            .extend_from_slice(bytemuck::cast_slice(&self.points));
        let crc = frame_crc(&self.bytes[..12], &self.bytes[HEADER..]);
        self.bytes[12..HEADER].copy_from_slice(&crc.to_ne_bytes());
        let points = self.points.len();
        self.points.clear();
        self.target.file.append(&self.bytes, points)
    }

    /// Writes the remaining points; returns the statistics.
    pub(super) fn finish(mut self) -> Result<SourceStats> {
        self.flush()?;
        Ok(self.stats)
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
    /// Offset of the frame in the file.
    pub(super) offset: u64,
    /// Coordinates, in `u64` words so that every coordinate type is aligned.
    words: Vec<u64>,
}

impl FrameBuffer {
    /// The points, which must have coordinates of type `T`.
    pub(super) fn points<T: Coordinate>(&self) -> &[[T; 3]] {
        let all: &[T] = bytemuck::cast_slice(&self.words);
        &bytemuck::cast_slice(&all[..self.points * 3])[..self.points]
    }
}

impl SpoolFile {
    /// Reads a frame.
    pub(super) fn read_frame(
        &self,
        sources: &[Source],
        number: u32,
        frame: &mut FrameBuffer,
    ) -> Result<()> {
        let place = self.places().get(&number).copied().unwrap_or_default();
        let offset = place.offset;
        let mut words = [0u32; 4];
        self.file
            .read_at(bytemuck::bytes_of_mut(&mut words), offset)?;
        let [magic, source, points, crc] = words;
        let (source, points) = (source as usize, points as usize);
        let bytes = |source: usize| points * sources[source].native.point_bytes();
        let fits = magic == MAGIC
            && source < sources.len()
            && points <= FRAME
            && HEADER + bytes(source) == place.bytes;
        if !fits {
            return Err(self.file.damaged(
                offset,
                format!("frame header {words:08x?}"),
                format!(
                    "a frame of {} bytes with points of one of {} sources",
                    place.bytes,
                    sources.len()
                ),
            ));
        }
        let bytes = bytes(source);
        frame.words.clear();
        frame.words.resize(bytes.div_ceil(8), 0);
        let body = &mut bytemuck::cast_slice_mut::<u64, u8>(&mut frame.words)[..bytes];
        self.file.read_at(body, offset + HEADER as u64)?;
        let found = frame_crc(&bytemuck::bytes_of(&words)[..12], body);
        if found != crc {
            let (found, expected) = (
                format!("checksum {found:08x}"),
                format!("checksum {crc:08x}"),
            );
            return Err(self.file.damaged(offset, found, expected));
        }
        frame.source = source;
        frame.points = points;
        frame.offset = offset;
        Ok(())
    }
}
