//! The ordered store: positions by id in one file, in pages, with a tree of page boxes in memory.

use super::packed::{Packing, pack};
use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::spill::{Table, row};
use crate::workspace::file::ScratchFile;
use crate::workspace::mapped::Mapping;
use crate::workspace::memory::Reservation;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

row! {
    /// Checksum, packing and bounding box of a page.
    pub struct PageRow {
        /// CRC-32 of the packed page.
        crc: u32,
        /// Bits left out of each coordinate.
        shift: u32,
        /// Lowest coordinates.
        min: Point,
        /// Highest coordinates.
        max: Point,
    }
    unpacked
}

impl PageRow {
    pub fn bounds(&self) -> Aabb {
        let Self { min, max, .. } = *self;
        Aabb { min, max }
    }

    fn packing(&self) -> Packing {
        Packing::of(&self.bounds(), self.shift.min(31) as u8)
    }
}

/// The pages of a store. Pages written together form a section; its number is that of its first page divided
/// by [`STEP`].
type Index = Table<PageRow>;

/// The first page of every write has a number that is a multiple of this.
pub(super) const STEP: usize = 16;

/// Pages written at a time, a multiple of [`STEP`].
pub(super) const GROUP: usize = 64;

/// Points in a page, except in tests.
pub const PAGE: usize = 256;

/// Children of a node of the box tree.
const FAN: usize = 8;

/// An ordered store in the scratch folder: the name of its file and its size.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StoredPoints {
    pub(super) name: String,
    pub(super) len: usize,
    pub(super) page: usize,
    /// The bounding box of all points.
    pub(super) bounds: [Point; 2],
}

/// The table of pages of the store `name`.
fn index_of(name: &str) -> Index {
    Index::new(&format!("{name}.index"), 0)
}

/// Pages that were written together, and their place in the file.
pub(super) type Written = (Vec<PageRow>, Place);

/// The file and the index of a store that is written.
#[derive(Debug)]
pub(super) struct StoreFiles {
    pub file: Arc<ScratchFile>,
    pub index: Index,
    pub page: usize,
}

impl StoreFiles {
    pub fn open(workspace: &Workspace, name: &str, page: usize) -> Result<Self> {
        Ok(Self {
            file: workspace.files.open(name, true)?,
            index: index_of(name),
            page: page.max(1),
        })
    }

    /// Writes up to a group of pages to the segment of the current thread.
    pub fn write(&self, workspace: &Workspace, points: &[Point]) -> Result<Written> {
        let mut bytes = Vec::new();
        let page = |page: &[Point]| {
            let before = bytes.len();
            let (Aabb { min, max }, shift) = pack(page, &mut bytes);
            PageRow {
                crc: crc32fast::hash(&bytes[before..]),
                shift: shift.into(),
                min,
                max,
            }
        };
        let pages = points.chunks(self.page).map(page).collect();
        let worker = workspace.files.worker();
        Ok((pages, self.file.append(worker, &bytes, points.len())?))
    }

    /// The last point of the whole groups before page `end`, of which those from page `first` on were
    /// recorded together.
    pub fn last_before(&self, unit: &Unit<'_>, first: usize, end: usize) -> Result<Option<Point>> {
        let mut rows = Vec::new();
        self.index.get_into(unit, first / STEP, &mut rows)?;
        let group = end.saturating_sub(GROUP);
        let group_rows = rows.get(group.saturating_sub(first)..end.saturating_sub(first));
        let Some((last, others)) = group_rows.and_then(<[_]>::split_last) else {
            return Ok(None);
        };
        let (place, packing) = (self.file.section(group / STEP), last.packing());
        let before: usize = (others.iter())
            .map(|row| row.packing().bytes(self.page))
            .sum();
        let mut bytes = vec![0; packing.bytes(self.page)];
        self.file
            .read(place.segment, place.offset + before as u64, &mut bytes)?;
        let mut columns = [0, 1, 2].map(|_| vec![0; self.page]);
        packing.unpack(&bytes, columns.each_mut().map(Vec::as_mut_slice));
        Ok(Some(columns.map(|column| column[self.page - 1])))
    }

    /// Records in the index pages that were written, the first with number `first`.
    pub fn keep(&self, unit: &Unit<'_>, first: usize, written: &[Written]) -> Result<()> {
        let mut rows = Vec::new();
        for (pages, place) in written {
            let part = (first + rows.len()) / STEP;
            self.file.put(unit, part as u32, *place)?;
            rows.extend_from_slice(pages);
        }
        self.index.put(unit, first / STEP, &rows)
    }

    /// The store of `len` points with all pages written.
    pub fn stored(&self, len: usize, bounds: Aabb) -> StoredPoints {
        StoredPoints {
            name: self.file.name.clone(),
            len,
            page: self.page,
            bounds: [bounds.min, bounds.max],
        }
    }

