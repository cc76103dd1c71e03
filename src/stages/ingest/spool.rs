//! The spool: all points in their native form, in checksummed frames of one scratch file.
//!
//! A frame is `magic, source, points, CRC-32` (four `u32`), followed by the coordinates. The CRC also covers
//! the other header words. A unit of work writes its frames one after another, as one section of the file;
//! frames are numbered in the order of units.

use super::classes::Classes;
use super::crop::Wanted;
use super::source::{Native, Source};
use super::stats::SourceStats;
use crate::error::Result;
use crate::workspace::file::ScratchFile;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace, lock};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

/// Most points in a frame.
pub(super) const FRAME: usize = 1 << 14;

const MAGIC: u32 = 0x4c50_534f;
const HEADER: usize = 16;

/// A coordinate as a file stores it.
pub(super) trait Coordinate: bytemuck::Pod + PartialEq + Into<f64> {
    /// False for infinity and NaN.
    fn is_finite(self) -> bool {
        let value: f64 = self.into();
        value.is_finite()
    }
    /// The highest power of two of which the value is a multiple; `i32::MAX` for zero.
    fn exponent(self) -> i32 {
        let value: f64 = self.into();
        let bits = value.to_bits();
        let power = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        match (power, fraction) {
            (0, 0) => i32::MAX,
            (0, _) => -1074 + fraction.trailing_zeros() as i32,
            _ => power - 1075 + (fraction | 1 << 52).trailing_zeros() as i32,
        }
    }
}

impl Coordinate for f32 {}

impl Coordinate for f64 {}

impl Coordinate for i32 {
    fn is_finite(self) -> bool {
        true
    }
    fn exponent(self) -> i32 {
        0
    }
}

/// A frame of the spool.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Frame {
    /// The segment of the file.
    pub(super) segment: u32,
    /// Offset in the segment.
    pub(super) offset: u64,
    /// Number of points.
    pub(super) points: u32,
}

/// The result of a unit: its counts and its frames.
pub(super) type Taken = (SourceStats, Vec<Frame>);

/// Receives the points of one source, from several threads.
pub(super) struct SourceWriter<'a> {
    pub(super) workspace: &'a Workspace,
    file: Arc<ScratchFile>,
    source: u32,
    /// The classes to keep, if points have a class.
    pub(super) classes: &'a Classes,
    /// The positions to keep, and the type of the source's coordinates.
    wanted: Option<(&'a Wanted<'a>, Native)>,
    /// The section of the next unit.
    next: AtomicU32,
    stats: Mutex<SourceStats>,
    /// The frames by section.
    frames: Mutex<BTreeMap<u32, Vec<Frame>>>,
}

impl<'a> SourceWriter<'a> {
    /// A writer whose units are the sections from `first` on of the spool `name`.
    pub(super) fn new(
        workspace: &'a Workspace,
        name: &str,
        first: u32,
        source: u32,
        classes: &'a Classes,
    ) -> Result<Self> {
        Ok(Self {
            workspace,
            file: workspace.files.open(name, true)?,
            source,
            classes,
            wanted: None,
            next: first.into(),
            stats: Mutex::default(),
            frames: Mutex::default(),
        })
    }

    /// The same, for points at wanted positions only; coordinates are of type `native`.
    pub(super) fn within(self, wanted: Option<&'a Wanted<'a>>, native: Native) -> Self {
        let wanted = wanted.map(|wanted| (wanted, native));
        Self { wanted, ..self }
    }

    /// The wanted positions, if not all are.
    pub(super) fn region(&self) -> Option<&'a Wanted<'a>> {
        self.wanted.map(|(wanted, _)| wanted)
    }

    /// Counts points that are not read because of their position; their coordinates are between these ends.
    pub(super) fn skip(&self, points: u64, [low, high]: [[f64; 3]; 2]) {
        let mut stats = lock(&self.stats);
        stats.skipped += points;
        stats.reach(low);
        stats.reach(high);
    }

