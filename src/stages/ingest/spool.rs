//! The spool: all points in their native form, in checksummed frames of one scratch file.
//!
//! A frame is `magic, source, points, CRC-32` (four `u32`), followed by the coordinates. The CRC also covers
//! the other header words. A unit of work writes its frames one after another, as one section of the file;
//! frames are numbered in the order of units.
//!
//! The values of wanted columns are in a file of their own, in frames of the same points.

use super::classes::Classes;
use super::columns::{Span, Wanted, row_bytes};
use super::far::{Middle, middle};
use super::source::{Native, Source};
use super::stats::SourceStats;
use crate::error::Result;
use crate::workspace::file::ScratchFile;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace, lock};
use outcrop_ply::real;
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
    /// True for floating-point numbers.
    const FLOATING: bool = true;
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
    const FLOATING: bool = false;

    fn is_finite(self) -> bool {
        true
    }
    fn exponent(self) -> i32 {
        0
    }
}

/// A frame of the spool.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Frame {
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

/// The values of one source or of a part of it: their frames, and the span of each column.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Values {
    pub(super) frames: Vec<Frame>,
    pub(super) spans: Vec<Span>,
}

/// The result of a unit: its counts, its frames, and its values.
pub(super) type Taken = (SourceStats, Vec<Frame>, Values);

/// The name of the file with the values of the spool `name`.
pub(super) fn values_of(name: &str) -> String {
    format!("{name}.values")
}

/// Receives the points of one source, from several threads.
pub(super) struct SourceWriter<'a> {
    pub(super) workspace: &'a Workspace,
    file: Arc<ScratchFile>,
    /// The file of values, if columns are wanted.
    values: Option<Arc<ScratchFile>>,
    source: u32,
    /// The classes to keep, if points have a class.
    pub(super) classes: &'a Classes,
    /// The columns to read.
    pub(super) wanted: &'a Wanted,
    /// The section of the next unit.
    next: AtomicU32,
    stats: Mutex<SourceStats>,
    /// The frames by section.
    frames: Mutex<BTreeMap<u32, (Vec<Frame>, Values)>>,
}

impl<'a> SourceWriter<'a> {
    /// A writer whose units are the sections from `first` on of the spool `name`.
    pub(super) fn new(
        workspace: &'a Workspace,
        name: &str,
        first: u32,
        source: u32,
        classes: &'a Classes,
        wanted: &'a Wanted,
    ) -> Result<Self> {
        let values = (!wanted.is_empty()).then(|| workspace.files.open(&values_of(name), true));
        Ok(Self {
            workspace,
            file: workspace.files.open(name, true)?,
            values: values.transpose()?,
            source,
            classes,
            wanted,
            next: first.into(),
            stats: Mutex::default(),
            frames: Mutex::default(),
        })
    }

    /// A buffer for one unit; its points are counted when it is finished.
    pub(super) fn sink<'u, T: Coordinate>(&'u self, unit: &'u Unit<'u>) -> Sink<'u, T> {
        let values = self.values.as_ref().map(|file| {
            let frames = FrameWriter::new(file, FRAME * self.wanted.bytes());
            (frames, vec![Span::default(); self.wanted.columns.len()])
        });
        Sink {
            target: self,
            unit,
            frames: FrameWriter::new(&self.file, FRAME * size_of::<[T; 3]>()),
            points: Vec::with_capacity(FRAME),
            values,
            stats: SourceStats::default(),
            reported: 0,
        }
    }

    /// The name of a step of this source.
    pub(super) fn step(&self, name: &str) -> String {
        format!("{name} of source {}", self.source)
    }

    /// Reads units of the source on all threads, as [`Workspace::units`]; `work` fills a sink for each.
    pub(super) fn units<T: Coordinate>(
        &self,
        name: &'static str,
        count: usize,
        bytes: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(usize, &mut Sink<'_, T>) -> Result<()> + Sync,
    ) -> Result<()> {
        let step = self.step(name);
        let first = self.next.fetch_add(count as u32, Ordering::Relaxed);
        let one = |unit: &Unit<'_>| {
            let mut sink = self.sink(unit);
            work(unit.number(), &mut sink)?;
            sink.finish(first + unit.number() as u32)
        };
        let each = |unit: usize, (stats, frames, values): Taken| {
            lock(&self.stats).merge(&stats);
            lock(&self.frames).insert(first + unit as u32, (frames, values));
            Ok(())
        };
        let rows = 2 * (HEADER + FRAME * self.wanted.bytes()) as u64;
        let bytes = |unit| bytes(unit) + if self.wanted.is_empty() { 0 } else { rows };
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

    /// The section after those of the source, and all frames and values in the order of units.
    pub(super) fn end(self) -> (u32, Vec<Frame>, Values) {
        let mut all = (Vec::new(), Values::default());
        all.1.spans = vec![Span::default(); self.wanted.columns.len()];
        for (frames, values) in std::mem::take(&mut *lock(&self.frames)).into_values() {
            all.0.extend(frames);
            all.1.frames.extend(values.frames);
            for (span, more) in all.1.spans.iter_mut().zip(&values.spans) {
                span.merge(more);
            }
        }
        (self.next.into_inner(), all.0, all.1)
    }
}

