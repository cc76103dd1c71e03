//! The ordered store: positions by id in one file, in pages, with their boxes and an R\*-tree in memory.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::geom::boxes::BoxTree;
use crate::spill::{Table, row};
use crate::workspace::file::ScratchFile;
use crate::workspace::memory::Reservation;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

row! {
    /// Checksum and bounding box of a page.
    pub struct PageRow {
        /// CRC-32 of the page.
        crc: u32,
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
}

/// The pages of a store. Pages written together form a section; its number is that of its first page divided
/// by [`STEP`].
type Index = Table<PageRow>;

/// The first page of every write has a number that is a multiple of this.
pub(super) const STEP: usize = 16;

/// Points in a page, except in tests.
pub const PAGE: usize = 256;

/// Pages in a group, a box of the tree, for which this leaves 4 bytes a page. Consecutive pages are near on the
/// curve, so groups are compact.
const GROUP: usize = 32;

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

    /// Writes pages to the segment of the current thread.
    pub fn write(&self, workspace: &Workspace, points: &[Point]) -> Result<Written> {
        let (worker, bytes) = (workspace.files.worker(), bytemuck::cast_slice(points));
        let place = self.file.append(worker, bytes, points.len())?;
        let page = |page: &[Point]| {
            let crc = crc32fast::hash(bytemuck::cast_slice(page));
            let Aabb { min, max } = Aabb::of(page);
            PageRow { crc, min, max }
        };
        Ok((points.chunks(self.page).map(page).collect(), place))
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

    /// Opens the store: reads its index and builds the R\*-tree.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`].
    pub fn open(&self, workspace: &Workspace) -> Result<PointStore> {
        let files = StoreFiles::open(workspace, &self.name, self.page)?;
        let (file, page) = (files.file.clone(), files.page);
        let (mut parts, mut checks, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
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
            // A box, a checksum, and 4 bytes of the tree.
            held.at_least(pages * 32 + 4096)?;
            held.set_held(pages * 32 + 4096);
            files.read_index(&workspace.unit(), end, |row| {
                checks.push(row.crc);
                boxes.push(row.bounds());
            })?;
            let mut first = 0;
            while first < end {
                let place = file.section(first / STEP);
                let (segment, offset) = (place.segment, place.offset);
                parts.push(Part {
                    first,
                    segment,
                    offset,
                });
                let pages = place.records.div_ceil(page);
                first += pages.next_multiple_of(STEP).max(STEP);
            }
        }
        Ok(PointStore {
            file,
            parts,
            len: self.len,
            page,
            checks,
            tree: BoxTree::of(boxes.chunks(GROUP).map(|pages| Aabb::around(pages).wide(0))),
            boxes,
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

/// Positions of all points by id; 12 bytes for each point on disk, 32 for each page in memory.
#[derive(Debug)]
pub struct PointStore {
    file: Arc<ScratchFile>,
    parts: Vec<Part>,
    len: usize,
    page: usize,
    checks: Vec<u32>,
    /// The bounding box of each page.
    boxes: Vec<Aabb>,
    /// The bounding boxes of groups of [`GROUP`] pages.
    tree: BoxTree<i64>,
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
    pub fn pages_near(&self, target: &Aabb, reach: u64, most: usize, found: &mut Vec<u32>) -> bool {
        found.clear();
        let near = |page: &usize| self.boxes[*page].distance2_box(target) <= reach * reach;
        for group in self.tree.meeting(target.wide(reach as i64)) {
            found.extend(self.group(group).filter(near).map(|page| page as u32));
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

    /// Reads consecutive pages and appends their points to `points`.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if a page does not match its checksum.
    pub fn read_pages(&self, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        if pages.end > self.checks.len() {
            let found = format!("{} pages", self.checks.len());
            let expected = format!("page {}", pages.end);
            return Err(self.file.damaged(0, 0, found, expected));
        }
        let mut part = self.parts.partition_point(|part| part.first <= pages.start);
        let mut start = pages.start;
        while start < pages.end {
            let next = self.parts.get(part).map_or(pages.end, |next| next.first);
            let end = next.min(pages.end);
            self.read_from(&self.parts[part - 1], start..end, points)?;
            (start, part) = (end, part + 1);
        }
        Ok(())
    }

    /// Reads pages of one part.
    fn read_from(&self, part: &Part, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        let ids = pages.start * self.page..(pages.end * self.page).min(self.len);
        let before = points.len();
        points.resize(before + ids.len(), [0; 3]);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut points[before..]);
        let at = |page: usize| part.offset + ((page - part.first) * self.page * 12) as u64;
        self.file.read(part.segment, at(pages.start), bytes)?;
        for (page, bytes) in pages.zip(bytes.chunks(self.page * 12)) {
            let crc = crc32fast::hash(bytes);
            if crc != self.checks[page] {
                let expected = format!("{:08x}", self.checks[page]);
                let found = format!("checksum {crc:08x}");
                return Err(self.file.damaged(part.segment, at(page), found, expected));
            }
        }
        Ok(())
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
