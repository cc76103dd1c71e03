//! Tiles: contiguous id ranges of the ordered store, with a halo of surrounding pages.
//!
//! Each page of a tile has a *reach*: all points within this distance of the page's box are in the tile. The
//! reach is proportional to the size of the page, so it follows the local density. A query that needs points
//! beyond the reach is answered from the whole store ([`walk::Walk`]).

mod candidates;
mod chosen;
mod halo;
pub mod near;
pub mod neighbors;
mod points;
pub mod walk;
pub mod wanted;

use crate::ids::{Id, PageNumber};
use crate::order::PointStore;
use chosen::Chosen;
use halo::{Reach, halo};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::aabb::Aabb;
use outcrop_paper::kernels::{BLOCK, Boxes};
use points::Points;
use std::ops::Range;

/// Leaves in a page. A leaf is the unit for which candidates are gathered and queries answered. The boxes of
/// the leaves of a page are one block of the kernels.
const LEAVES: usize = BLOCK;

/// Most halo pages for each page of the tile itself.
const MOST_HALO: usize = 4;

/// Most consecutive pages read at a time.
const READ: usize = 16;

/// A neighbour of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Near {
    /// Exact squared distance in steps.
    pub distance2: u64,
    /// The neighbour's id; breaks ties of distance.
    pub id: Id,
    /// Position minus the query's position.
    pub difference: [i64; 3],
}

/// A page of the tile that contains points of its id range.
#[derive(Debug, Clone)]
struct OwnPage {
    /// Its index in the tile's pages.
    local: usize,
    /// The pages of the tile within reach, as a range of `Tile::near`.
    near: Range<usize>,
    /// Squared reach in steps.
    reach2: u64,
}

/// A range of the store and its surroundings, in memory.
#[derive(Debug)]
pub struct Tile {
    ids: Range<usize>,
    page: usize,
    leaf: usize,
    /// Page numbers, ascending.
    pages: Vec<usize>,
    points: Points,
    page_boxes: Vec<Aabb>,
    /// `LEAVES` boxes for each page; the last page may have fewer leaves.
    leaf_boxes: Boxes,
    own: Vec<OwnPage>,
    near: Vec<u32>,
    /// The points that can be neighbours; `None` if all can.
    chosen: Option<Chosen>,
}

impl Tile {
    /// Upper estimate of the bytes of a tile of `points` points with the largest halo, and of a search in it.
    #[must_use]
    pub fn estimate(points: usize) -> u64 {
        let most = (points as u64 + 256) * (1 + MOST_HALO as u64);
        most * (15 + near::CANDIDATE) + (3 << 20)
    }

    /// Loads the tile of the points `ids`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn load(store: &PointStore, ids: Range<usize>) -> Result<Self> {
        Self::load_some(store, ids, |_| true)
    }

    /// As [`Tile::load`], but only with the pages that contain `wanted` points, and their halo; other points
    /// cannot be queried.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn load_some(
        store: &PointStore,
        ids: Range<usize>,
        wanted: impl Fn(usize) -> bool,
    ) -> Result<Self> {
        let page = store.page_size();
        let own_pages = (ids.start / page..ids.end.div_ceil(page)).filter(|&number| {
            let Range { start, end } = store.page_ids(number);
            (start.max(ids.start)..end.min(ids.end)).any(&wanted)
        });
        let own_pages: Vec<usize> = own_pages.collect();
        let (wanted, reaches) = halo(store, &own_pages, ids.len().div_ceil(page));
        let mut points = Points::with_capacity(wanted.len() * page);
        let runs = wanted.chunk_by(|page, next| page + 1 == *next);
        for run in runs.flat_map(|run| run.chunks(READ)) {
            let pages = run[0]..run[0] + run.len();
            let ids = store.page_ids(pages.start).start..store.page_ids(pages.end - 1).end;
            points.extend(ids.len(), |columns| store.read_columns(pages, columns))?;
        }
        let leaf = page.div_ceil(LEAVES);
        let page_boxes = wanted.iter().map(|&p| *store.page_box(p)).collect();
        let mut tile = Self {
            ids,
            page,
            leaf,
            pages: wanted,
            points,
            page_boxes,
            leaf_boxes: Boxes::default(),
            own: Vec::new(),
            near: Vec::new(),
            chosen: None,
        };
        tile.index(reaches);
        Ok(tile)
    }

    /// From now on, only points whose ids are `chosen` can be neighbours; others can still be queried.
    pub fn choose(&mut self, chosen: impl Fn(usize) -> bool) {
        let page = self.page;
        let pages = (self.pages.iter()).flat_map(|number| number * page..(number + 1) * page);
        let ids = pages.take(self.points.len());
        self.chosen = Some(Chosen::of(ids.map(chosen)));
    }

    /// True if point `index` can be a neighbour.
    fn is_chosen(&self, index: usize) -> bool {
        self.chosen.as_ref().is_none_or(|chosen| chosen.get(index))
    }

    /// Bytes of [`Tile::estimate`] that neither the tile nor a search in it takes.
    #[must_use]
    pub fn spare(&self) -> u64 {
        // At most all points near a page are candidates of one of its points.
        let pages = self.own.iter().map(|own| own.near.len()).max();
        let search = (pages.unwrap_or(0) * self.page) as u64 * near::CANDIDATE;
        Self::estimate(self.ids.len()).saturating_sub(self.bytes() + search)
    }

    /// Allocated bytes of its lists.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let lists = bytes_of(&self.pages) + self.points.bytes() + bytes_of(&self.page_boxes);
        let chosen = self.chosen.as_ref().map_or(0, Chosen::bytes);
        lists + self.leaf_boxes.bytes() + bytes_of(&self.own) + bytes_of(&self.near) + chosen
    }

    fn index(&mut self, reaches: Vec<Reach>) {
        self.leaf_boxes.reserve(self.pages.len() * LEAVES);
        for number in 0..self.pages.len() * LEAVES {
            // Leaves without points get a box that is never searched.
            let bounds = self.leaf(number).map(|leaf| self.points.bounds(leaf));
            let Aabb { min, max } = bounds.unwrap_or(Aabb::of(&[[0; 3]]));
            self.leaf_boxes.push(min, max, number as u32);
        }
        for reach in reaches {
            let begin = self.near.len();
            let local = |page: &PageNumber| self.pages.binary_search(&page.index()).ok();
            let near = reach.near.iter().filter_map(local);
            self.near.extend(near.map(|local| local as u32));
            if let Ok(local) = self.pages.binary_search(&reach.page) {
                self.own.push(OwnPage {
                    local,
                    near: begin..self.near.len(),
                    reach2: reach.reach2,
                });
            }
        }
    }

    /// The indices in `points` of a page; only the last page of the store can be shorter.
    fn range(&self, local: usize) -> Range<usize> {
        let start = local * self.page;
        start..(start + self.page).min(self.points.len())
    }

    /// The indices in `points` of a leaf, numbered page by page; `None` if it is empty.
    #[inline(always)]
    fn leaf(&self, number: usize) -> Option<Range<usize>> {
        let page = self.range(number / LEAVES);
        let start = page.start + number % LEAVES * self.leaf;
        (start < page.end).then(|| start..(start + self.leaf).min(page.end))
    }

    /// The id of point `index` of a page.
    fn id(&self, local: usize, index: usize) -> usize {
        self.pages[local] * self.page + index
    }

    /// The ids of the tile, without the halo.
    #[must_use]
    pub fn ids(&self) -> Range<usize> {
        self.ids.clone()
    }
}

#[cfg(test)]
mod tests;
