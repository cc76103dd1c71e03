//! The ordered store: positions by id in one file, in pages, with a tree of page boxes in memory.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::spill::{Table, row};
use crate::workspace::file::ScratchFile;
use crate::workspace::memory::Reservation;
use std::ops::Range;

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

/// The pages of a store. Pages written together form a section; its number is that of its first page divided
/// by 16.
pub(super) type Index = Table<PageRow>;

/// Points in a page, except in tests.
pub const PAGE: usize = 256;

/// Children of a node of the box tree.
pub(super) const FAN: usize = 8;

/// Positions of all points by id; 12 bytes for each point on disk, 28/256 in memory.
#[derive(Debug)]
pub struct PointStore {
    pub(super) file: ScratchFile,
    pub(super) len: usize,
    pub(super) page: usize,
    pub(super) checks: Vec<u32>,
    /// `levels[0]` has a box for each page; each further level has one box for `FAN` boxes of the previous
    /// level.
    pub(super) levels: Vec<Vec<Aabb>>,
    /// Checksums and boxes on disk, needed if the run is resumed.
    pub(super) _index: Option<Index>,
    pub(super) _held: Reservation,
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

    /// Reads consecutive pages and appends their points to `points`.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if a page does not match its checksum.
    pub fn read_pages(&self, pages: Range<usize>, points: &mut Vec<Point>) -> Result<()> {
        if pages.end > self.checks.len() {
            let offset = (self.checks.len() * self.page * 12) as u64;
            let found = format!("{} pages", self.checks.len());
            return Err(self
                .file
                .damaged(offset, found, format!("page {}", pages.end)));
        }
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
        let (mut store, _) = orderer.finish(&workspace, 4).unwrap();
        assert_eq!(store.slice(0..10).unwrap().len(), 10);
        store.checks.clear();
        store.len = usize::MAX / 64;
        for range in [0..1, 5..store.len] {
            assert!(matches!(store.slice(range), Err(Error::Corrupt { .. })));
        }
        assert!(store.fetch(&[3], &mut Vec::new()).is_err());
    }
}
