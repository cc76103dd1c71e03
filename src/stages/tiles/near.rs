//! Nearest neighbours inside a tile, for all points of a leaf at once (paper, section 3.1).
//!
//! The candidates for all points of a leaf are gathered once, within a distance estimated from the previous
//! leaf. Estimates only affect the cost: a query is answered if the gathered candidates prove the answer,
//! else candidates are gathered for this query alone.

use super::candidates::{APPROXIMATE, Candidates, Columns, PageLeaves, above};
use super::neighbors::Neighbors;
use super::{OwnPage, Tile};
use crate::ids::Id;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::{Point, distance2};
use outcrop_paper::kernels::{BLOCK, Level};
use std::ops::Range;

mod around;
mod divided;
mod groups;
mod list;
mod query;
mod sums;

pub use super::neighbors::Sums;
pub use around::{Around, Nearer};
use divided::list_divided;
pub use groups::{Group, Neighborhood};
use list::list_nearest;
pub use query::Query;

/// Bytes of a search for each candidate: three sets of columns, the picked candidates, distances and keys.
pub(super) const CANDIDATE: u64 = 3 * 16 + 16 + 4 + 24;

/// Most corrections of a query's limit; then one that is too large is accepted.
const CORRECTIONS: usize = 6;

/// Largest factor, in squared distance, by which a search is widened because the previous one was.
const MOST_WIDER: u64 = 32;

/// The candidates and the sorted neighbours of one query, in memory that is reused.
#[derive(Debug, Default)]
pub struct Search {
    level: Level,
    leaves: PageLeaves,
    candidates: Candidates,
    /// The candidates of the leaf, while one query uses its own.
    aside: Option<Candidates>,
    spare: Candidates,
    /// Approximate squared distances of the candidates to the query.
    distances: Vec<f32>,
    /// The nearest candidates and some more, in order of id, with their ids or distances as numbers.
    picked: Columns,
    keys: Vec<i64>,
    places: Vec<u32>,
    long_keys: Vec<(u64, u32)>,
    window: Vec<u64>,
    near: Neighbors,
    /// Approximate squared distance of the last neighbour in the previous query, if that query was a sum.
    last: f32,
    /// The same for queries whose number of neighbours differs, by this number.
    lasts: Vec<(usize, f32)>,
    /// Number of neighbours, and squared distance of the last, in the previous query that was widened.
    widened: (usize, u64),
    /// The largest such distance in the current leaf.
    wider2: u64,
}

