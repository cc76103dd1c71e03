//! Neighbours in the whole store, nearest first, as many as are asked for: the second look for
//! points whose halo does not prove enough.

use super::Near;
use crate::error::Result;
use crate::geom::aabb::Aabb;
use crate::geom::{Point, distance2, sub};
use crate::stages::order::PointStore;
use crate::workspace::memory::{Holding, bytes_of};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Pages kept in memory by a [`PageCache`].
const CACHED_PAGES: usize = 1024;

/// Recently read pages of the store, one behind the other: the allocator has one list to find room for.
#[derive(Debug, Default)]
pub struct PageCache {
    points: Vec<Point>,
    /// Where the points of each page begin, and how many they are.
    pages: FxHashMap<usize, (usize, usize)>,
    /// Points that there were at one time.
    most: usize,
    held: Holding,
}

impl PageCache {
    /// Bytes that a full cache takes.
    #[must_use]
    pub fn bytes(store: &PointStore) -> u64 {
        (CACHED_PAGES * store.page_size() * 12) as u64
    }

    fn get(&mut self, store: &PointStore, page: usize) -> Result<&[Point]> {
        if let Some(&(start, len)) = self.pages.get(&page) {
            return Ok(&self.points[start..start + len]);
        }
        if self.pages.len() >= CACHED_PAGES {
            // Queries come in curve order: soon everything here is new again.
            self.pages.clear();
            self.points.clear();
        }
        if self.points.capacity() == 0 {
            // As far as it is not filled it is not there.
            self.points.reserve_exact(CACHED_PAGES * store.page_size());
        }
        let start = self.points.len();
        store.read_pages(page..page + 1, &mut self.points)?;
        self.most = self.most.max(self.points.len());
        self.held.set(self.most as u64 * 12);
        self.pages.insert(page, (start, self.points.len() - start));
        Ok(&self.points[start..])
    }
}

/// Points handed out before the search goes on; then twice as many, and so on.
const BATCH: usize = 32;

/// A node of the box tree that is not yet opened: its squared distance, level and index.
type Node = Reverse<(u64, usize, usize)>;

/// Best-first search from one point, a batch of neighbours at a time.
#[derive(Debug)]
pub struct Walk<'a> {
    store: &'a PointStore,
    cache: &'a mut PageCache,
    id: u32,
    point: Point,
    nodes: BinaryHeap<Node>,
    /// What is handed out next, with squared distance and id, farthest first.
    ready: Vec<(u64, u32, Point)>,
    /// Other points of opened pages, in no order.
    later: Vec<(u64, u32, Point)>,
    batch: usize,
    held: Holding,
}

impl<'a> Walk<'a> {
    /// A walk from point `id` at `point`.
    #[must_use]
    pub fn new(store: &'a PointStore, cache: &'a mut PageCache, id: u32, point: Point) -> Self {
        let level = store.tree_levels() - 1;
        let count = store.tree_boxes(level).len();
        let mut walk = Self {
            store,
            cache,
            id,
            point,
            nodes: BinaryHeap::new(),
            ready: Vec::new(),
            later: Vec::new(),
            batch: BATCH,
            held: Holding::default(),
        };
        (0..count).for_each(|index| walk.wait(level, index));
        walk
    }

    /// The next neighbour, nearest first by (distance, id), of all; `None` when there is no more.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn advance(&mut self) -> Result<Option<Near>> {
        self.advance_within(u64::MAX, |_| true)
    }

    /// As [`Walk::advance`], of those within the squared distance `within2` in boxes that `wanted` lets
    /// pass, maybe one that is not; what did not pass once is not asked for again.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn advance_within(
        &mut self,
        within2: u64,
        wanted: impl Fn(&Aabb) -> bool,
    ) -> Result<Option<Near>> {
        if self.ready.is_empty() {
            self.fill(within2, wanted)?;
        }
        Ok(self.ready.pop().map(|(distance2, id, at)| Near {
            distance2,
            id,
            difference: sub(at, self.point),
        }))
    }

    /// Makes the nearest of what is left within `within2` ready, at least a batch if there are so
    /// many, and all that are as far as the last of them.
    fn fill(&mut self, within2: u64, wanted: impl Fn(&Aabb) -> bool) -> Result<()> {
        let mut limit = within2;
        let near = self.later.extract_if(.., |p| p.0 <= limit);
        self.ready.extend(near);
        limit = self.narrow(limit);
        while let Some(&Reverse((distance, level, index))) = self.nodes.peek() {
            if distance > limit {
                break;
            }
            self.nodes.pop();
            if !wanted(&self.store.tree_boxes(level)[index]) {
                continue;
            }
            if level > 0 {
                let children = self.store.tree_children(level, index);
                children.for_each(|child| self.wait(level - 1, child));
            } else {
                self.open(index, limit)?;
                if self.ready.len() >= 2 * self.batch {
                    limit = self.narrow(limit);
                }
            }
        }
        self.narrow(limit);
        self.ready.sort_unstable_by_key(|p| Reverse((p.0, p.1)));
        let nodes = self.nodes.capacity() * size_of::<Node>();
        self.held
            .set(nodes as u64 + bytes_of(&self.ready) + bytes_of(&self.later));
        self.batch *= 2;
        Ok(())
    }

    /// If more than a batch is ready, only as far as the batch reaches; the new limit.
    fn narrow(&mut self, limit: u64) -> u64 {
        if self.ready.len() <= self.batch {
            return limit;
        }
        let nearest = |p: &(u64, u32, Point)| p.0;
        let at = self.batch - 1;
        let limit = self.ready.select_nth_unstable_by_key(at, nearest).1.0;
        let beyond = self.ready.extract_if(self.batch.., |p| p.0 > limit);
        self.later.extend(beyond);
        limit
    }

    /// Takes in a page; its points up to `limit` are ready.
    fn open(&mut self, page: usize, limit: u64) -> Result<()> {
        let first = self.store.page_ids(page).start;
        for (id, &at) in (first as u32..).zip(self.cache.get(self.store, page)?) {
            let distance = distance2(at, self.point);
            if id != self.id {
                let to = if distance <= limit {
                    &mut self.ready
                } else {
                    &mut self.later
                };
                to.push((distance, id, at));
            }
        }
        Ok(())
    }

    fn wait(&mut self, level: usize, index: usize) {
        let distance = self.store.tree_boxes(level)[index].distance2(self.point);
        self.nodes.push(Reverse((distance, level, index)));
    }
}
