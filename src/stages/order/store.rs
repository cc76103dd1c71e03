//! The ordered store: positions by id in one file, in pages, with a tree of page boxes in memory.

use crate::error::{Error, Result};
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::spill::Sections;
use crate::workspace::memory::Reservation;
use crate::workspace::{IoCounters, Workspace};
use rayon::prelude::*;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::Arc;

/// Points per page unless a test asks for another number.
pub const PAGE: usize = 256;

/// Children of a node of the box tree.
const FAN: usize = 8;

/// Positions of all points by id; 12 bytes a point on disk, 28/256 in memory.
#[derive(Debug)]
pub struct PointStore {
    path: PathBuf,
    file: File,
    len: usize,
    page: usize,
    checks: Vec<u32>,
    /// `levels[0]` has a box for each page, each further level one for `FAN` of the last.
    levels: Vec<Vec<Aabb>>,
    io: Arc<IoCounters>,
    _held: Reservation,
}

impl PointStore {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Points per page.
    #[must_use]
    pub fn page_size(&self) -> usize {
        self.page
    }

    /// Number of pages.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.levels[0].len()
    }

    /// The box around a page.
    #[must_use]
    pub fn page_box(&self, page: usize) -> &Aabb {
        &self.levels[0][page]
    }

    /// Ids of the points in a page.
    #[must_use]
    pub fn page_ids(&self, page: usize) -> Range<usize> {
        page * self.page..((page + 1) * self.page).min(self.len)
    }

    /// The box around all points.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.levels.last().map_or(Aabb::EMPTY, |top| {
            top.iter().fold(Aabb::EMPTY, |a, b| a.union(*b))
        })
    }

    /// Number of levels of the box tree; level 0 are the pages.
    #[must_use]
    pub fn tree_levels(&self) -> usize {
        self.levels.len()
    }

    /// The boxes of a level.
    #[must_use]
    pub fn tree_boxes(&self, level: usize) -> &[Aabb] {
        &self.levels[level]
    }

    /// The nodes of `level - 1` under node `index` of `level`.
    #[must_use]
    pub fn tree_children(&self, level: usize, index: usize) -> Range<usize> {
        index * FAN..((index + 1) * FAN).min(self.levels[level - 1].len())
    }

    /// Calls `each` with all pages whose box is within squared distance `d2` of `target`, ascending,
    /// until it returns false.
    pub fn pages_near(&self, target: &Aabb, d2: u64, each: &mut dyn FnMut(usize) -> bool) {
        let top = self.levels.len() - 1;
        for node in 0..self.levels[top].len() {
            if !self.descend(top, node, target, d2, each) {
                return;
            }
        }
    }

    fn descend(
        &self,
        level: usize,
        node: usize,
        target: &Aabb,
        d2: u64,
        each: &mut dyn FnMut(usize) -> bool,
    ) -> bool {
        if self.levels[level][node].distance2_box(target) > d2 {
            return true;
        }
        if level == 0 {
            return each(node);
        }
        self.tree_children(level, node)
            .all(|child| self.descend(level - 1, child, target, d2, each))
    }

    /// Reads a run of pages and appends their points to `points`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Corrupt`] if a page is not what was written.
    pub fn read_pages(&self, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        let ids = pages.start * self.page..(pages.end * self.page).min(self.len);
        let before = points.len();
        points.resize(before + ids.len(), [0; 3]);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut points[before..]);
        let offset = ids.start as u64 * 12;
        self.file
            .read_exact_at(bytes, offset)
            .map_err(|e| Error::io(&self.path, format!("read {} bytes", bytes.len()), e))?;
        self.io.add_read(bytes.len() as u64);
        for (page, part) in pages.zip(bytes.chunks(self.page * 12)) {
            let crc = crc32fast::hash(part);
            if crc != self.checks[page] {
                return Err(Error::Corrupt {
                    path: self.path.clone(),
                    offset: (page * self.page * 12) as u64,
                    found: format!("checksum {crc:08x}"),
                    expected: format!("{:08x}", self.checks[page]),
                });
            }
        }
        Ok(())
    }

    /// Positions of ascending `ids`, appended to `points` in the same order.
    ///
    /// # Errors
    /// See [`PointStore::read_pages`].
    pub fn fetch(&self, ids: &[u32], points: &mut Vec<Point>) -> Result<()> {
        let mut buffer = Vec::new();
        let mut loaded = usize::MAX;
        for &id in ids {
            let page = id as usize / self.page;
            if page != loaded {
                buffer.clear();
                self.read_pages(page..page + 1, &mut buffer)?;
                loaded = page;
            }
            points.push(buffer[id as usize % self.page]);
        }
        Ok(())
    }

    /// Positions of the ids in `range`.
    ///
    /// # Errors
    /// See [`PointStore::read_pages`].
    pub fn slice(&self, range: Range<usize>) -> Result<Vec<Point>> {
        if range.is_empty() {
            return Ok(Vec::new());
        }
        let pages = range.start / self.page..range.end.div_ceil(self.page);
        let first = pages.start * self.page;
        let mut points = Vec::new();
        self.read_pages(pages, &mut points)?;
        points.truncate(range.end - first);
        points.drain(..range.start - first);
        Ok(points)
    }
}