    /// A buffer for one unit; its points are counted when it is finished.
    pub(super) fn sink<'u, T: Coordinate>(&'u self, unit: &'u Unit<'u>) -> Sink<'u, T> {
        let mut bytes = Vec::with_capacity(HEADER + FRAME * size_of::<[T; 3]>());
        bytes.resize(HEADER, 0);
        Sink {
            target: self,
            unit,
            bytes,
            points: Vec::with_capacity(FRAME),
            stats: SourceStats::default(),
            reported: 0,
            frames: Vec::new(),
            whole: Place::default(),
            crc: crc32fast::Hasher::new(),
        }
    }

    /// Reads units of the source on all threads, as [`Workspace::units`]; `work` fills a sink for each.
    pub(super) fn units<T: Coordinate>(
        &self,
        name: &'static str,
        count: usize,
        bytes: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(usize, &mut Sink<'_, T>) -> Result<()> + Sync,
    ) -> Result<()> {
        let step = format!("{name} of source {}", self.source);
        let first = self.next.fetch_add(count as u32, Ordering::Relaxed);
        let one = |unit: &Unit<'_>| {
            let mut sink = self.sink(unit);
            work(unit.number(), &mut sink)?;
            sink.finish(first + unit.number() as u32)
        };
        let each = |unit: usize, (stats, frames): Taken| {
            lock(&self.stats).merge(&stats);
            lock(&self.frames).insert(first + unit as u32, frames);
            Ok(())
        };
        self.workspace.units((step, name), count, bytes, one, each)
    }

    /// Reads the source as one unit that takes `bytes` of memory.
    pub(super) fn whole<T: Coordinate>(
        &self,
        name: &'static str,
        bytes: u64,
        work: impl Fn(&mut Sink<'_, T>) -> Result<()> + Sync,
    ) -> Result<()> {
        self.units(name, 1, |_| bytes, |_, sink| work(sink))
    }

    /// Statistics of the finished units.
    pub(super) fn stats(&self) -> SourceStats {
        *lock(&self.stats)
    }

    /// The section after those of the source, and all frames in the order of units.
    pub(super) fn end(self) -> (u32, Vec<Frame>) {
        let frames = std::mem::take(&mut *lock(&self.frames));
        let frames = frames.into_values().flatten().collect();
        (self.next.into_inner(), frames)
    }
}

/// Bytes of one [`Sink`].
pub(super) const fn sink_bytes<T>() -> u64 {
    (HEADER + 2 * FRAME * size_of::<[T; 3]>()) as u64
}

/// Collects points of one source into frames.
pub(super) struct Sink<'a, T: Coordinate> {
    target: &'a SourceWriter<'a>,
    unit: &'a Unit<'a>,
    bytes: Vec<u8>,
    points: Vec<[T; 3]>,
    /// Statistics so far; extents and kept points are added when a frame is full.
    pub(super) stats: SourceStats,
    reported: u64,
    frames: Vec<Frame>,
    /// The place of all frames.
    whole: Place,
    crc: crc32fast::Hasher,
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
        if let Some((wanted, native)) = &self.target.wanted {
            let position = native.position(point.map(Into::into));
            if !wanted.takes(position) {
                self.stats.outside += 1;
                self.stats.reach(point);
                return Ok(());
            }
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
        self.unit.check_cancel()?;
        self.unit.advance(self.stats.read - self.reported);
        self.reported = self.stats.read;
        if self.points.is_empty() {
            return Ok(());
        }
        self.stats.kept += self.points.len() as u64;
        let mut own = SourceStats::default();
        self.points.iter().for_each(|point| own.reach(*point));
        own.own = [own.min, own.max];
        self.stats.merge(&own);
        self.bytes.truncate(HEADER);
        let words = [MAGIC, self.target.source, self.points.len() as u32, 0];
        self.bytes[..HEADER].copy_from_slice(bytemuck::bytes_of(&words));
        self.bytes
            .extend_from_slice(bytemuck::cast_slice(&self.points));
        let crc = frame_crc(&self.bytes[..12], &self.bytes[HEADER..]);
        self.bytes[12..HEADER].copy_from_slice(&crc.to_ne_bytes());
        let points = self.points.len();
        self.points.clear();
        let file = &self.target.file;
        let place = file.append(self.unit.worker(), &self.bytes, points)?;
        self.crc.update(&self.bytes);
        self.frames.push(Frame {
            segment: place.segment,
            offset: place.offset,
            points: points as u32,
        });
        if self.frames.len() == 1 {
            self.whole = place;
        } else {
            self.whole.bytes += place.bytes;
            self.whole.records += points;
        }
        Ok(())
    }

    /// Writes the remaining points, and ends the section; returns the counts and the frames.
    fn finish(mut self, section: u32) -> Result<Taken> {
        self.flush()?;
        if !self.frames.is_empty() {
            self.whole.crc = self.crc.finalize();
            self.target.file.put(self.unit, section, self.whole)?;
        }
        Ok((self.stats, self.frames))
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
}

/// Reads a frame of the spool `file`.
pub(super) fn read_frame(
    file: &ScratchFile,
    sources: &[Source],
    at: Frame,
    frame: &mut FrameBuffer,
) -> Result<()> {
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
    let bytes = points * sources[source].native.point_bytes();
    frame.words.clear();
    frame.words.resize(bytes.div_ceil(8), 0);
    let body = &mut bytemuck::cast_slice_mut::<u64, u8>(&mut frame.words)[..bytes];
    file.read(segment, offset + HEADER as u64, body)?;
    let found = frame_crc(&bytemuck::bytes_of(&words)[..12], body);
    if found != crc {
        let checksum = |crc: u32| format!("checksum {crc:08x}");
        return Err(file.damaged(segment, offset, checksum(found), checksum(crc)));
    }
    frame.source = source;
    frame.points = points;
    Ok(())
}
