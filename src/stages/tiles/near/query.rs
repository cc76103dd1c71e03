//! The neighbours of one point, as far as they are asked for.

use super::list::list_nearest;
use super::{MOST_WIDER, Search};
use crate::ids::Id;
use crate::tiles::neighbors::Neighbors;
use crate::tiles::wanted::Wanted;
use crate::tiles::{OwnPage, Tile};
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;

/// The neighbours of one point, nearest first, as far as they are known.
#[derive(Debug)]
pub struct Query<'a> {
    pub(super) tile: &'a Tile,
    pub(super) own: &'a OwnPage,
    pub(super) search: &'a mut Search,
    pub(super) point: Point,
    pub(super) id: Id,
    /// All points within this squared distance are listed.
    pub(super) complete2: u64,
}

impl Query<'_> {
    /// The id of the point.
    #[must_use]
    pub fn id(&self) -> Id {
        self.id
    }

    /// The position of the point.
    #[must_use]
    pub fn point(&self) -> Point {
        self.point
    }

    /// All neighbours known so far, nearest first, without gaps.
    #[must_use]
    pub fn near(&self) -> &Neighbors {
        &self.search.near
    }

    /// All neighbours within this squared distance are listed.
    #[must_use]
    pub fn complete2(&self) -> u64 {
        self.complete2
    }

    /// Squared distance of the `k`th neighbour; 0 if it is not listed.
    pub(super) fn farthest2(&self, k: usize) -> u64 {
        self.near().get(k - 1).map_or(0, |near| near.distance2)
    }

    /// Replaces the list by the neighbours farther than [`Query::complete2`], up to a squared distance, that
    /// are `wanted`. False if the halo does not reach that far.
    #[must_use]
    pub fn extend_where(&mut self, distance2: u64, wanted: &impl Wanted) -> bool {
        if distance2 > self.own.reach2.max(self.complete2) {
            return false;
        }
        let search = &mut *self.search;
        if distance2 > search.candidates.complete2 {
            search.step_aside();
            let around = Aabb::of(&[self.point]);
            let in_box = |bounds: &Aabb| wanted.may_be_in(bounds);
            search.gather_where(self.tile, &around, distance2, Some(&in_box));
        }
        search.places.clear();
        let candidates = &search.candidates;
        let columns = candidates.columns.coordinates(candidates.len);
        wanted.pick(columns, &mut search.places);
        let beyond = self.complete2.saturating_add(1);
        search.list_places(self.point, self.id.get(), beyond..=distance2);
        self.complete2 = self.complete2.max(distance2);
        true
    }

    /// Extends the list to at least `count` neighbours. False if the halo does not reach that far.
    #[must_use]
    pub fn extend_to(&mut self, count: usize) -> bool {
        while self.near().len() < count {
            let next = self.farther(self.complete2);
            if next > self.own.reach2 {
                return false;
            }
            if next > self.search.candidates.complete2 {
                self.gather(next);
            }
            let search = &mut *self.search;
            let most = count.max(search.widened.0);
            let listed = list_nearest(search.level, search, self.point, self.id.get(), most);
            self.complete2 = listed.unwrap_or(search.candidates.complete2);
        }
        let last = self.near().get(count - 1).map_or(0, |n| n.distance2);
        self.search.note_wider(count, last);
        true
    }

    /// The squared distance to search next, if the points within `known` are too few.
    pub(super) fn farther(&self, known: u64) -> u64 {
        // On a surface, twice the distance contains four times as many points. On a line it contains twice as
        // many; there the distance of the previous query is the better estimate.
        let next = known.saturating_mul(3).saturating_add(1);
        let (_, before2) = self.search.widened;
        let next = next.max(before2.min(next.saturating_mul(MOST_WIDER)));
        next.min(self.own.reach2.max(known + 1))
    }

    /// Gathers the candidates within a squared distance of this point.
    pub(super) fn gather(&mut self, d2: u64) {
        self.search.step_aside();
        let around = Aabb::of(&[self.point]);
        self.search.gather(self.tile, &around, d2);
    }
}
