//! Neighbours in the whole store, nearest first, as many as are asked for: the second look for
//! points whose halo does not prove enough.

use super::Near;
use crate::error::Result;
use crate::geom::aabb::Aabb;
use crate::geom::{Point, distance2, sub};
use crate::stages::order::PointStore;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Pages kept in memory by a [`PageCache`].
const CACHED_PAGES: usize = 1024;

/// Recently read pages of the store.
#[derive(Debug, Default)]
pub struct PageCache {
    pages: FxHashMap<usize, Vec<Point>>,
}

impl PageCache {
    /// Bytes that a full cache takes.
    #[must_use]
    pub fn bytes(store: &PointStore) -> u64 {
        (CACHED_PAGES * store.page_size() * 12) as u64
    }

    fn get(&mut self, store: &PointStore, page: usize) -> Result<&[Point]> {
        if self.pages.len() >= CACHED_PAGES && !self.pages.contains_key(&page) {
            // Queries come in curve order: soon everything here is new again.
            self.pages.clear();
        }
        match self.pages.entry(page) {
            std::collections::hash_map::Entry::Occupied(found) => Ok(found.into_mut()),
            std::collections::hash_map::Entry::Vacant(empty) => {
                let mut points = Vec::new();
                store.read_pages(page..page + 1, &mut points)?;
                Ok(empty.insert(points))
            }
        }
    }
}

/// What waits in the queue; at equal distance boxes are opened before points are handed out, so
/// that points of equal distance come in order of id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Item {
    Node { level: usize, index: usize },
    Point { id: u32, at: Point },
}

/// Best-first search from one point.
#[derive(Debug)]
pub struct Walk<'a> {
    store: &'a PointStore,
    cache: &'a mut PageCache,
    id: u32,
    point: Point,
    queue: BinaryHeap<Reverse<(u64, Item)>>,
}

impl<'a> Walk<'a> {
    /// A walk from point `id` at `point`.
    #[must_use]
    pub fn new(store: &'a PointStore, cache: &'a mut PageCache, id: u32, point: Point) -> Self {
        let level = store.tree_levels() - 1;
        let queue = store
            .tree_boxes(level)
            .iter()
            .enumerate()
            .map(|(index, b)| Reverse((b.distance2(point), Item::Node { level, index })))
            .collect();
        Self {
            store,
            cache,
            id,
            point,
            queue,
        }
    }

    /// The next neighbour, nearest first by (distance, id), of those in boxes that `wanted` lets
    /// pass; `None` when there is no more.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn next(&mut self, wanted: impl Fn(&Aabb) -> bool) -> Result<Option<Near>> {
        while let Some(Reverse((distance, item))) = self.queue.pop() {
            match item {
                Item::Point { id, at } => {
                    let difference = sub(at, self.point);
                    return Ok(Some(Near {
                        distance2: distance,
                        id,
                        difference,
                    }));
                }
                Item::Node { level, index } => {
                    if !wanted(&self.store.tree_boxes(level)[index]) {
                        continue;
                    }
                    if level == 0 {
                        let first = self.store.page_ids(index).start as u32;
                        for (id, &at) in (first..).zip(self.cache.get(self.store, index)?) {
                            if id != self.id {
                                let d2 = distance2(at, self.point);
                                self.queue.push(Reverse((d2, Item::Point { id, at })));
                            }
                        }
                    } else {
                        for child in self.store.tree_children(level, index) {
                            let node = Item::Node {
                                level: level - 1,
                                index: child,
                            };
                            let d2 = self.store.tree_boxes(level - 1)[child].distance2(self.point);
                            self.queue.push(Reverse((d2, node)));
                        }
                    }
                }
            }
        }
        Ok(None)
    }
}
