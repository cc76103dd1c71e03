//! The writer of the spool: all points in their native form, in frames of one scratch file.

use super::classes::Classes;
use super::colors::{Tally, open_places};
use super::columns::{Span, Wanted};
use super::coordinate::Coordinate;
use super::crop::Nearby;
use super::frames::{FRAME, Frame, FrameWriter, HEADER, values_of};
use super::middle::middle;
use super::native::Native;
use super::stats::SourceStats;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_ply::{Scalar, real};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

/// The values of one source or of a part of it: their frames, the span of each column, and the colours.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Values {
    /// Where they are in the file.
    pub frames: Vec<Frame>,
    /// Smallest and largest value of each column.
    pub spans: Vec<Span>,
    /// The points by their largest colour.
    pub tally: Tally,
}

/// The result of a unit: its counts, its frames, and its values.
pub(super) type Taken = (SourceStats, Vec<Frame>, Values);

/// Receives the points of one source, from several threads.
pub struct SourceWriter<'a> {
    /// Where it writes.
    pub workspace: &'a Workspace,
    file: Arc<ScratchFile>,
    /// The file of values, if columns are wanted.
    values: Option<Arc<ScratchFile>>,
    source: u32,
    /// The classes to keep, if points have a class.
    pub classes: &'a Classes,
    /// The positions to keep, and the type of the source's coordinates.
    nearby: Option<(&'a Nearby<'a>, Native)>,
    /// The columns to read.
    pub wanted: &'a Wanted,
    /// Places of the colours whose scale is not known.
    colors: Vec<(usize, Scalar)>,
    /// The section of the next unit.
    next: AtomicU32,
    stats: Mutex<SourceStats>,
    /// The frames by section.
    frames: Mutex<BTreeMap<u32, (Vec<Frame>, Values)>>,
}