/// Bytes of one [`Sink`].
pub(super) const fn sink_bytes<T>() -> u64 {
    (HEADER + 2 * FRAME * size_of::<[T; 3]>()) as u64
}

/// Frames that a unit writes one after another, as one section of a file.
struct FrameWriter<'a> {
    file: &'a Arc<ScratchFile>,
    /// The bytes of the next frame, behind room for its header.
    bytes: Vec<u8>,
    frames: Vec<Frame>,
    /// The place of all frames.
    whole: Place,
    crc: crc32fast::Hasher,
}

impl<'a> FrameWriter<'a> {
    /// Writes to `file`; there is room for a frame of `room` bytes.
    fn new(file: &'a Arc<ScratchFile>, room: usize) -> Self {
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
    fn write(&mut self, unit: &Unit<'_>, source: u32, points: usize) -> Result<()> {
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
    fn finish(mut self, unit: &Unit<'_>, section: u32) -> Result<Vec<Frame>> {
        if !self.frames.is_empty() {
            self.whole.crc = self.crc.finalize();
            self.file.put(unit, section, self.whole)?;
        }
        Ok(self.frames)
    }
}

/// Collects points of one source into frames.
pub(super) struct Sink<'a, T: Coordinate> {
    target: &'a SourceWriter<'a>,
    unit: &'a Unit<'a>,
    frames: FrameWriter<'a>,
    points: Vec<[T; 3]>,
    /// The values of the points, and the span of each column, if columns are wanted.
    values: Option<(FrameWriter<'a>, Vec<Span>)>,
    /// Statistics so far; extents and kept points are added when a frame is full.
    pub(super) stats: SourceStats,
    reported: u64,
}

impl<T: Coordinate> Sink<'_, T> {
    /// Adds a point, unless a coordinate is not finite. `values` appends the values of the wanted columns, in
    /// their order and in little-endian bytes; it is called only if columns are wanted.
    #[inline]
    pub(super) fn push_with(
        &mut self,
        point: [T; 3],
        values: impl FnOnce(&mut Vec<u8>),
    ) -> Result<()> {
        self.stats.read += 1;
        if !point.iter().all(|c| c.is_finite()) {
            self.stats.dropped += 1;
            return Ok(());
        }
        self.points.push(point);
        if let Some((frames, _)) = &mut self.values {
            values(&mut frames.bytes);
            debug_assert_eq!(
                frames.bytes.len() - HEADER,
                self.points.len() * self.target.wanted.bytes()
            );
        }
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

    /// Counts a record that the scanner marked as no point.
    #[inline]
    pub(super) fn invalid(&mut self) {
        self.stats.read += 1;
        self.stats.invalid += 1;
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
        for point in &self.points {
            for (axis, coordinate) in point.iter().enumerate() {
                let exponent = coordinate.exponent();
                self.stats.reach(axis, (*coordinate).into(), exponent);
            }
        }
        let (source, points) = (self.target.source, self.points.len());
        let coordinates = bytemuck::cast_slice(&self.points);
        self.frames.bytes.extend_from_slice(coordinates);
        let middle = T::FLOATING.then(|| middle(&self.points));
        self.points.clear();
        self.frames.write(self.unit, source, points)?;
        if let Some(frame) = self.frames.frames.last_mut() {
            frame.middle = middle;
        }
        if let Some((frames, spans)) = &mut self.values {
            let mut at = HEADER;
            for _ in 0..points {
                for (span, column) in spans.iter_mut().zip(&self.target.wanted.columns) {
                    span.add(real(column.scalar, &frames.bytes[at..], false));
                    at += column.scalar.bytes();
                }
            }
            frames.write(self.unit, source, points)?;
        }
        Ok(())
    }

    /// Writes the remaining points, and ends the section.
    fn finish(mut self, section: u32) -> Result<Taken> {
        self.flush()?;
        let frames = self.frames.finish(self.unit, section)?;
        let mut values = Values::default();
        if let Some((writer, spans)) = self.values {
            let frames = writer.finish(self.unit, section)?;
            values = Values { frames, spans };
        }
        Ok((self.stats, frames, values))
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
