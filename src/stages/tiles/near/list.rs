//! The sorted list of a query's nearest neighbours.

use super::{APPROXIMATE, CORRECTIONS, Search, above};
use crate::ids::Id;
use crate::tiles::Near;
use crate::tiles::candidates::Columns;
use crate::tiles::neighbors::Neighbors;
use outcrop_geom::{Point, distance2, sub};
use outcrop_paper::kernels::{
    BLOCK, Pick, RANKED, SHORT_RANKED, count_body, distances_body, first_bits, kernel, pick_body,
    ranks_body, short_ranks_body,
};
use std::ops::RangeInclusive;

/// Up to this number, keys are sorted by counting.
const MOST_RANKED: usize = 96;

/// Factor from the last distance of the previous query to the limit of a query that sorts what it picks.
const MARGIN: f32 = 1.08;

impl Search {
    /// Picks the measured candidates whose approximate squared distance is at most `limit`, in order of id;
    /// returns how many there are.
    #[inline(always)]
    fn pick_measured<P: Pick>(&mut self, limit: f32) -> usize {
        let distances = &self.distances[..self.measured().len()];
        let from = self.candidates.columns.slices();
        pick_body::<P, 4>(distances, limit, from, self.picked.slices_mut())
    }

    /// Lists the picked candidates within `limit` in order of (distance, id). Returns the squared distance up
    /// to which all are listed.
    #[inline(always)]
    pub(super) fn list_picked<P: Pick>(
        &mut self,
        picked: usize,
        point: Point,
        own: u32,
        limit: f32,
    ) -> u64 {
        let below = (f64::from(limit) * (1.0 - APPROXIMATE)) as u64;
        let complete2 = below.min(self.candidates.complete2);
        let bits = usize::BITS - picked.leading_zeros();
        if picked <= MOST_RANKED && complete2 < (1 << (31 - bits)) - 1 {
            self.list_shortest::<P>(picked, point, own, complete2, bits);
        } else if bits < 32 && complete2 < 1 << (63 - bits) {
            self.list_short::<P>(picked, point, own, complete2, bits);
        } else {
            self.list_long(picked, point, own, complete2);
        }
        complete2
    }

    /// Candidates are picked in order of id, so a word of distance and place sorts by (distance, id).
    #[inline(always)]
    fn list_short<P: Pick>(
        &mut self,
        picked: usize,
        point: Point,
        own: u32,
        complete2: u64,
        bits: u32,
    ) {
        let [x, y, z] = self.picked.coordinates(picked);
        let ids = self.picked.numbers(picked);
        let room = picked.next_multiple_of(RANKED);
        self.keys.resize(room.max(self.keys.len()), 0);
        let keys = &mut self.keys[..room];
        keys[picked..].fill(i64::MAX);
        let mut count = 0;
        let picks = x.iter().zip(y).zip(z).zip(ids);
        for (place, (key, (((x, y), z), id))) in (0i64..).zip(keys.iter_mut().zip(picks)) {
            let d2 = distance2([*x, *y, *z], point);
            let listed = (d2 <= complete2) & (*id != own);
            // The others are sorted behind all listed ones.
            *key = if listed {
                (d2 << bits) as i64 | place
            } else {
                i64::MAX
            };
            count += i64::from(listed);
        }
        let mut near = self.near.resize(picked);
        let mask = (1i64 << bits) - 1;
        if picked <= MOST_RANKED {
            self.places.resize(room.max(self.places.len()), 0);
            let places = &mut self.places[..room];
            ranks_body::<P>(keys, picked, places);
            let picks = x.iter().zip(y).zip(z).zip(ids);
            for ((key, to), (((x, y), z), id)) in keys.iter().zip(places).zip(picks) {
                let difference = [x - point[0], y - point[1], z - point[2]];
                near.put(*to as usize, (key >> bits) as u64, *id, difference);
            }
        } else {
            keys.sort_unstable();
            for (to, key) in keys[..count as usize].iter().enumerate() {
                let at = (key & mask) as usize;
                let difference = [x[at] - point[0], y[at] - point[1], z[at] - point[2]];
                near.put(to, (key >> bits) as u64, ids[at], difference);
            }
        }
        self.near.resize(count as usize);
    }