impl<'a> SourceWriter<'a> {
    /// A writer whose units are the sections from `first` on of the spool `name`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`] if the scratch file cannot be opened.
    pub fn new(
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
            nearby: None,
            wanted,
            colors: open_places(&wanted.columns),
            next: first.into(),
            stats: Mutex::default(),
            frames: Mutex::default(),
        })
    }

    /// The same, for points at wanted positions only; coordinates are of type `native`.
    pub fn within(self, nearby: Option<&'a Nearby<'a>>, native: Native) -> Self {
        let nearby = nearby.map(|nearby| (nearby, native));
        Self { nearby, ..self }
    }

    /// The wanted positions, if not all are.
    pub fn region(&self) -> Option<&'a Nearby<'a>> {
        self.nearby.map(|(nearby, _)| nearby)
    }

    /// Counts points that are not read because of their position; their coordinates are between these ends.
    pub fn skip(&self, points: u64, [low, high]: [[f64; 3]; 2]) {
        let mut stats = lock(&self.stats);
        stats.skipped += points;
        stats.reach_point(low);
        stats.reach_point(high);
    }

    /// A buffer for one unit; its points are counted when it is finished.
    pub(super) fn sink<'u, T: Coordinate>(&'u self, unit: &'u Unit<'u>) -> Sink<'u, T> {
        let values = self.values.as_ref().map(|file| {
            let frames = FrameWriter::new(file, FRAME * self.wanted.bytes());
            let spans = vec![Span::default(); self.wanted.columns.len()];
            (frames, spans, Tally::default())
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
    pub fn step(&self, name: &str) -> String {
        format!("{name} of source {}", self.source)
    }

    /// Reads units of the source on all threads, as [`Workspace::units`]; `work` fills a sink for each.
    ///
    /// # Errors
    /// Those of `work`; [`outcrop_disk::error::Error::Disk`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
    pub fn units<T: Coordinate>(
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
    ///
    /// # Errors
    /// See [`SourceWriter::units`].
    pub fn whole<T: Coordinate>(
        &self,
        name: &'static str,
        bytes: u64,
        work: impl Fn(&mut Sink<'_, T>) -> Result<()> + Sync,
    ) -> Result<()> {
        self.units(name, 1, |_| bytes, |_, sink| work(sink))
    }

    /// Statistics of the finished units.
    pub fn stats(&self) -> SourceStats {
        *lock(&self.stats)
    }

    /// The section after those of the source, and all frames and values in the order of units.
    pub fn end(self) -> (u32, Vec<Frame>, Values) {
        let mut all = (Vec::new(), Values::default());
        all.1.spans = vec![Span::default(); self.wanted.columns.len()];
        for (frames, values) in std::mem::take(&mut *lock(&self.frames)).into_values() {
            all.0.extend(frames);
            all.1.frames.extend(values.frames);
            for (span, more) in all.1.spans.iter_mut().zip(&values.spans) {
                span.merge(more);
            }
            all.1.tally.merge(&values.tally);
        }
        (self.next.into_inner(), all.0, all.1)
    }
}

/// Bytes of one [`Sink`].
pub const fn sink_bytes<T>() -> u64 {
    (HEADER + 2 * FRAME * size_of::<[T; 3]>()) as u64
}

/// Collects points of one source into frames.
pub struct Sink<'a, T: Coordinate> {
    target: &'a SourceWriter<'a>,
    unit: &'a Unit<'a>,
    frames: FrameWriter<'a>,
    points: Vec<[T; 3]>,
    /// The values of the points, the span of each column, and the colours, if columns are wanted.
    values: Option<(FrameWriter<'a>, Vec<Span>, Tally)>,
    /// Statistics so far; extents and kept points are added when a frame is full.
    pub stats: SourceStats,
    reported: u64,
}

impl<T: Coordinate> Sink<'_, T> {
    /// Adds a point, unless a coordinate is not finite. `values` appends the values of the wanted columns, in
    /// their order and in little-endian bytes; it is called only if columns are wanted.
    ///
    /// # Errors
    /// Those of a full frame that is written.
    #[inline]
    pub fn push_with(&mut self, point: [T; 3], values: impl FnOnce(&mut Vec<u8>)) -> Result<()> {
        self.stats.read += 1;
        if !point.iter().all(|c| c.is_finite()) {
            self.stats.dropped += 1;
            return Ok(());
        }
        if self.target.wanted.class.is_some() {
            return self.push_of_class(point, values);
        }
        if let Some((nearby, native)) = &self.target.nearby {
            let position = native.position(point.map(Into::into));
            if !nearby.takes(position) {
                self.stats.outside += 1;
                self.stats.reach_point(point);
                return Ok(());
            }
        }
        self.points.push(point);
        if let Some((frames, ..)) = &mut self.values {
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

    /// Adds a finite point if its class is wanted, which is among its values; where it lies matters after that.
    fn push_of_class(&mut self, point: [T; 3], values: impl FnOnce(&mut Vec<u8>)) -> Result<()> {
        let (Some((frames, ..)), Some((at, scalar))) = (&mut self.values, self.target.wanted.class)
        else {
            return Ok(());
        };
        let row = frames.bytes.len();
        values(&mut frames.bytes);
        let class = real(scalar, &frames.bytes[row + at..], false);
        let outside = self.target.nearby.as_ref().is_some_and(|(nearby, native)| {
            let position = native.position(point.map(Into::into));
            !nearby.takes(position)
        });
        let wanted = self.target.classes.wants_number(class);
        if !wanted || outside {
            frames.bytes.truncate(row);
            if wanted {
                self.stats.outside += 1;
                self.stats.reach_point(point);
            } else {
                self.stats.unwanted += 1;
            }
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
    pub fn withhold(&mut self) {
        self.stats.read += 1;
        self.stats.withheld += 1;
    }

    /// Counts a record that the scanner marked as no point.
    #[inline]
    pub fn invalid(&mut self) {
        self.stats.read += 1;
        self.stats.invalid += 1;
    }

    /// Counts a point whose class is not wanted.
    #[inline]
    pub fn leave_out(&mut self) {
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
        self.points.iter().for_each(|point| own.reach_point(*point));
        own.own = [own.min, own.max];
        self.stats.merge(&own);
        let (source, points) = (self.target.source, self.points.len());
        let coordinates = bytemuck::cast_slice(&self.points);
        self.frames.bytes.extend_from_slice(coordinates);
        let middle = T::FLOATING.then(|| middle(&self.points));
        self.points.clear();
        self.frames.write(self.unit, source, points)?;
        if let Some(frame) = self.frames.frames.last_mut() {
            frame.middle = middle;
        }
        if let Some((frames, spans, tally)) = &mut self.values {
            let colors = &self.target.colors;
            if !colors.is_empty() {
                let each = self.target.wanted.bytes();
                for row in frames.bytes[HEADER..].chunks_exact(each) {
                    tally.add(
                        colors
                            .iter()
                            .map(|(at, scalar)| real(*scalar, &row[*at..], false)),
                    );
                }
            }
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
        if let Some((writer, spans, tally)) = self.values {
            let frames = writer.finish(self.unit, section)?;
            values = Values {
                frames,
                spans,
                tally,
            };
        }
        Ok((self.stats, frames, values))
    }
}
