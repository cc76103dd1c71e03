//! Neighbours in the whole store, nearest first, as many as needed: for points that the halo of their tile
//! cannot certify.

use super::Near;
use super::neighbors::Neighbors;
use super::wanted::{All, Wanted};
use crate::ids::Id;
use crate::order::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::{Point, distance2, sub};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::iter::Peekable;
use std::ops::Range;

/// Pages kept in memory by a [`PageCache`].
const CACHED_PAGES: usize = 1024;

/// Recently read pages of the store, in one allocation.
#[derive(Debug, Default)]
pub struct PageCache {
    /// Coordinates of each page: all x, then all y, then all z.
    words: Vec<i32>,
    /// For each page, the index of its first word and its number of points.
    pages: FxHashMap<usize, (usize, usize)>,
    /// The largest number of words so far.
    most: usize,
    /// Bytes of the largest walk so far.
    walk: u64,
}

impl PageCache {
    /// Bytes of a full cache.
    #[must_use]
    pub fn estimate(store: &PointStore) -> u64 {
        (CACHED_PAGES * store.page_size() * 12) as u64
    }

    /// Bytes that it and the largest walk with it have used.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.most as u64 * 4 + self.walk
    }

    /// The coordinates of a page's points.
    fn get(&mut self, store: &PointStore, page: usize) -> Result<[&[i32]; 3]> {
        let (start, len) = match self.pages.get(&page) {
            Some(found) => *found,
            None => self.take_in(store, page)?,
        };
        let column = |axis| &self.words[start + axis * len..][..len];
        Ok([0, 1, 2].map(column))
    }

    fn take_in(&mut self, store: &PointStore, page: usize) -> Result<(usize, usize)> {
        if self.pages.len() >= CACHED_PAGES {
            // Queries come in curve order, so the old pages are soon no longer needed.
            self.pages.clear();
            self.words.clear();
        }
        if self.words.capacity() == 0 {
            // Memory that was not written to is not resident.
            let room = CACHED_PAGES * store.page_size() * 3;
            self.words.reserve_exact(room);
        }
        let found = (self.words.len(), store.page_ids(page).len());
        let (start, count) = found;
        self.words.resize(start + 3 * count, 0);
        let (x, others) = self.words[start..].split_at_mut(count);
        let (y, z) = others.split_at_mut(count);
        store.read_columns(page..page + 1, [x, y, z])?;
        self.most = self.most.max(self.words.len());
        self.pages.insert(page, found);
        Ok(found)
    }
}

/// Neighbours in the first batch; each following batch is twice as large.
const BATCH: usize = 32;

/// A page that has not been opened: its squared distance and number.
type Page = Reverse<(u64, usize)>;

/// Groups of pages with their squared distance, the nearest first.
type Groups<'a> = Box<dyn Iterator<Item = (u64, Range<usize>)> + 'a>;

/// Best-first search from one point, a batch of neighbours at a time.
pub struct Walk<'a> {
    store: &'a PointStore,
    cache: &'a mut PageCache,
    id: Id,
    point: Point,
    /// The groups of pages that have not been opened.
    groups: Peekable<Groups<'a>>,
    /// The pages of opened groups.
    pages: BinaryHeap<Page>,
    /// The neighbours to return next, with squared distance and id, farthest first.
    ready: Vec<(u64, Id, Point)>,
    /// The other points of opened pages, unordered.
    later: Vec<(u64, Id, Point)>,
    /// Places of points in a page.
    places: Vec<u32>,
    batch: usize,
}

impl<'a> Walk<'a> {
    /// Starts at point `id` at the position `point`.
    #[must_use]
    pub fn new(store: &'a PointStore, cache: &'a mut PageCache, id: Id, point: Point) -> Self {
        Self {
            store,
            cache,
            id,
            point,
            groups: (Box::new(store.nearest_groups(point)) as Groups<'a>).peekable(),
            pages: BinaryHeap::new(),
            ready: Vec::new(),
            later: Vec::new(),
            places: Vec::new(),
            batch: BATCH,
        }
    }

    /// The next neighbour in the order of (distance, id); `None` if there are no more.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn advance(&mut self) -> Result<Option<Near>> {
        if self.ready.is_empty() {
            self.fill(u64::MAX, &All)?;
        }
        Ok(self.next_ready())
    }

