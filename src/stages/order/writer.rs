//! Writes the ordered store: in id order, or, with `rewrite`, in any order.

use super::store::{FAN, Index, PageRow, PointStore};
use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::spill::{Table, row};
use crate::workspace::Workspace;
use crate::workspace::file::ScratchFile;
use crate::workspace::persist::{Persist, Saved};
use crate::workspace::place::Place;
use crate::workspace::steps::Step;
use rayon::prelude::*;

row! {
    /// The position of a point on the lattice.
    pub struct Position {
        /// Coordinates.
        point: Point,
    }
    unpacked
}

/// The first page of every write has a number that is a multiple of this.
const STEP: usize = 16;

/// Pages written at a time.
const GROUP: usize = 64;

/// Checksum and bounding box of a page.
pub(super) type PageEnd = (u32, Aabb);

/// Pages that were written together, and their place in the file.
pub(super) type Written = (Vec<PageEnd>, Place);

/// Writes a [`PointStore`] in id order.
#[derive(Debug)]
pub struct StoreWriter {
    file: ScratchFile,
    /// Number of points written.
    len: usize,
    page: usize,
    /// Points not written yet, less than a group of pages.
    pending: Vec<Point>,
    checks: Vec<u32>,
    boxes: Vec<Aabb>,
    /// See [`PointStore`].
    index: Option<Index>,
    /// The step whose units are the groups of pages.
    step: Step,
}

impl StoreWriter {
    /// Opens the scratch file `name`. It contains the points that an earlier attempt of the run wrote; see
    /// [`StoreWriter::len`].
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn create(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        let mut writer = Self::open(workspace, name, page)?;
        writer.step = workspace.step(&format!("store {name}"))?;
        // The end of the points may have cut the last group short; it is written again.
        let whole = writer.boxes.len() / GROUP * GROUP;
        writer.checks.truncate(whole);
        writer.boxes.truncate(whole);
        writer.len = whole * writer.page;
        Ok(writer)
    }

    fn open(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        let index = || Index::create(workspace, &format!("{name}.index"), 0);
        let mut writer = Self {
            file: workspace.keep_file(name)?.0,
            len: 0,
            page: page.max(1),
            pending: Vec::new(),
            checks: Vec::new(),
            boxes: Vec::new(),
            index: workspace.is_resumable().then(index).transpose()?,
            step: Step::default(),
        };
        writer.read_index()?;
        Ok(writer)
    }

    /// Reads the index of the existing pages; false if there is none.
    pub(super) fn read_index(&mut self) -> Result<bool> {
        let index = self.index.as_ref().filter(|_| !self.is_gone());
        let Some(index) = index else {
            return Ok(false);
        };
        self.checks.clear();
        self.boxes.clear();
        let mut at = 0;
        while at < index.count() && index.rows(at) > 0 {
            for PageRow { crc, min, max } in index.get(at)? {
                self.checks.push(crc);
                self.boxes.push(Aabb { min, max });
            }
            at += index.rows(at).div_ceil(STEP);
        }
        Ok(true)
    }

    /// True if an earlier attempt deleted the file.
    fn is_gone(&self) -> bool {
        self.file.is_gone() || self.index.as_ref().is_some_and(Index::is_gone)
    }

