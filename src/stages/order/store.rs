//! The ordered store: positions by id in one file, in pages, with their boxes and an R\*-tree in memory.

use super::files::{STEP, StoreFiles, StoredPoints, index_of};
use super::packed::Packing;
use crate::ids::{Id, PageNumber};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::mapped::Mapping;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::boxes::BoxTree;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Points in a page, except in tests.
pub const PAGE: usize = 256;

/// Pages in a group, a box of the tree, for which this leaves 4 bytes a page. Consecutive pages are near on the
/// curve, so groups are compact.
const GROUP: usize = 32;

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

    /// Opens the store: reads its index and builds the R\*-tree.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`].
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
            // A box, a checksum, a shift, and 4 bytes of the tree.
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
        let mapped = file.map();
        Ok(PointStore {
            mapped,
            file,
            parts,
            len: self.len,
            page,
            checks,
            shifts,
            tree: BoxTree::of(boxes.chunks(GROUP).map(|pages| Aabb::around(pages).wide(0))),
            boxes,
            _held: held,
        })
    }

    /// Deletes the files.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
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

/// Positions of all points by id, in packed pages on disk; 33 bytes for each page in memory.
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
    /// The bounding box of each page.
    boxes: Vec<Aabb>,
    /// The bounding boxes of groups of [`GROUP`] pages.
    tree: BoxTree<i64>,
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
        self.boxes.len()
    }

    /// The bounding box of a page.
    #[must_use]
    pub fn page_box(&self, page: usize) -> &Aabb {
        &self.boxes[page]
    }

    /// Ids of the points of a page.
    #[must_use]
    pub fn page_ids(&self, page: usize) -> Range<usize> {
        page * self.page..((page + 1) * self.page).min(self.len)
    }

    /// The bounding box of all points.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::around(&self.boxes)
    }

    /// Replaces `found` by the pages whose box is within `reach` of `target`, ascending; if there are more
    /// than `most`, by some of them, and returns false.
    pub fn pages_near(
        &self,
        target: &Aabb,
        reach: u64,
        most: usize,
        found: &mut Vec<PageNumber>,
    ) -> bool {
        found.clear();
        let near = |page: &usize| self.boxes[*page].distance2_box(target) <= reach * reach;
        for group in self.tree.meeting(target.wide(reach as i64)) {
            found.extend(self.group(group).filter(near).map(PageNumber::at));
            if found.len() > most {
                return false;
            }
        }
        found.sort_unstable();
        true
    }

    /// Groups of pages with the squared distance of their box from a point, the nearest first.
    pub fn nearest_groups(&self, p: Point) -> impl Iterator<Item = (u64, Range<usize>)> {
        let groups = self.tree.nearest(p.map(i64::from));
        groups.map(|(distance2, group)| (distance2 as u64, self.group(group)))
    }

    /// The pages of a group.
    fn group(&self, group: usize) -> Range<usize> {
        group * GROUP..((group + 1) * GROUP).min(self.boxes.len())
    }

    fn packing(&self, page: usize) -> Packing {
        Packing::of(&self.boxes[page], self.shifts[page])
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
    /// [`outcrop_disk::error::Error::Io`]; [`outcrop_disk::error::Error::Corrupt`] if a page does not match its checksum.
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
    pub fn fetch(&self, ids: &[Id], points: &mut Vec<Point>) -> Result<()> {
        let mut buffer = Vec::new();
        let mut loaded = usize::MAX;
        for &id in ids {
            let page = id.index() / self.page;
            if page != loaded {
                buffer.clear();
                self.read_pages(page..page + 1, &mut buffer)?;
                loaded = page;
            }
            points.push(buffer[id.index() % self.page]);
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
    use crate::order::Orderer;
    use outcrop_disk::error::Error;
    use outcrop_disk::workspace::Workspace;

    /// Found by fuzzing: the journal gives a number of points for a file that no longer exists, and a stage
    /// reads it nevertheless.
    #[test]
    fn a_store_whose_file_is_gone_is_not_read() {
        let workspace = Workspace::for_tests(1).expect("a scratch folder");
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
        assert!(store.fetch(&[Id::new(3)], &mut Vec::new()).is_err());
    }
}