    /// Calls `each` with all pages up to `end`.
    pub fn read_index(
        &self,
        unit: &Unit<'_>,
        end: usize,
        each: impl FnMut(&PageRow),
    ) -> Result<()> {
        let (mut at, mut rows, mut each) = (0, Vec::new(), each);
        while at < end {
            self.index.get_into(unit, at / STEP, &mut rows)?;
            if rows.is_empty() {
                let expected = self.index.total(unit)?.to_string();
                return Err(self.file.damaged(0, 0, format!("{at} pages"), expected));
            }
            rows.iter().for_each(&mut each);
            at += rows.len().next_multiple_of(STEP);
        }
        Ok(())
    }

    /// The bounding box of all pages up to `end`.
    pub fn bounds(&self, unit: &Unit<'_>, end: usize) -> Result<Aabb> {
        let mut bounds = Aabb::EMPTY;
        // Points that an earlier attempt deleted are not read any more.
        if !self.file.is_gone() {
            self.read_index(unit, end, |row| bounds = bounds.union(row.bounds()))?;
        }
        Ok(bounds)
    }
}

impl StoredPoints {
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

    /// The bounding box of all points.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let [min, max] = self.bounds;
        Aabb { min, max }
    }

    /// Opens the store: reads its index and builds the tree of boxes.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`].
    pub fn open(&self, workspace: &Workspace) -> Result<PointStore> {
        let files = StoreFiles::open(workspace, &self.name, self.page)?;
        let (file, page) = (files.file.clone(), files.page);
        let (mut parts, mut checks, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        let mut shifts = Vec::new();
        let mut held = workspace.promise("point index", 4096)?;
        if file.is_gone() {
            // The points will not be read any more, but their bounding box may be.
            boxes.push(self.bounds());
        } else {
            let (pages, end) = (files.index.total(workspace)?, self.len.div_ceil(page));
            if file.records() < self.len as u64 || pages < end as u64 {
                let found = format!("{} points in {pages} pages", file.records());
                return Err(file.damaged(0, 0, found, format!("{} points", self.len)));
            }
            // A tree of boxes has a seventh more of them than there are pages.
            held.at_least(pages * 33 + 4096)?;
            held.set_held(pages * 33 + 4096);
            files.read_index(&workspace.unit(), end, |row| {
                checks.push(row.crc);
                shifts.push(row.shift.min(31) as u8);
                boxes.push(row.bounds());
            })?;
            let mut first = 0;
            while first < end {
                let place = file.section(first / STEP);
                parts.push(Part {
                    first,
                    segment: place.segment,
                    offset: place.offset,
                });
                let pages = place.records.div_ceil(page);
                first += pages.next_multiple_of(STEP).max(STEP);
            }
        }
        let mut levels = vec![boxes];
        while levels.last().is_some_and(|top| top.len() > FAN) {
            let next = levels[levels.len() - 1]
                .chunks(FAN)
                .map(|boxes| boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b)))
                .collect();
            levels.push(next);
        }
        let mapped = if file.is_gone() { None } else { file.map() };
        Ok(PointStore {
            mapped,
            file,
            parts,
            len: self.len,
            page,
            checks,
            shifts,
            levels,
            _held: held,
        })
    }

    /// Deletes the files.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        workspace.files.release(&self.name)?;
        index_of(&self.name).release(workspace)
    }
}

/// Pages that lie one after another in a segment.
#[derive(Debug)]
struct Part {
    /// Number of the first page.
    first: usize,
    segment: u32,
    /// Offset of the first page.
    offset: u64,
}

/// Positions of all points by id, in packed pages on disk; 29/256 bytes for each point in memory.
#[derive(Debug)]
pub struct PointStore {
    file: Arc<ScratchFile>,
    parts: Vec<Part>,
    len: usize,
    page: usize,
    /// CRC-32 of each page.
    checks: Vec<u32>,
    /// Bits left out of each coordinate, for each page.
    shifts: Vec<u8>,
    /// `levels[0]` has a box for each page; each further level has one box for `FAN` boxes of the previous
    /// level.
    levels: Vec<Vec<Aabb>>,
    /// The segments that are mapped, by number, and their reservation.
    mapped: Option<(HashMap<u32, Mapping>, Reservation)>,
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

    /// Points in a page.
    #[must_use]
    pub fn page_size(&self) -> usize {
        self.page
    }

    /// Number of pages.
    #[must_use]
    pub fn pages(&self) -> usize {
        self.levels[0].len()
    }

    /// The bounding box of a page.
    #[must_use]
    pub fn page_box(&self, page: usize) -> &Aabb {
        &self.levels[0][page]
    }

    /// Ids of the points of a page.
    #[must_use]
    pub fn page_ids(&self, page: usize) -> Range<usize> {
        page * self.page..((page + 1) * self.page).min(self.len)
    }

