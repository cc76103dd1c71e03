//! Neighbours inside a tile, for all points of a leaf at once (paper, section 3.1).

use super::{LEAVES, Near, OwnPage, Tile};
use crate::geom::aabb::Aabb;
use crate::geom::{Point, distance2, sub};

/// A set of candidates and the sorted neighbours of one query, reused from query to query.
#[derive(Debug, Default)]
pub struct Search {
    candidates: Vec<Point>,
    ids: Vec<u32>,
    /// The group's candidates while one query looks farther.
    aside: (Vec<Point>, Vec<u32>),
    keys: Vec<u64>,
    long_keys: Vec<(u64, u32)>,
    window: Vec<u64>,
    near: Vec<Near>,
}

/// The neighbours of one point, nearest first, as far as they are known.
#[derive(Debug)]
pub struct Query<'a> {
    tile: &'a Tile,
    own: &'a OwnPage,
    search: &'a mut Search,
    point: Point,
    id: u32,
    /// All points up to this squared distance are listed.
    complete2: u64,
}

impl Tile {
    /// Calls `each` with a [`Query`] for every point of the tile, in order of id, that lists at
    /// least the `k` nearest neighbours; with `None` for those that the halo cannot certify.
    pub fn for_each_query(
        &self,
        k: usize,
        search: &mut Search,
        mut each: impl FnMut(u32, Point, Option<Query<'_>>),
    ) {
        let mut limits = Vec::new();
        for own in &self.own {
            let range = self.range(own.local);
            for start in range.clone().step_by(self.leaf) {
                let group = start..(start + self.leaf).min(range.end);
                self.limits(group.clone(), k, &mut search.window, &mut limits);
                let farthest = limits.iter().copied().max().unwrap_or(u64::MAX);
                let certified = farthest <= own.reach2;
                if certified {
                    let leaf = (start - range.start) / self.leaf;
                    let around = self.leaf_boxes[own.local * LEAVES + leaf];
                    self.gather(own, &around, farthest, search);
                }
                for (index, limit) in group.zip(&limits) {
                    let id = self.id(own.local, index - range.start);
                    if !self.ids.contains(&id) {
                        continue;
                    }
                    let (point, id) = (self.points[index], id as u32);
                    if !certified && (*limit > own.reach2) {
                        each(id, point, None);
                        continue;
                    }
                    if !certified {
                        self.gather(own, &Aabb::of(&[point]), *limit, search);
                    }
                    search.list(point, id, None, *limit);
                    each(
                        id,
                        point,
                        Some(Query {
                            tile: self,
                            own,
                            search,
                            point,
                            id,
                            complete2: *limit,
                        }),
                    );
                }
            }
        }
    }

    /// An upper bound of the squared distance of the `k`th neighbour for each point of a group,
    /// from the points around it in curve order.
    fn limits(
        &self,
        group: std::ops::Range<usize>,
        k: usize,
        window: &mut Vec<u64>,
        out: &mut Vec<u64>,
    ) {
        let side = (k + 1).max(32);
        let around = group.start.saturating_sub(side)..(group.end + side).min(self.points.len());
        out.clear();
        for index in group {
            if around.len() <= k {
                out.push(u64::MAX);
                continue;
            }
            let point = self.points[index];
            window.clear();
            window.extend(
                self.points[around.clone()]
                    .iter()
                    .map(|&p| distance2(p, point)),
            );
            // The point itself is among them, at distance 0.
            out.push(*window.select_nth_unstable(k).1);
        }
    }

    /// Collects all points within `d2` of `around`, in order of id.
    fn gather(&self, own: &OwnPage, around: &Aabb, d2: u64, search: &mut Search) {
        search.candidates.clear();
        search.ids.clear();
        for &local in &self.near[own.near.clone()] {
            if self.page_boxes[local].distance2_box(around) > d2 {
                continue;
            }
            let range = self.range(local);
            for leaf in 0..range.len().div_ceil(self.leaf) {
                if self.leaf_boxes[local * LEAVES + leaf].distance2_box(around) > d2 {
                    continue;
                }
                let first = leaf * self.leaf;
                let last = (first + self.leaf).min(range.len());
                search
                    .candidates
                    .extend_from_slice(&self.points[range.start + first..range.start + last]);
                let id = self.id(local, first) as u32;
                search.ids.extend(id..id + (last - first) as u32);
            }
        }
    }
}

impl Search {
    fn swap_aside(&mut self) {
        std::mem::swap(&mut self.candidates, &mut self.aside.0);
        std::mem::swap(&mut self.ids, &mut self.aside.1);
    }

    /// Lists the candidates with `after < d² ≤ upto` in order of (distance, id), behind those there
    /// already if `after` is given.
    fn list(&mut self, point: Point, own: u32, after: Option<u64>, upto: u64) {
        if after.is_none() {
            self.near.clear();
        }
        let beyond = |d2: u64| after.is_none_or(|a| d2 > a) && d2 <= upto;
        let bits = usize::BITS - self.candidates.len().leading_zeros();
        if bits < 32 && upto < 1 << (64 - bits) {
            // Candidates are in order of id, so distance and rank in one word sort as they must.
            self.keys.clear();
            for (rank, &p) in self.candidates.iter().enumerate() {
                let d2 = distance2(p, point);
                if beyond(d2) {
                    self.keys.push(d2 << bits | rank as u64);
                }
            }
            self.keys.sort_unstable();
            let mask = (1u64 << bits) - 1;
            for i in 0..self.keys.len() {
                let key = self.keys[i];
                self.push((key & mask) as usize, key >> bits, point, own);
            }
        } else {
            self.long_keys.clear();
            for (rank, &p) in self.candidates.iter().enumerate() {
                let d2 = distance2(p, point);
                if beyond(d2) {
                    self.long_keys.push((d2, rank as u32));
                }
            }
            self.long_keys.sort_unstable();
            for i in 0..self.long_keys.len() {
                let (d2, rank) = self.long_keys[i];
                self.push(rank as usize, d2, point, own);
            }
        }
    }

    fn push(&mut self, rank: usize, distance2: u64, point: Point, own: u32) {
        let id = self.ids[rank];
        if id != own {
            let difference = sub(self.candidates[rank], point);
            self.near.push(Near {
                distance2,
                id,
                difference,
            });
        }
    }
}

impl Query<'_> {
    /// The query's own id.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.id
    }

    /// The neighbours known so far, nearest first, none left out between them.
    #[must_use]
    pub fn near(&self) -> &[Near] {
        &self.search.near
    }

    /// All neighbours up to this squared distance are listed.
    #[must_use]
    pub fn complete2(&self) -> u64 {
        self.complete2
    }

    /// Lists all neighbours up to a squared distance. False if the halo does not reach that far.
    #[must_use]
    pub fn extend(&mut self, distance2: u64) -> bool {
        if distance2 <= self.complete2 {
            return true;
        }
        if distance2 > self.own.reach2 {
            return false;
        }
        self.search.swap_aside();
        self.tile
            .gather(self.own, &Aabb::of(&[self.point]), distance2, self.search);
        self.search
            .list(self.point, self.id, Some(self.complete2), distance2);
        self.search.swap_aside();
        self.complete2 = distance2;
        true
    }

    /// Lists at least `count` neighbours. False if the halo does not reach that far.
    #[must_use]
    pub fn extend_to(&mut self, count: usize) -> bool {
        while self.near().len() < count {
            // On a surface, twice the distance holds four times the points.
            let next = self.complete2.saturating_mul(3).saturating_add(1);
            if !self.extend(next.min(self.own.reach2.max(self.complete2 + 1))) {
                return false;
            }
        }
        true
    }
}