    /// Replaces `near` by the next neighbours, nearest first: `wanted` points within the squared distance
    /// `within2`, and possibly others; at least one, or none if there are no more. Points that were not
    /// wanted once are not offered again.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn list_where(
        &mut self,
        within2: u64,
        wanted: &impl Wanted,
        near: &mut Neighbors,
    ) -> Result<()> {
        if self.ready.is_empty() {
            self.fill(within2, wanted)?;
        }
        near.clear();
        while let Some(next) = self.next_ready() {
            near.push(next);
        }
        Ok(())
    }

    fn next_ready(&mut self) -> Option<Near> {
        self.ready.pop().map(|(distance2, id, at)| Near {
            distance2,
            id,
            difference: sub(at, self.point),
        })
    }

    /// Makes the nearest remaining points within `within2` ready: at least a batch if there are that many,
    /// and all at the distance of the last one.
    fn fill(&mut self, within2: u64, wanted: &impl Wanted) -> Result<()> {
        let mut limit = within2;
        self.take_later(limit, wanted);
        limit = self.narrow(limit);
        let (store, point) = (self.store, self.point);
        let may = |page: &usize| wanted.may_be_in(store.page_box(*page));
        loop {
            let nearest = self.pages.peek().map_or(u64::MAX, |page| page.0.0);
            let nearer = |group: &(u64, _)| group.0 <= limit.min(nearest);
            if let Some((_, group)) = self.groups.next_if(nearer) {
                let distance2 = |page| (store.page_box(page).distance2(point), page);
                let pages = group.filter(may).map(distance2);
                self.pages.extend(pages.map(Reverse));
                continue;
            }
            if nearest > limit {
                break;
            }
            let Some(Reverse((_, page))) = self.pages.pop() else {
                break;
            };
            // Less may be wanted than when the group was opened.
            if may(&page) {
                self.open(page, limit, wanted)?;
                if self.ready.len() >= 2 * self.batch {
                    limit = self.narrow(limit);
                }
            }
        }
        self.narrow(limit);
        self.ready.sort_unstable_by_key(|p| Reverse((p.0, p.1)));
        let pages = self.pages.capacity() * size_of::<Page>();
        let bytes = pages as u64 + bytes_of(&self.ready) + bytes_of(&self.later);
        self.cache.walk = self.cache.walk.max(bytes);
        self.batch *= 2;
        Ok(())
    }

    /// If more than a batch is ready, moves the points beyond the batch back; returns the new limit.
    fn narrow(&mut self, limit: u64) -> u64 {
        if self.ready.len() <= self.batch {
            return limit;
        }
        let nearest = |p: &(u64, Id, Point)| p.0;
        let at = self.batch - 1;
        let limit = self.ready.select_nth_unstable_by_key(at, nearest).1.0;
        let beyond = self.ready.extract_if(self.batch.., |p| p.0 > limit);
        self.later.extend(beyond);
        limit
    }

    /// Makes the `wanted` points of opened pages ready that are within `limit`.
    fn take_later(&mut self, limit: u64, wanted: &impl Wanted) {
        self.ready
            .extend(self.later.extract_if(.., |p| p.0 <= limit));
        let column = |axis: usize| self.ready.iter().map(|p| p.2[axis]).collect::<Vec<_>>();
        let [x, y, z] = [0, 1, 2].map(column);
        self.places.clear();
        wanted.pick([&x, &y, &z], &mut self.places);
        for (to, from) in self.places.iter().enumerate() {
            self.ready.swap(to, *from as usize);
        }
        self.ready.truncate(self.places.len());
    }

    /// Adds the `wanted` points of a page; those within `limit` are ready.
    fn open(&mut self, page: usize, limit: u64, wanted: &impl Wanted) -> Result<()> {
        let first = Id::at(self.store.page_ids(page).start).get();
        let columns = self.cache.get(self.store, page)?;
        self.places.clear();
        wanted.pick(columns, &mut self.places);
        for &place in &self.places {
            let id = Id::new(first + place);
            let at = columns.map(|column| column[place as usize]);
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
}