impl Tile {
    /// Calls `each` with a [`Query`] for every point of the tile, in order of id. The query lists at least
    /// the `k` nearest neighbours; it is `None` if the halo cannot certify them. `grown` is called after each
    /// page with the bytes of the search.
    pub fn for_each_query(
        &self,
        k: usize,
        search: &mut Search,
        grown: impl FnMut(u64),
        each: impl FnMut(Id, Point, Option<Query<'_>>),
    ) {
        self.for_queries(k, search, |_| true, grown, each, |_, _, _| None);
    }

    /// As [`Tile::for_each_query`], for the points whose ids are `wanted`; most queries list the `k` nearest and
    /// no others.
    pub fn for_some_queries(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        grown: impl FnMut(u64),
        each: impl FnMut(Id, Point, Option<Query<'_>>),
    ) {
        let first = |search: &mut Search, point: Point, id: Id| {
            list_divided(search.level, search, point, id.get(), k)
        };
        self.for_queries(k, search, wanted, grown, each, first);
    }

    /// As [`Tile::for_some_queries`]. `first` may list the neighbours, and returns the squared distance up to which
    /// the list is complete; where it does not, they are listed as for [`Tile::for_each_query`].
    fn for_queries(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        grown: impl FnMut(u64),
        mut each: impl FnMut(Id, Point, Option<Query<'_>>),
        first: impl Fn(&mut Search, Point, Id) -> Option<u64>,
    ) {
        self.for_groups(k, search, wanted, grown, |own, index, id, search| {
            let point = self.points.get(index);
            let query = match first(search, point, id) {
                Some(complete2) => Some(self.listed(own, index, id, search, complete2)),
                None => self.query(own, index, id, k, search),
            };
            let farthest = query.as_ref().map_or(0, |query| query.farthest2(k));
            each(id, point, query);
            farthest
        });
    }

    /// The query for the `k` nearest neighbours of point `index`; `None` if the halo cannot certify them.
    fn query<'a>(
        &'a self,
        own: &'a OwnPage,
        index: usize,
        id: Id,
        k: usize,
        search: &'a mut Search,
    ) -> Option<Query<'a>> {
        let complete2 = self.nearest(own, index, id, k, search)?;
        Some(self.listed(own, index, id, search, complete2))
    }

    /// A query whose neighbours are listed.
    fn listed<'a>(
        &'a self,
        own: &'a OwnPage,
        index: usize,
        id: Id,
        search: &'a mut Search,
        complete2: u64,
    ) -> Query<'a> {
        Query {
            tile: self,
            own,
            search,
            point: self.points.get(index),
            id,
            complete2,
        }
    }

    /// Gathers the candidates of each leaf with `wanted` ids, and calls `one` with the page, index and id of
    /// each of them; `one` returns the squared distance that it needed.
    fn for_groups(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        grown: impl FnMut(u64),
        mut one: impl FnMut(&OwnPage, usize, Id, &mut Search) -> u64,
    ) {
        let wanted = |id: usize| self.ids.contains(&id) && wanted(id);
        let leaf = |own: &OwnPage, first: usize, group: Range<usize>, search: &mut Search| {
            let mut farthest = 0;
            for (id, index) in (first..).zip(group) {
                if wanted(id) {
                    farthest = one(own, index, Id::at(id), search).max(farthest);
                    search.swap_back();
                }
            }
            farthest
        };
        self.for_leaves(k, search, wanted, grown, leaf);
    }

    /// Gathers the candidates of each leaf with `wanted` ids, and calls `each` with the page, the id of the
    /// leaf's first point, and the indices of its points; `each` returns the squared distance that it needed.
    fn for_leaves(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        mut grown: impl FnMut(u64),
        mut each: impl FnMut(&OwnPage, usize, Range<usize>, &mut Search) -> u64,
    ) {
        let mut guess = None;
        for own in &self.own {
            let range = self.range(own.local);
            let mut set = false;
            for start in range.clone().step_by(self.leaf) {
                let group = start..(start + self.leaf).min(range.end);
                let first = self.id(own.local, start - range.start);
                if !(first..first + group.len()).any(&wanted) {
                    continue;
                }
                if !set {
                    search.leaves.set(search.level, self, own);
                    set = true;
                }
                let likely = guess.unwrap_or_else(|| self.limit(group.clone(), k, search));
                let around = self.points.bounds(group.clone());
                search.gather(self, &around, likely.min(own.reach2));
                search.wider2 = 0;
                let farthest = each(own, first, group, search);
                if farthest > 0 {
                    // A little farther than the previous leaf needed: gathering for one point alone costs as
                    // much as for a leaf.
                    let wider = search.wider2.min(farthest.saturating_mul(MOST_WIDER));
                    guess = Some(wider.max(farthest + farthest / 2));
                }
            }
            grown(search.bytes());
        }
    }

    /// Lists at least the `k` nearest neighbours of point `index`. Returns the squared distance up to which
    /// the list is complete.
    fn nearest(
        &self,
        own: &OwnPage,
        index: usize,
        id: Id,
        k: usize,
        search: &mut Search,
    ) -> Option<u64> {
        let point = self.points.get(index);
        if let Some(complete2) = list_nearest(search.level, search, point, id.get(), k) {
            return Some(complete2);
        }
        if !self.gather_for_one(own, index, k, search) {
            return None;
        }
        list_nearest(search.level, search, point, id.get(), k)
    }

    /// Gathers enough candidates for the `k` nearest neighbours of point `index`, or all within the reach of
    /// the page; false if all of them had been gathered before.
    fn gather_for_one(&self, own: &OwnPage, index: usize, k: usize, search: &mut Search) -> bool {
        if search.candidates.complete2 >= own.reach2 {
            return false;
        }
        let limit = self.limit(index..index + 1, k, search);
        search.step_aside();
        let around = self.points.bounds(index..index + 1);
        search.gather(self, &around, limit.min(own.reach2));
        true
    }

    /// An upper bound on the squared distance of the `k`th neighbour for each point of a group, from the
    /// points next to it in curve order; `u64::MAX` if there are too few.
    fn limit(&self, group: Range<usize>, k: usize, search: &mut Search) -> u64 {
        // Half of the points may not be neighbours.
        let times = if self.chosen.is_some() { 2 } else { 1 };
        let side = (times * (k + 1)).max(32);
        let around = group.start.saturating_sub(side)..(group.end + side).min(self.points.len());
        let window = &mut search.window;
        let limit = |index: usize| {
            let point = self.points.get(index);
            let near = around.clone().filter(|other| self.is_chosen(*other));
            window.clear();
            window.extend(near.map(|other| distance2(self.points.get(other), point)));
            if window.len() <= k {
                return u64::MAX;
            }
            // The point itself is included, at distance 0.
            *window.select_nth_unstable(k).1
        };
        group.map(limit).max().unwrap_or(u64::MAX)
    }
}