    /// Number of points written so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if nothing was written yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The last point written.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn last(&self) -> Result<Option<Point>> {
        let Some(last) = self.len.checked_sub(1) else {
            return Ok(None);
        };
        let mut point: Point = [0; 3];
        let bytes = bytemuck::cast_slice_mut(&mut point);
        self.file.read_at(bytes, last as u64 * 12)?;
        Ok(Some(point))
    }

    /// A whole store from the points of the sections, in their order.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn gather(
        workspace: &Workspace,
        name: &str,
        page: usize,
        sections: &Table<Position>,
    ) -> Result<PointStore> {
        workspace.once(&format!("gather {name}"), || {
            let mut writer = Self::create(workspace, name, page)?;
            let mut first = 0;
            for section in 0..sections.count() {
                workspace.check_cancel()?;
                let end = first + sections.rows(section);
                let done = writer.len.clamp(first, end) - first;
                if first + done < end {
                    let points = sections.get(section)?;
                    writer.push(bytemuck::cast_slice(&points[done..]))?;
                }
                first = end;
            }
            writer.finish(workspace)
        })
    }

    /// Appends points, in id order.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn push(&mut self, mut points: &[Point]) -> Result<()> {
        while !points.is_empty() {
            let room = GROUP * self.page - self.pending.len();
            let (now, later) = points.split_at(room.min(points.len()));
            self.pending.extend_from_slice(now);
            points = later;
            if self.pending.len() == GROUP * self.page {
                self.flush()?;
            }
        }
        Ok(())
    }

    /// Appends the points of `items`, in id order, on all threads.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Cancelled`].
    pub fn append<T: Sync>(
        &mut self,
        workspace: &Workspace,
        items: &[T],
        point: impl Fn(&T) -> Point + Sync,
    ) -> Result<()> {
        let group = GROUP * self.page;
        let (first, rest) = items.split_at(((group - self.pending.len()) % group).min(items.len()));
        let (groups, last) = rest.split_at(rest.len() / group * group);
        self.push(&first.iter().map(&point).collect::<Vec<_>>())?;
        let written: Result<Vec<Written>> = workspace.install(|| {
            let parts = groups.par_chunks(group).enumerate();
            let write = |(n, part): (usize, &[T])| {
                workspace.check_cancel()?;
                let points: Vec<Point> = part.iter().map(&point).collect();
                workspace.observer.advance(points.len() as u64);
                self.write(self.len + n * group, &points)
            };
            parts.map(write).collect()
        });
        self.note(written?)?;
        self.len += groups.len();
        workspace
            .observer
            .advance((first.len() + last.len()) as u64);
        self.push(&last.iter().map(&point).collect::<Vec<_>>())
    }

    /// Writes a group of pages starting with point `first`; returns their checksums and boxes, and the place.
    pub(super) fn write(&self, first: usize, points: &[Point]) -> Result<Written> {
        let bytes: &[u8] = bytemuck::cast_slice(points);
        let offset = first as u64 * 12;
        self.file.write_at(bytes, offset)?;
        let page = |page: &[Point]| {
            let crc = crc32fast::hash(bytemuck::cast_slice(page));
            (crc, Aabb::of(page))
        };
        let place = Place {
            offset,
            bytes: bytes.len(),
            records: points.len(),
            crc: self.index.as_ref().map_or(0, |_| crc32fast::hash(bytes)),
        };
        Ok((points.chunks(self.page).map(page).collect(), place))
    }

    /// Records pages in the index, the first with number `first`, for a later attempt of the run.
    pub(super) fn keep(&self, first: usize, written: &[Written]) -> Result<()> {
        let Some(index) = &self.index else {
            return Ok(());
        };
        let mut rows = Vec::new();
        for (pages, place) in written {
            let part = (first + rows.len()) / STEP;
            self.file.put(part as u32, *place)?;
            rows.extend(
                pages
                    .iter()
                    .map(|&(crc, Aabb { min, max })| PageRow { crc, min, max }),
            );
        }
        while index.count() <= first / STEP {
            index.grow();
        }
        index.put(first / STEP, &rows)
    }

    /// Records groups that were written.
    fn note(&mut self, groups: Vec<Written>) -> Result<()> {
        if groups.is_empty() {
            return Ok(());
        }
        let first = self.boxes.len();
        self.step
            .finish(first as u64, &(), || self.keep(first, &groups))?;
        for (crc, aabb) in groups.into_iter().flat_map(|group| group.0) {
            self.checks.push(crc);
            self.boxes.push(aabb);
        }
        Ok(())
    }

    /// Writes the pending points.
    fn flush(&mut self) -> Result<()> {
        if !self.pending.is_empty() {
            let group = self.write(self.len, &self.pending)?;
            self.note(vec![group])?;
            self.len += self.pending.len();
            self.pending.clear();
        }
        Ok(())
    }

    /// Points in a page.
    pub(super) fn page(&self) -> usize {
        self.page
    }

    /// As [`StoreWriter::finish`], for a file with `pages` that were not all written through this writer; an
    /// index may list more of them.
    pub(super) fn finish_with(
        mut self,
        len: usize,
        pages: Vec<PageEnd>,
        workspace: &Workspace,
    ) -> Result<PointStore> {
        if !self.read_index()? {
            (self.checks, self.boxes) = pages.into_iter().unzip();
        }
        self.len = len;
        self.into_store(workspace)
    }

    /// Closes the file and builds the tree of boxes.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Memory`].
    pub fn finish(mut self, workspace: &Workspace) -> Result<PointStore> {
        self.flush()?;
        self.into_store(workspace)
    }

    fn into_store(self, workspace: &Workspace) -> Result<PointStore> {
        let held = workspace.reserve("point index", self.boxes.len() as u64 * 32 + 4096)?;
        let mut levels = vec![self.boxes];
        while levels.last().is_some_and(|top| top.len() > FAN) {
            let next = levels[levels.len() - 1]
                .chunks(FAN)
                .map(|boxes| boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b)))
                .collect();
            levels.push(next);
        }
        Ok(PointStore {
            file: self.file,
            len: self.len,
            page: self.page,
            checks: self.checks,
            levels,
            _index: self.index,
            _held: held,
        })
    }
}

impl Persist for PointStore {
    fn save(&self, out: &mut Vec<u8>) {
        self.file.name.to_string().save(out);
        self.len.save(out);
        self.page.save(out);
        let bounds = self.bounds();
        (bounds.min, bounds.max).save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let name = String::load(from)?;
        let (len, page) = <(usize, usize)>::load(from)?;
        let (min, max) = Persist::load(from)?;
        let workspace = from.workspace;
        let mut writer = StoreWriter::open(workspace, &name, page)?;
        let gone = writer.is_gone();
        let whole = || {
            let bytes = (len as u64).saturating_mul(size_of::<Point>() as u64);
            writer.boxes.len() == len.div_ceil(page.max(1)) && bytes <= writer.file.end()
        };
        if page == 0 || !gone && !whole() {
            return Err(from.wrong(format!("{len} points of the file {name}")));
        }
        writer.len = len;
        if gone {
            // The points will not be read any more, but their bounding box is still needed.
            writer.boxes = vec![Aabb { min, max }];
        }
        writer.into_store(workspace)
    }
}
