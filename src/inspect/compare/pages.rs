//! Triangles or points to which distances are measured: in curve order, in pages on disk, with an R\*-tree of
//! the pages' boxes in memory.
//!
//! The size of a page depends only on the number of items. For more items pages grow, and not their number,
//! so the tree stays small.

mod writer;

pub(crate) use writer::{KeptPages, PageWriter};

use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, Row};
#[cfg(feature = "pictures")]
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::boxes::BoxTree;
use outcrop_geom::distance;
use outcrop_geom::vector::{Box3, V3, dot, sub};
use rustc_hash::FxHashMap;
use std::cell::Cell;

/// Pages that one thread takes at a time.
#[cfg(feature = "pictures")]
const RUN: usize = 256;

/// Items that share a box within a page.
const LEAF: usize = 8;

/// Positions of one query of the tree.
const TOGETHER: usize = 32;

/// Most pages near such a run of positions; if there are more, the tree is queried for each position.
const MOST_NEAR: usize = 64;

/// An item with a distance from a point.
pub(crate) trait Item: Row {
    fn bounds(&self) -> Box3;
    fn distance2(&self, p: V3) -> f64;

    /// True if it is easily told that the squared distance from `p` is not below `limit`.
    fn is_beyond(&self, _p: V3, _limit: f64) -> bool {
        false
    }
}

impl Item for V3 {
    #[inline]
    fn bounds(&self) -> Box3 {
        Box3 {
            min: *self,
            max: *self,
        }
    }

    fn distance2(&self, p: V3) -> f64 {
        let d = sub(*self, p);
        dot(d, d)
    }
}

impl Item for [V3; 3] {
    #[inline]
    fn bounds(&self) -> Box3 {
        // Not `Box3::of`, which is no part of the inner loop here.
        let [a, b, c] = self;
        Box3 {
            min: std::array::from_fn(|k| a[k].min(b[k]).min(c[k])),
            max: std::array::from_fn(|k| a[k].max(b[k]).max(c[k])),
        }
    }

    fn distance2(&self, p: V3) -> f64 {
        distance::distance2(self, p)
    }

    fn is_beyond(&self, p: V3, limit: f64) -> bool {
        self.bounds().distance2(p) >= limit
    }
}

/// Pages of items.
#[derive(Debug)]
pub(crate) struct Pages<T: Row> {
    stored: LocalTable<T>,
    /// The boxes around the pages.
    tree: BoxTree<f64>,
    bounds: Box3,
    page: usize,
    _held: Reservation,
}

impl<T: Item> Pages<T> {
    /// The box around all items.
    pub(crate) fn bounds(&self) -> Box3 {
        self.bounds
    }

    /// Number of items.
    pub(crate) fn total(&self) -> u64 {
        self.stored.total()
    }

    /// Reads the items of a page into `items`, which is cleared first.
    pub(crate) fn get_into(&self, page: usize, items: &mut Vec<T>) -> Result<()> {
        self.stored.get_into(page, items)
    }

    /// Items of a page, but the last.
    pub(crate) fn page(&self) -> usize {
        self.page
    }

    /// Number of pages.
    pub(crate) fn count(&self) -> usize {
        self.stored.count()
    }

    /// Bytes of a page in memory, with those for reading it.
    pub(crate) fn page_bytes(&self) -> u64 {
        let boxes = self.page.div_ceil(LEAF) * size_of::<Box3>();
        (2 * self.page * size_of::<T>() + boxes + 128) as u64
    }

    /// Calls `each` with the items of every page, in order.
    pub(crate) fn for_each_page(&self, mut each: impl FnMut(&[T]) -> Result<()>) -> Result<()> {
        let mut items = Vec::new();
        for page in 0..self.count() {
            self.stored.get_into(page, &mut items)?;
            each(&items)?;
        }
        Ok(())
    }

    /// Calls `each` with the first items of at most `most` pages.
    #[cfg(feature = "pictures")]
    pub(super) fn some(&self, most: usize, mut each: impl FnMut(&T)) -> Result<()> {
        let mut items = Vec::new();
        for page in (0..self.count()).step_by(self.count().div_ceil(most).max(1)) {
            self.stored.get_into(page, &mut items)?;
            items.first().into_iter().for_each(&mut each);
        }
        Ok(())
    }

    /// Calls `each` with the items of every page, on all threads.
    #[cfg(feature = "pictures")]
    pub(super) fn visit(&self, workspace: &Workspace, each: impl Fn(&[T]) + Sync) -> Result<()> {
        let (runs, bytes) = (self.count().div_ceil(RUN), self.page_bytes());
        workspace.for_each_unit(
            "draw: pages",
            runs,
            |_| bytes,
            |unit| {
                let mut items = Vec::new();
                let first = unit.number() * RUN;
                for page in first..(first + RUN).min(self.count()) {
                    self.stored.get_into(page, &mut items)?;
                    each(&items);
                }
                Ok(())
            },
        )
    }

    fn load(&self, page: usize) -> Result<Page<T>> {
        let items = self.stored.get(page)?;
        let boxes = items.chunks(LEAF).map(|leaf| {
            let all = leaf.iter().map(T::bounds);
            all.fold(Box3::EMPTY, Box3::union)
        });
        Ok(Page {
            boxes: boxes.collect(),
            items,
        })
    }