impl Search {
    /// A search with the kernels of `level`; levels differ only in speed.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self {
            level,
            ..Self::default()
        }
    }

    /// Allocated bytes of its lists, which only grow.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let candidates = [
            Some(&self.candidates),
            self.aside.as_ref(),
            Some(&self.spare),
        ];
        let candidates = candidates.into_iter().flatten().map(|c| c.columns.bytes());
        let picked = self.picked.bytes() + bytes_of(&self.keys) + bytes_of(&self.places);
        let lists = bytes_of(&self.distances) + bytes_of(&self.long_keys) + bytes_of(&self.window);
        candidates.sum::<u64>() + picked + lists + self.leaves.bytes() + self.near.bytes()
    }

    /// Whole blocks of distances; those after the last candidate are infinite.
    #[inline(always)]
    fn measured(&self) -> &[f32] {
        &self.distances[..self.candidates.len.next_multiple_of(BLOCK)]
    }

    fn gather(&mut self, tile: &Tile, around: &Aabb, d2: u64) {
        self.gather_where(tile, around, d2, None);
    }

    fn gather_where(
        &mut self,
        tile: &Tile,
        around: &Aabb,
        d2: u64,
        wanted: Option<&dyn Fn(&Aabb) -> bool>,
    ) {
        let out = &mut self.candidates;
        self.leaves
            .gather(self.level, tile, around, d2, wanted, out);
    }

    /// Sets the candidates of the leaf aside, so that a query can gather its own.
    fn step_aside(&mut self) {
        if self.aside.is_none() {
            let group = std::mem::take(&mut self.candidates);
            self.candidates = std::mem::take(&mut self.spare);
            self.aside = Some(group);
        }
    }

    /// Records that a query needed `count` neighbours, the last at squared distance `last2`.
    fn note_wider(&mut self, count: usize, last2: u64) {
        self.widened = (count, last2 + last2 / 4);
        self.wider2 = self.wider2.max(self.widened.1);
    }

    /// Runs a query for `count` neighbours, which begins with the last neighbour of the previous query for as many.
    fn with_last<T>(&mut self, count: usize, query: impl FnOnce(&mut Self) -> T) -> T {
        let place = self.lasts.iter().position(|(k, _)| *k == count);
        let place = place.unwrap_or_else(|| {
            self.lasts.push((count, 0.0));
            self.lasts.len() - 1
        });
        std::mem::swap(&mut self.last, &mut self.lasts[place].1);
        let result = query(self);
        std::mem::swap(&mut self.last, &mut self.lasts[place].1);
        result
    }

    fn swap_back(&mut self) {
        if let Some(group) = self.aside.take() {
            self.spare = std::mem::replace(&mut self.candidates, group);
        }
    }
}
