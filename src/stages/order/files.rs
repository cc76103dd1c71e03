//! The files of an ordered store that is written: packed pages, and their index.

use super::packed::{Packing, pack};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, row};
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use serde::{Deserialize, Serialize};
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

    pub fn packing(&self) -> Packing {
        Packing::of(&self.bounds(), self.shift.min(31) as u8)
    }
}

/// The pages of a store. Pages written together form a section; its number is that of its first page divided
/// by [`STEP`].
type Index = Table<PageRow>;

/// The first page of every write has a number that is a multiple of this.
pub(super) const STEP: usize = 16;

/// Pages written at a time, a multiple of [`STEP`].
pub(super) const WRITTEN: usize = 64;

/// An ordered store in the scratch folder: the name of its file and its size.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredPoints {
    pub(super) name: String,
    pub(super) len: usize,
    pub(super) page: usize,
    /// The bounding box of all points.
    pub(super) bounds: [Point; 2],
}

/// The table of pages of the store `name`.
pub(super) fn index_of(name: &str) -> Index {
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
        let group = end.saturating_sub(WRITTEN);
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