    /// As [`Search::list_short`], for few candidates at distances of few steps, as on most scans: a word of
    /// 32 bits suffices.
    #[inline(always)]
    fn list_shortest<P: Pick>(
        &mut self,
        picked: usize,
        point: Point,
        own: u32,
        complete2: u64,
        bits: u32,
    ) {
        let [x, y, z] = self.picked.coordinates(picked);
        let ids = self.picked.numbers(picked);
        let mut keys = [i32::MAX; MOST_RANKED];
        let mut count = 0;
        let picks = x.iter().zip(y).zip(z).zip(ids);
        for (place, (key, (((x, y), z), id))) in (0i32..).zip(keys.iter_mut().zip(picks)) {
            // Approximate distances are within the limit, so the exact ones fit.
            let [x, y, z] = [x - point[0], y - point[1], z - point[2]];
            let squares = [x.wrapping_mul(x), y.wrapping_mul(y), z.wrapping_mul(z)];
            let d2 = squares[0].wrapping_add(squares[1]).wrapping_add(squares[2]) as u32;
            let listed = (d2 <= complete2 as u32) & (*id != own);
            *key = if listed {
                (d2 << bits) as i32 | place
            } else {
                i32::MAX
            };
            count += i32::from(listed);
        }
        let mut places = [0; MOST_RANKED];
        let room = picked.next_multiple_of(SHORT_RANKED);
        short_ranks_body::<P>(&keys[..room], picked, &mut places[..room]);
        let mut near = self.near.resize(picked);
        let picks = x.iter().zip(y).zip(z).zip(ids);
        for ((key, to), (((x, y), z), id)) in keys.iter().zip(places).zip(picks) {
            let difference = [x - point[0], y - point[1], z - point[2]];
            near.put(to as usize, (key >> bits) as u64, *id, difference);
        }
        self.near.resize(count as usize);
    }

    #[cold]
    fn list_long(&mut self, picked: usize, point: Point, own: u32, complete2: u64) {
        self.long_keys.clear();
        let columns = &self.picked;
        let keys = (0..picked as u32).filter_map(key(columns, point, own, 0..=complete2));
        self.long_keys.extend(keys);
        list_keys(&mut self.near, &mut self.long_keys, columns, point);
    }

    /// Lists the candidates at `places`, ascending, whose squared distances are in `within`.
    pub(super) fn list_places(&mut self, point: Point, own: u32, within: RangeInclusive<u64>) {
        self.long_keys.clear();
        let columns = &self.candidates.columns;
        let places = self.places.iter().copied();
        self.long_keys
            .extend(places.filter_map(key(columns, point, own, within)));
        list_keys(&mut self.near, &mut self.long_keys, columns, point);
    }
}

/// Sort keys of points in order of id: squared distance and place in the columns; `None` unless the distance
/// is in `within`. A point is not its own neighbour.
#[inline(always)]
fn key<'a>(
    columns: &'a Columns,
    point: Point,
    own: u32,
    within: RangeInclusive<u64>,
) -> impl Fn(u32) -> Option<(u64, u32)> + 'a {
    move |place| {
        let (at, id) = columns.get(place as usize);
        let d2 = distance2(at, point);
        (within.contains(&d2) && id != own).then_some((d2, place))
    }
}

fn list_keys(near: &mut Neighbors, keys: &mut [(u64, u32)], columns: &Columns, point: Point) {
    keys.sort_unstable();
    near.clear();
    for &mut (distance2, place) in keys {
        let (at, id) = columns.get(place as usize);
        near.push(Near {
            distance2,
            id: Id::new(id),
            difference: sub(at, point),
        });
    }
}

kernel! {
    /// Measures the candidates from `point` and lists the `k` nearest neighbours, and possibly more. Returns
    /// the squared distance up to which all are listed; `None` if there are fewer than `k` within the
    /// distance up to which the candidates are complete.
    pub(super) fn list_nearest(search: &mut Search, point: Point, own: u32, k: usize) -> Option<u64> = nearest_body<Eight>
}

#[inline(always)]
fn nearest_body<P: Pick>(search: &mut Search, point: Point, own: u32, k: usize) -> Option<u64> {
    let most = above(search.candidates.complete2);
    // The point itself is a candidate; one more for those not certain to be within the limit.
    let wanted = k + 2;
    // The neighbours of the previous query are at about the same distances.
    let last = search.near.get(k.wrapping_sub(1));
    let likely = likely_body(last.map_or(0.0, |n| n.distance2 as f32) * MARGIN, most);
    let (mut picked, mut limit) = pick_enough_body::<P, true>(search, point, wanted, likely..=most);
    let mut corrections = CORRECTIONS;
    if picked > too_many_body(wanted) {
        measure_body(search, point);
        limit = reach_body(search.measured(), wanted, limit, most, &mut corrections);
        picked = search.pick_measured::<P>(limit);
    }
    loop {
        let complete2 = search.list_picked::<P>(picked, point, own, limit);
        if search.near.len() >= k {
            return Some(complete2);
        }
        if limit >= most {
            return None;
        }
        corrections = corrections.saturating_sub(1);
        measure_body(search, point);
        let wider = likely_body(limit * MARGIN, most);
        limit = reach_body(search.measured(), wanted, wider, most, &mut corrections);
        picked = search.pick_measured::<P>(limit);
    }
}