    /// The bounding box of all points.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.levels.last().map_or(Aabb::EMPTY, |top| {
            top.iter().fold(Aabb::EMPTY, |a, b| a.union(*b))
        })
    }

    /// Number of levels of the box tree; level 0 is the pages.
    #[must_use]
    pub fn tree_levels(&self) -> usize {
        self.levels.len()
    }

    /// The boxes of a level.
    #[must_use]
    pub fn tree_boxes(&self, level: usize) -> &[Aabb] {
        &self.levels[level]
    }

    /// The children in `level - 1` of node `index` of `level`.
    #[must_use]
    pub fn tree_children(&self, level: usize, index: usize) -> Range<usize> {
        index * FAN..((index + 1) * FAN).min(self.levels[level - 1].len())
    }

    /// Calls `each` with all pages whose box is within squared distance `d2` of `target`, ascending, until it
    /// returns false.
    pub fn pages_near(&self, target: &Aabb, d2: u64, each: &mut dyn FnMut(usize) -> bool) {
        let top = self.levels.len() - 1;
        let mut nodes = 0..self.levels[top].len();
        nodes.all(|node| self.descend(top, node, target, d2, each));
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

    fn packing(&self, page: usize) -> Packing {
        Packing::of(&self.levels[0][page], self.shifts[page])
    }

    /// Calls `each` with the layout and the packed bytes of consecutive pages, in order.
    fn packed_pages(
        &self,
        pages: Range<usize>,
        mut each: impl FnMut(usize, Packing, &[u8]),
    ) -> Result<()> {
        if pages.end > self.checks.len() {
            let found = format!("{} pages", self.checks.len());
            let expected = format!("page {}", pages.end);
            return Err(self.file.damaged(0, 0, found, expected));
        }
        let mut number = self.parts.partition_point(|part| part.first <= pages.start);
        let mut start = pages.start;
        while start < pages.end {
            let next = self.parts.get(number).map_or(pages.end, |next| next.first);
            let end = next.min(pages.end);
            self.part_pages(&self.parts[number - 1], start..end, &mut each)?;
            (start, number) = (end, number + 1);
        }
        Ok(())
    }

    /// As [`PointStore::packed_pages`], for pages of one part.
    fn part_pages(
        &self,
        part: &Part,
        pages: Range<usize>,
        each: &mut impl FnMut(usize, Packing, &[u8]),
    ) -> Result<()> {
        let bytes = |page| self.packing(page).bytes(self.page_ids(page).len());
        let before: usize = (part.first..pages.start).map(bytes).sum();
        let (mut at, wanted) = (part.offset + before as u64, pages.clone().map(bytes).sum());
        let mapping = self
            .mapped
            .as_ref()
            .and_then(|map| map.0.get(&part.segment));
        let view = self.file.view(part.segment, mapping, at, wanted)?;
        let mut left: &[u8] = &view;
        for page in pages {
            let (packed, rest) = left.split_at(bytes(page));
            let crc = crc32fast::hash(packed);
            if crc != self.checks[page] {
                let expected = format!("{:08x}", self.checks[page]);
                let found = format!("checksum {crc:08x}");
                return Err(self.file.damaged(part.segment, at, found, expected));
            }
            each(page, self.packing(page), packed);
            (left, at) = (rest, at + packed.len() as u64);
        }
        Ok(())
    }

    /// Reads consecutive pages into columns, which are as long as the pages have points.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if a page does not match its checksum.
    pub fn read_columns(&self, pages: Range<usize>, columns: [&mut [i32]; 3]) -> Result<()> {
        let mut columns = columns;
        self.packed_pages(pages, |page, packing, bytes| {
            let points = self.page_ids(page).len();
            let page = columns.each_mut().map(|column| {
                let (page, rest) = std::mem::take(column).split_at_mut(points);
                *column = rest;
                page
            });
            packing.unpack(bytes, page);
        })
    }

    /// Reads consecutive pages and appends their points to `points`.
    ///
    /// # Errors
    /// See [`PointStore::read_columns`].
    pub fn read_pages(&self, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        let mut columns = [0, 1, 2].map(|_| vec![0; self.page]);
        self.packed_pages(pages, |page, packing, bytes| {
            let count = self.page_ids(page).len();
            packing.unpack(bytes, columns.each_mut().map(|column| &mut column[..count]));
            let [x, y, z] = &columns;
            points.extend((0..count).map(|n| [x[n], y[n], z[n]]));
        })
    }

    /// Appends the positions of ascending `ids` to `points`, in the same order.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::stages::order::Orderer;
    use crate::workspace::Workspace;

    /// Found by fuzzing: the journal gives a number of points for a file that no longer exists, and a stage
    /// reads it nevertheless.
    #[test]
    fn a_store_whose_file_is_gone_is_not_read() {
        let workspace = Workspace::for_tests(1);
        let orderer = Orderer::new(&workspace).unwrap();
        let points: Vec<Point> = (0..10).map(|k| [k, k * k, 1]).collect();
        orderer.push(&workspace, &points).unwrap();
        let (stored, _) = orderer.finish(&workspace, 4).unwrap();
        let mut store = stored.open(&workspace).unwrap();
        assert_eq!(store.slice(0..10).unwrap().len(), 10);
        store.checks.clear();
        store.len = usize::MAX / 64;
        for range in [0..1, 5..store.len] {
            assert!(matches!(store.slice(range), Err(Error::Corrupt { .. })));
        }
        assert!(store.fetch(&[3], &mut Vec::new()).is_err());
    }
}
