//! Tiles: contiguous id ranges of the ordered store with a halo of the pages around them.
//!
//! Each page of a tile has a *reach*: all points within this distance of the page's box are in the
//! tile. It follows the page's own extent, so it follows the local density. What a query needs
//! beyond its reach, it asks of the whole store ([`walk::Walk`]).

mod candidates;
pub mod near;
pub mod neighbors;
pub mod walk;

use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::stages::order::PointStore;
use crate::workspace::memory::{Holding, bytes_of, give_back};
use std::ops::Range;

/// Leaves per page: the unit in which candidates are gathered and queries answered.
const LEAVES: usize = 16;

/// Most pages that the reach of one page may touch; an outlier's page shrinks its reach instead.
const MOST_NEAR: usize = 96;

/// Where a reach touches no more pages it is made longer,
const FEW_NEAR: usize = 20;

/// up to so many times.
const MOST_TIMES: u64 = 4;

/// Most halo pages for each page of the tile itself.
const MOST_HALO: usize = 4;

/// A neighbour of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Near {
    /// Exact squared distance in steps.
    pub distance2: u64,
    /// The neighbour's id; breaks ties of distance.
    pub id: u32,
    /// Position minus the query's position.
    pub difference: [i64; 3],
}

/// A page of the tile that holds points of its own range.
#[derive(Debug, Clone)]
struct OwnPage {
    /// Index among the tile's pages.
    local: usize,
    /// Which of the tile's pages are within reach: a range of `Tile::near`.
    near: Range<usize>,
    /// Squared reach in steps.
    reach2: u64,
}

/// A slice of the store and what surrounds it, in memory.
#[derive(Debug)]
pub struct Tile {
    ids: Range<usize>,
    page: usize,
    leaf: usize,
    /// Ascending page numbers.
    pages: Vec<usize>,
    points: Vec<Point>,
    page_boxes: Vec<Aabb>,
    leaf_boxes: Vec<Aabb>,
    own: Vec<OwnPage>,
    near: Vec<usize>,
    held: Holding,
}

impl Tile {
    /// Bytes that a tile of `points` points takes with the largest halo.
    #[must_use]
    pub fn bytes(points: usize) -> u64 {
        (points as u64 + 256) * (1 + MOST_HALO as u64) * 15 + (1 << 20)
    }

    /// Loads the tile of the points `ids`.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn load(store: &PointStore, ids: Range<usize>) -> Result<Self> {
        Self::load_some(store, ids, |_| true)
    }

    /// As [`Tile::load`], but only pages with points that are `wanted`, and what surrounds these: others
    /// cannot be asked for.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
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
        let mut points = Vec::with_capacity(wanted.len() * page);
        let mut start = 0;
        while start < wanted.len() {
            let mut end = start + 1;
            while end < wanted.len() && wanted[end] == wanted[end - 1] + 1 {
                end += 1;
            }
            store.read_pages(wanted[start]..wanted[end - 1] + 1, &mut points)?;
            start = end;
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
            leaf_boxes: Vec::new(),
            own: Vec::new(),
            near: Vec::new(),
            held: Holding::default(),
        };
        tile.index(reaches);
        tile.held.set(tile.taken());
        give_back(Self::bytes(tile.ids.len()).saturating_sub(tile.taken()));
        Ok(tile)
    }

    /// Bytes that its lists take.
    fn taken(&self) -> u64 {
        let lists = bytes_of(&self.pages) + bytes_of(&self.points) + bytes_of(&self.page_boxes);
        lists + bytes_of(&self.leaf_boxes) + bytes_of(&self.own) + bytes_of(&self.near)
    }

    fn index(&mut self, reaches: Vec<(usize, u64, Vec<usize>)>) {
        for local in 0..self.pages.len() {
            let points = &self.points[self.range(local)];
            self.leaf_boxes
                .extend(points.chunks(self.leaf).map(Aabb::of));
            self.leaf_boxes.resize((local + 1) * LEAVES, Aabb::EMPTY);
        }
        for (number, reach2, near) in reaches {
            let begin = self.near.len();
            self.near
                .extend(near.iter().filter_map(|p| self.pages.binary_search(p).ok()));
            if let Ok(local) = self.pages.binary_search(&number) {
                self.own.push(OwnPage {
                    local,
                    near: begin..self.near.len(),
                    reach2,
                });
            }
        }
    }

    /// Where the points of a page lie in `points`; only the store's last page can be short.
    fn range(&self, local: usize) -> Range<usize> {
        let start = local * self.page;
        start..(start + self.page).min(self.points.len())
    }

    /// The id of point `index` of a page.
    fn id(&self, local: usize, index: usize) -> usize {
        self.pages[local] * self.page + index
    }

    /// The ids that belong to the tile itself.
    #[must_use]
    pub fn ids(&self) -> Range<usize> {
        self.ids.clone()
    }
}

/// A page, its squared reach and the pages within it.
type Reach = (usize, u64, Vec<usize>);

/// All pages of a tile of `size` pages, of which `own` are asked for, and the reaches of these; shorter
/// than usual where the halo would outgrow the tile, as it would around scattered outliers.
fn halo(store: &PointStore, own: &[usize], size: usize) -> (Vec<usize>, Vec<Reach>) {
    let most = size * (1 + MOST_HALO) + MOST_NEAR;
    let mut shrink = 1;
    loop {
        let mut wanted = own.to_vec();
        let mut reaches = Vec::with_capacity(own.len());
        for &number in own {
            let (reach2, near) = near_pages(store, number, shrink);
            wanted.extend_from_slice(&near);
            reaches.push((number, reach2, near));
        }
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.len() <= most || shrink > 1 << 40 {
            return (wanted, reaches);
        }
        shrink *= 2;
    }
}

/// Squared reach of a page and the pages within it.
fn near_pages(store: &PointStore, page: usize, shrink: i64) -> (u64, Vec<usize>) {
    let bounds = store.page_box(page);
    let mut reach = (bounds.longest_side() * 7 / 8 / shrink).max(1) as u64;
    if shrink == 1 {
        // Along a line neighbours are far, and pages few.
        reach *= lonely(store, bounds, reach);
    }
    loop {
        let mut near = Vec::new();
        store.pages_near(bounds, reach * reach, &mut |p| {
            near.push(p);
            near.len() <= MOST_NEAR
        });
        if near.len() <= MOST_NEAR || reach <= 1 {
            if near.len() <= MOST_NEAR {
                return (reach * reach, near);
            }
            return (0, vec![page]);
        }
        reach /= 2;
    }
}

/// How many times as far a page can reach and still touch few pages.
fn lonely(store: &PointStore, bounds: &Aabb, reach: u64) -> u64 {
    for times in [MOST_TIMES, MOST_TIMES / 2] {
        let (mut count, reach) = (0, reach * times);
        store.pages_near(bounds, reach * reach, &mut |_| {
            count += 1;
            count <= FEW_NEAR
        });
        if count <= FEW_NEAR {
            return times;
        }
    }
    1
}

#[cfg(test)]
mod tests;