/// An initial limit, up to `most`, from the distance `last` in the previous query; `most` if that is unknown
/// (0.0).
#[inline(always)]
pub(super) fn likely_body(last: f32, most: f32) -> f32 {
    if last > 0.0 {
        last.max(1.0).min(most)
    } else {
        most
    }
}

/// Number of picked candidates above which the limit is lowered: sorting or dividing them costs more than
/// counting.
#[inline(always)]
fn too_many_body(wanted: usize) -> usize {
    wanted + wanted.min(MOST_RANKED / 2)
}

/// The next limit to try, up to `most`, after a limit that contains only `count`.
#[inline(always)]
fn wider_body(limit: f32, count: usize, wanted: usize, most: f32) -> f32 {
    let grow = (wanted + 4) as f32 / (count.max(1) as f32);
    (limit * grow.clamp(1.1, 8.0) + 4.0).min(most)
}

/// A limit up to `most` that contains `wanted` of the distances and not many more, starting from `likely`;
/// `most` if there are fewer.
#[inline(always)]
fn reach_body(
    distances: &[f32],
    wanted: usize,
    likely: f32,
    most: f32,
    corrections: &mut usize,
) -> f32 {
    let mut limit = likely;
    loop {
        let count = count_body(distances, limit);
        if count > too_many_body(wanted) && *corrections > 0 {
            *corrections -= 1;
            limit *= (wanted + 6) as f32 / count as f32;
        } else if count >= wanted || limit >= most {
            return limit;
        } else {
            limit = wider_body(limit, count, wanted, most);
        }
    }
}

/// As [`pick_near_body`], with a limit that is likely to contain `wanted` candidates, widened up to the end
/// of `limits` if it does not. Returns how many were picked, and the limit.
#[inline(always)]
pub(super) fn pick_enough_body<P: Pick, const IDS: bool>(
    search: &mut Search,
    point: Point,
    wanted: usize,
    limits: RangeInclusive<f32>,
) -> (usize, f32) {
    let (mut limit, most) = limits.into_inner();
    let mut picked = pick_near_body::<P, IDS>(search, point, limit);
    while picked < wanted && limit < most {
        limit = wider_body(limit, picked, wanted, most);
        picked = pick_near_body::<P, IDS>(search, point, limit);
    }
    (picked, limit)
}

/// Picks the candidates whose approximate squared distance to `point` is at most `limit`, in order of id, with
/// their ids if wanted. Returns how many there are. The distances are not stored.
#[inline(always)]
fn pick_near_body<P: Pick, const IDS: bool>(
    search: &mut Search,
    point: Point,
    limit: f32,
) -> usize {
    let candidates = &search.candidates;
    search.picked.reserve(candidates.len);
    let room = candidates.len.next_multiple_of(BLOCK);
    let from = candidates.columns.blocks(room);
    let [to_x, to_y, to_z, to_ids] = search.picked.slices_mut();
    let mut count = 0;
    let mut left = candidates.len;
    for (((x, y), z), ids) in from[0].iter().zip(from[1]).zip(from[2]).zip(from[3]) {
        let mut distances = [0.0; BLOCK];
        let at: [&[i32; BLOCK]; 3] = [x, y, z].map(bytemuck::cast_ref);
        distances_body(at[0], at[1], at[2], point, &mut distances);
        let within = P::within(&distances, limit) & first_bits(left);
        P::pack_at(x, within, to_x, count);
        P::pack_at(y, within, to_y, count);
        P::pack_at(z, within, to_z, count);
        if IDS {
            P::pack_at(ids, within, to_ids, count);
        }
        count += within.count_ones() as usize;
        left = left.saturating_sub(BLOCK);
    }
    count
}

/// Computes the approximate squared distances of the candidates from `point`.
#[inline(always)]
fn measure_body(search: &mut Search, point: Point) {
    let candidates = &search.candidates;
    let room = candidates.len.next_multiple_of(BLOCK);
    search
        .distances
        .resize(room.max(search.distances.len()), 0.0);
    search.picked.reserve(candidates.len);
    let [x, y, z] = candidates.columns.coordinates(room);
    let distances = &mut search.distances[..room];
    distances_body(x, y, z, point, distances);
    distances[candidates.len..].fill(f32::INFINITY);
}