impl Drop for PointStore {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.len as u64 * 12);
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Pages written at a time.
const GROUP: usize = 64;

/// Checksum and box of a page.
pub(super) type PageEnd = (u32, Aabb);

/// Writes a [`PointStore`] in id order.
#[derive(Debug)]
pub struct StoreWriter {
    path: PathBuf,
    file: File,
    /// Points written.
    len: usize,
    page: usize,
    /// Points not yet written, less than a group of pages.
    pending: Vec<Point>,
    checks: Vec<u32>,
    boxes: Vec<Aabb>,
    io: Arc<IoCounters>,
}

impl StoreWriter {
    /// Starts the scratch file `name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        let (path, file) = workspace.create_file(name)?;
        Ok(Self {
            path,
            file,
            len: 0,
            page: page.max(1),
            pending: Vec::new(),
            checks: Vec::new(),
            boxes: Vec::new(),
            io: workspace.io.clone(),
        })
    }

    /// A whole store from the points of sections, one after the other.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::Memory`], [`Error::Cancelled`].
    pub fn gather(
        workspace: &Workspace,
        name: &str,
        page: usize,
        sections: &Sections<3>,
    ) -> Result<PointStore> {
        let mut writer = Self::create(workspace, name, page)?;
        for section in 0..sections.count() {
            workspace.check_cancel()?;
            writer.push(bytemuck::cast_slice(&sections.get(section)?))?;
        }
        writer.finish(workspace)
    }

    /// Appends points, in order of id.
    ///
    /// # Errors
    /// [`Error::Io`].
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

    /// Appends the points of `items`, in order of id, on all threads.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
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
        let written: Result<Vec<Vec<PageEnd>>> = workspace.install(|| {
            let parts = groups.par_chunks(group).enumerate();
            let write = |(n, part): (usize, &[T])| {
                workspace.check_cancel()?;
                let points: Vec<Point> = part.iter().map(&point).collect();
                workspace.observer.advance(points.len() as u64);
                self.write(self.len + n * group, &points)
            };
            parts.map(write).collect()
        });
        for page in written?.into_iter().flatten() {
            self.checks.push(page.0);
            self.boxes.push(page.1);
        }
        self.len += groups.len();
        workspace
            .observer
            .advance((first.len() + last.len()) as u64);
        self.push(&last.iter().map(&point).collect::<Vec<_>>())
    }

    /// Writes pages from point `first` on; their checksums and boxes.
    pub(super) fn write(&self, first: usize, points: &[Point]) -> Result<Vec<PageEnd>> {
        let bytes: &[u8] = bytemuck::cast_slice(points);
        self.file
            .write_all_at(bytes, first as u64 * 12)
            .map_err(|e| Error::io(&self.path, format!("write {} bytes", bytes.len()), e))?;
        self.io.add_written(bytes.len() as u64);
        self.io.grow_scratch(bytes.len() as u64);
        let page = |page: &[Point]| {
            let crc = crc32fast::hash(bytemuck::cast_slice(page));
            (crc, Aabb::of(page))
        };
        Ok(points.chunks(self.page).map(page).collect())
    }

    /// Writes what is pending.
    fn flush(&mut self) -> Result<()> {
        let pages = self.write(self.len, &self.pending)?;
        for (crc, aabb) in pages {
            self.checks.push(crc);
            self.boxes.push(aabb);
        }
        self.len += self.pending.len();
        self.pending.clear();
        Ok(())
    }

    /// Points per page.
    pub(super) fn page(&self) -> usize {
        self.page
    }

    /// As [`StoreWriter::finish`], if `pages` were written to the file without this writer's knowledge.
    pub(super) fn finish_with(
        mut self,
        len: usize,
        pages: Vec<PageEnd>,
        workspace: &Workspace,
    ) -> Result<PointStore> {
        self.len = len;
        (self.checks, self.boxes) = pages.into_iter().unzip();
        self.finish(workspace)
    }

    /// Ends the file and builds the tree of boxes.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Memory`].
    pub fn finish(mut self, workspace: &Workspace) -> Result<PointStore> {
        self.flush()?;
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
            path: self.path,
            file: self.file,
            len: self.len,
            page: self.page,
            checks: self.checks,
            levels,
            io: self.io,
            _held: held,
        })
    }
}
