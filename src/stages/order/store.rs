//! The ordered store: positions by id in one file, in pages, with a tree of page boxes in memory.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::spill::Sections;
use crate::workspace::Workspace;
use crate::workspace::file::{Place, ScratchFile};
use crate::workspace::memory::Reservation;
use crate::workspace::persist::{Persist, Saved};
use crate::workspace::steps::Step;
use rayon::prelude::*;
use std::ops::Range;

/// Points per page unless a test asks for another number.
pub const PAGE: usize = 256;

/// Children of a node of the box tree.
const FAN: usize = 8;

/// Positions of all points by id; 12 bytes a point on disk, 28/256 in memory.
#[derive(Debug)]
pub struct PointStore {
    file: ScratchFile,
    len: usize,
    page: usize,
    checks: Vec<u32>,
    /// `levels[0]` has a box for each page, each further level one for `FAN` of the last.
    levels: Vec<Vec<Aabb>>,
    /// Checksums and boxes on disk, if a resumed run may need them.
    _index: Option<Index>,
    _held: Reservation,
}

/// Of every page its checksum and its box; sections by the first group of pages in them.
type Index = Sections<7>;

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
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if a page is not what was written.
    pub fn read_pages(&self, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        let ids = pages.start * self.page..(pages.end * self.page).min(self.len);
        let before = points.len();
        points.resize(before + ids.len(), [0; 3]);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut points[before..]);
        let offset = ids.start as u64 * 12;
        self.file.read_at(bytes, offset)?;
        for (page, part) in pages.zip(bytes.chunks(self.page * 12)) {
            let crc = crc32fast::hash(part);
            if crc != self.checks[page] {
                let offset = (page * self.page * 12) as u64;
                let expected = format!("{:08x}", self.checks[page]);
                let found = format!("checksum {crc:08x}");
                return Err(self.file.damaged(offset, found, expected));
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
        let gone = writer.file.is_gone();
        if !gone && writer.boxes.len() != len.div_ceil(page) {
            return Err(from.wrong(format!("{len} points of the file {name}")));
        }
        writer.len = len;
        if gone {
            // Nobody reads its points any more, but where they were is known.
            writer.boxes = vec![Aabb { min, max }];
        }
        writer.into_store(workspace)
    }
}

/// Pages written at a time.
const GROUP: usize = 64;

/// Writes a [`PointStore`] in id order.
#[derive(Debug)]
pub struct StoreWriter {
    file: ScratchFile,
    /// Points written.
    len: usize,
    page: usize,
    /// Points not yet written, less than a group of pages.
    pending: Vec<Point>,
    checks: Vec<u32>,
    boxes: Vec<Aabb>,
    /// As [`PointStore`] has it.
    index: Option<Index>,
    /// Groups of pages are its units.
    step: Step,
}

/// A page's checksum and box.
type Page = (u32, Aabb);

impl StoreWriter {
    /// Starts the scratch file `name`. What an earlier attempt at the run has written of it is there,
    /// see [`StoreWriter::len`].
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn create(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        let mut writer = Self::open(workspace, name, page)?;
        writer.step = workspace.step("store")?;
        // The last group may have been cut short by the end of the points; it is written again.
        let whole = writer.boxes.len() / GROUP * GROUP;
        writer.checks.truncate(whole);
        writer.boxes.truncate(whole);
        writer.len = whole * writer.page;
        Ok(writer)
    }

    fn open(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        let index = || Index::unpacked(workspace, &format!("{name}.index"), 0);
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
        writer.take_up()?;
        Ok(writer)
    }

    /// Reads the index of what is there.
    fn take_up(&mut self) -> Result<()> {
        let Some(index) = self.index.as_ref().filter(|_| !self.file.is_gone()) else {
            return Ok(());
        };
        self.checks.clear();
        self.boxes.clear();
        let mut group = 0;
        while group < index.count() && index.records(group) > 0 {
            for [crc, bounds @ ..] in index.get(group)? {
                let [a, b, c, d, e, f] = bounds.map(u32::cast_signed);
                self.checks.push(crc);
                self.boxes.push(Aabb {
                    min: [a, b, c],
                    max: [d, e, f],
                });
            }
            group += index.records(group).div_ceil(GROUP);
        }
        Ok(())
    }

    /// Points written so far.
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

    /// A whole store from the points of sections, one after the other.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`], [`crate::Error::Cancelled`].
    pub fn gather(
        workspace: &Workspace,
        name: &str,
        page: usize,
        sections: &Sections<3>,
    ) -> Result<PointStore> {
        workspace.once("gather", || {
            let mut writer = Self::create(workspace, name, page)?;
            let mut first = 0;
            for section in 0..sections.count() {
                workspace.check_cancel()?;
                let end = first + sections.records(section);
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

    /// Appends points, in order of id.
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

    /// Appends the points of `items`, in order of id, on all threads.
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
        let written: Result<Vec<(Vec<Page>, Place)>> = workspace.install(|| {
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

    /// Writes a group of pages from point `first` on; their checksums and boxes, and the place.
    fn write(&self, first: usize, points: &[Point]) -> Result<(Vec<Page>, Place)> {
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

    /// Takes in groups that were written, for good.
    fn note(&mut self, groups: Vec<(Vec<Page>, Place)>) -> Result<()> {
        if groups.is_empty() {
            return Ok(());
        }
        let first = self.boxes.len() / GROUP;
        if let Some(index) = &self.index {
            let pages = groups.iter().flat_map(|group| &group.0);
            let record = |(crc, b): &Page| {
                let [p, q] = [b.min, b.max].map(|corner| corner.map(i32::cast_unsigned));
                [*crc, p[0], p[1], p[2], q[0], q[1], q[2]]
            };
            let records: Vec<_> = pages.map(record).collect();
            self.step.finish(first as u64, &(), || {
                for (group, (_, place)) in (first as u32..).zip(&groups) {
                    self.file.put(group, *place)?;
                }
                while index.count() <= first {
                    index.grow();
                }
                index.put(first, &records)
            })?;
        }
        for (crc, aabb) in groups.into_iter().flat_map(|group| group.0) {
            self.checks.push(crc);
            self.boxes.push(aabb);
        }
        Ok(())
    }

    /// Writes what is pending.
    fn flush(&mut self) -> Result<()> {
        if !self.pending.is_empty() {
            let group = self.write(self.len, &self.pending)?;
            self.note(vec![group])?;
            self.len += self.pending.len();
            self.pending.clear();
        }
        Ok(())
    }

    /// Ends the file and builds the tree of boxes.
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
