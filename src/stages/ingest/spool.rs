//! The spool: all points in their native form, in checksummed frames of one scratch file.
//!
//! A frame is `magic, source, points, CRC-32` (four `u32`) and then the coordinates. The CRC covers
//! the other header words too. Frames may be appended by several threads; their order has no
//! meaning.

use super::Classes;
use super::source::{Native, Source};
use super::stats::SourceStats;
use crate::error::{Error, Result};
use crate::workspace::{IoCounters, Workspace};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Most points in a frame.
pub(super) const FRAME: usize = 1 << 14;

const MAGIC: u32 = 0x4c50_534f;
const HEADER: usize = 16;

/// A coordinate as a file stores it.
pub(super) trait Coordinate: bytemuck::Pod + PartialEq {
    /// False for infinities and what is not a number.
    fn is_finite(self) -> bool;
    /// The same value; exact.
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

/// Tells the spools of one scratch folder apart.
static MADE: AtomicU64 = AtomicU64::new(0);

/// The scratch file; it is deleted on drop.
#[derive(Debug)]
pub(super) struct SpoolFile {
    pub(super) path: PathBuf,
    file: File,
    end: AtomicU64,
    io: Arc<IoCounters>,
}

impl SpoolFile {
    pub(super) fn create(workspace: &Workspace) -> Result<Self> {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let (path, file) = workspace.create_file(&format!("ingest-{number}.spool"))?;
        Ok(Self {
            path,
            file,
            end: AtomicU64::new(0),
            io: workspace.io.clone(),
        })
    }

    fn append(&self, frame: &[u8]) -> Result<()> {
        let bytes = frame.len() as u64;
        let offset = self.end.fetch_add(bytes, Ordering::Relaxed);
        self.io.grow_scratch(bytes);
        self.file.write_all_at(frame, offset).map_err(|e| {
            if e.kind() == std::io::ErrorKind::StorageFull {
                Error::Disk {
                    path: self.path.clone(),
                    needed: bytes,
                    free: crate::workspace::limits::disk_free(&self.path).unwrap_or(0),
                }
            } else {
                Error::io(&self.path, format!("write {bytes} bytes"), e)
            }
        })?;
        self.io.add_written(bytes);
        Ok(())
    }
}

/// Takes the points of one source in, from any number of threads.
pub(super) struct SourceWriter<'a> {
    pub(super) workspace: &'a Workspace,
    file: &'a SpoolFile,
    source: u32,
    /// Points to take, where they have a class.
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

    /// A buffer for one thread; its points count once it is finished.
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

    /// Statistics of all finished sinks.
    pub(super) fn into_stats(self) -> SourceStats {
        self.stats
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bytes of memory of one [`Sink`].
pub(super) const fn sink_bytes<T>() -> u64 {
    (HEADER + 2 * FRAME * size_of::<[T; 3]>()) as u64
}

/// Collects points of one source into frames.
pub(super) struct Sink<'a, T: Coordinate> {
    target: &'a SourceWriter<'a>,
    bytes: Vec<u8>,
    points: Vec<[T; 3]>,
    /// What was seen so far; extents and kept points are added when a frame is full.
    pub(super) stats: SourceStats,
    reported: u64,
}

impl<T: Coordinate> Sink<'_, T> {
    /// Takes a point, unless a coordinate is not finite.
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
        workspace.observer.advance(self.stats.read - self.reported);
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
        self.points.clear();
        self.target.file.append(&self.bytes)
    }

    /// Writes the rest and adds the statistics to the source's.
    pub(super) fn finish(mut self) -> Result<()> {
        self.flush()?;
        self.target
            .stats
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .merge(&self.stats);
        Ok(())
    }
}

fn frame_crc(head: &[u8], body: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(body);
    hasher.finalize()
}

/// Memory of one frame while it is read.
#[derive(Debug, Default)]
pub(super) struct FrameBuffer {
    /// Number of the source.
    pub(super) source: usize,
    /// Number of points.
    pub(super) points: usize,
    /// Where the frame starts in the file.
    pub(super) offset: u64,
    /// Coordinates; `u64` so that every coordinate type is aligned.
    words: Vec<u64>,
}

impl FrameBuffer {
    /// The points, if they are of type `T`.
    pub(super) fn points<T: Coordinate>(&self) -> &[[T; 3]] {
        let all: &[T] = bytemuck::cast_slice(&self.words);
        &bytemuck::cast_slice(&all[..self.points * 3])[..self.points]
    }
}

impl SpoolFile {
    fn damaged(&self, offset: u64, found: String, expected: String) -> Error {
        Error::Corrupt {
            path: self.path.clone(),
            offset,
            found,
            expected,
        }
    }

    fn read(&self, offset: u64, buffer: &mut [u8]) -> Result<()> {
        let wanted = buffer.len();
        self.file.read_exact_at(buffer, offset).map_err(|e| {
            if e.kind() == std::io::ErrorKind::UnexpectedEof {
                self.damaged(
                    offset,
                    "the end of the file".into(),
                    format!("{wanted} bytes"),
                )
            } else {
                Error::io(&self.path, format!("read {wanted} bytes"), e)
            }
        })?;
        self.io.add_read(wanted as u64);
        Ok(())
    }

    /// Reads the frame at `offset` and returns where the next one starts; `None` at the end.
    pub(super) fn next_frame(
        &self,
        sources: &[Source],
        offset: u64,
        frame: &mut FrameBuffer,
    ) -> Result<Option<u64>> {
        if offset >= self.end.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let mut words = [0u32; 4];
        self.read(offset, bytemuck::bytes_of_mut(&mut words))?;
        let [magic, source, points, crc] = words;
        let (source, points) = (source as usize, points as usize);
        if magic != MAGIC || source >= sources.len() || points > FRAME {
            return Err(self.damaged(
                offset,
                format!("frame header {words:08x?}"),
                format!(
                    "a frame of at most {FRAME} points of one of {} sources",
                    sources.len()
                ),
            ));
        }
        let bytes = points * sources[source].native.point_bytes();
        frame.words.clear();
        frame.words.resize(bytes.div_ceil(8), 0);
        let body = &mut bytemuck::cast_slice_mut::<u64, u8>(&mut frame.words)[..bytes];
        self.read(offset + HEADER as u64, body)?;
        let found = frame_crc(&bytemuck::bytes_of(&words)[..12], body);
        if found != crc {
            return Err(self.damaged(
                offset,
                format!("checksum {found:08x}"),
                format!("checksum {crc:08x}"),
            ));
        }
        frame.source = source;
        frame.points = points;
        frame.offset = offset;
        Ok(Some(offset + (HEADER + bytes) as u64))
    }
}

impl Drop for SpoolFile {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.end.load(Ordering::Relaxed));
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

impl Native {
    /// Bytes of one point in the spool.
    pub(super) fn point_bytes(&self) -> usize {
        match self {
            Self::Las { .. } => size_of::<[i32; 3]>(),
            Self::F32 => size_of::<[f32; 3]>(),
            Self::F64 => size_of::<[f64; 3]>(),
        }
    }
}