    /// The squared distances from positions to the nearest item, in their order; infinite if there is none.
    /// Positions that follow each other should be near each other: the tree is queried once for a run of them.
    pub(crate) fn distances2(
        &self,
        positions: &[V3],
        searcher: &mut Searcher<T>,
    ) -> Result<Vec<f64>> {
        let Searcher { cache, near } = searcher;
        let mut found = Vec::with_capacity(positions.len());
        let Some(mut item) = self.first(positions, cache)? else {
            found.resize(positions.len(), f64::INFINITY);
            return Ok(found);
        };
        for run in positions.chunks(TOGETHER) {
            // The nearest item of each position is not farther than this one, so it is in one of these pages.
            let around = Box3::of(run);
            let far = run.iter().map(|p| item.distance2(*p));
            let far = far.fold(0.0, f64::max);
            let reach = |min, max| Box3 { min, max }.distance2_box(&around) <= far;
            near.clear();
            near.extend(self.tree.that(reach).take(MOST_NEAR + 1));
            for &p in run {
                let mut best = Best {
                    distance2: item.distance2(p),
                    item,
                };
                match near.len() {
                    0..=MOST_NEAR => {
                        for &(page, [min, max]) in &*near {
                            if (Box3 { min, max }).distance2(p) < best.distance2 {
                                cache.page(self, page)?.look(p, &mut best);
                            }
                        }
                    }
                    _ => self.descend(p, &mut best, cache)?,
                }
                item = best.item;
                found.push(best.distance2);
            }
        }
        Ok(found)
    }

    /// Calls `each` with all items whose boxes meet another one, in their order.
    pub(crate) fn meeting(
        &self,
        around: &Box3,
        searcher: &mut Searcher<T>,
        mut each: impl FnMut(&T),
    ) -> Result<()> {
        let Searcher { cache, near } = searcher;
        let meets = |Box3 { min, max }: &Box3| {
            let mut axes = min.iter().zip(max).zip(around.min.iter().zip(&around.max));
            axes.all(|((min, max), (low, high))| min <= high && low <= max)
        };
        near.clear();
        near.extend(self.tree.that(|min, max| meets(&Box3 { min, max })));
        near.sort_unstable_by_key(|(page, _)| *page);
        for (page, _) in &*near {
            let page = cache.page(self, *page)?;
            for (leaf, bounds) in page.items.chunks(LEAF).zip(&page.boxes) {
                if meets(bounds) {
                    let items = leaf.iter().filter(|item| meets(&item.bounds()));
                    items.for_each(&mut each);
                }
            }
        }
        Ok(())
    }

    /// The nearest item of the page whose box is nearest to the first position.
    fn first(&self, positions: &[V3], cache: &mut Cache<T>) -> Result<Option<T>> {
        let nearest = positions
            .first()
            .and_then(|p| Some((*p, self.tree.nearest(*p).next()?)));
        let Some((p, (_, page))) = nearest else {
            return Ok(None);
        };
        let page = cache.page(self, page)?;
        let best = page.items.first().map(|item| {
            let mut best = Best {
                distance2: f64::INFINITY,
                item: *item,
            };
            page.look(p, &mut best);
            best.item
        });
        Ok(best)
    }

    /// Updates `best` if an item is nearer to `p`, by a descent of the tree.
    fn descend(&self, p: V3, best: &mut Best<T>, cache: &mut Cache<T>) -> Result<()> {
        let limit = Cell::new(best.distance2);
        let nearer = |min, max| Box3 { min, max }.distance2(p) < limit.get();
        for (page, _) in self.tree.that(nearer) {
            cache.page(self, page)?.look(p, best);
            limit.set(best.distance2);
        }
        Ok(())
    }
}

/// The nearest item so far and its squared distance.
#[derive(Debug, Clone, Copy)]
struct Best<T> {
    distance2: f64,
    item: T,
}

/// A page in memory.
#[derive(Debug)]
struct Page<T> {
    items: Vec<T>,
    boxes: Vec<Box3>,
}

impl<T> Page<T> {
    fn look(&self, p: V3, best: &mut Best<T>)
    where
        T: Item,
    {
        for (leaf, bounds) in self.items.chunks(LEAF).zip(&self.boxes) {
            if bounds.distance2(p) >= best.distance2 {
                continue;
            }
            for item in leaf {
                if item.is_beyond(p, best.distance2) {
                    continue;
                }
                let distance2 = item.distance2(p);
                if distance2 < best.distance2 {
                    *best = Best {
                        distance2,
                        item: *item,
                    };
                }
            }
        }
    }
}

/// The pages at hand and the buffer of one thread for its searches.
#[derive(Debug)]
pub(crate) struct Searcher<T> {
    cache: Cache<T>,
    /// Pages near a run of positions, with their lowest and highest corners.
    near: Vec<(usize, [V3; 2])>,
}

impl<T> Searcher<T> {
    /// Keeps at most `most` pages in memory.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            cache: Cache::new(most),
            near: Vec::new(),
        }
    }
}

/// Cache of recently read pages.
#[derive(Debug)]
struct Cache<T> {
    pages: FxHashMap<usize, Page<T>>,
    most: usize,
}

impl<T> Cache<T> {
    /// A cache of at most `most` pages.
    fn new(most: usize) -> Self {
        Self {
            pages: FxHashMap::default(),
            most: most.max(1),
        }
    }

    fn page(&mut self, pages: &Pages<T>, page: usize) -> Result<&Page<T>>
    where
        T: Item,
    {
        if self.pages.len() >= self.most && !self.pages.contains_key(&page) {
            // Samples come in curve order, so the old pages are not needed any more.
            self.pages.clear();
        }
        match self.pages.entry(page) {
            std::collections::hash_map::Entry::Occupied(found) => Ok(found.into_mut()),
            std::collections::hash_map::Entry::Vacant(empty) => Ok(empty.insert(pages.load(page)?)),
        }
    }
}
