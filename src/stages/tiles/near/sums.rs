//! Sums over the nearest neighbours of many points. Only the set of neighbours matters, not their order, so
//! nothing is sorted.

use super::list::{likely_body, pick_enough_body};
use super::{APPROXIMATE, OwnPage, Query, Search, above};
use crate::ids::Id;
use crate::tiles::Tile;
use crate::tiles::neighbors::Sums;
use outcrop_geom::Point;
use outcrop_paper::kernels::{BLOCK, MOST_SUMMED, Pick, SUMMED_LIMIT2, distances_body, kernel};
use outcrop_paper::plane::Moments;

/// Most corrections of the limit that separates the nearest from the others.
const DIVISIONS: usize = 16;

/// Up to the last of these counts of numbers, several limits are tried at once: on whole registers, for twice
/// as many neighbours as a plane has as well.
const FEW: [usize; 3] = [4 * BLOCK, 6 * BLOCK, 8 * BLOCK];

/// The limits that are tried first: distances from the expected one, in mean gaps between numbers.
const FIRST_PROBES: [f32; 4] = [-2.5, -0.8, 0.8, 2.5];

/// The limits that are tried then.
const NEXT_PROBES: [f32; 4] = [-0.9, -0.3, 0.3, 0.9];

/// Factor from the limit of the previous query to that of a query that only divides what it picks.
const MARGIN: f32 = 1.3;

/// No number may lie between the limit and this multiple of it. Approximate distances then separate
/// correctly.
const GAP: f32 = 1.0 + 8.0 * APPROXIMATE as f32;

impl Tile {
    /// Calls `each` with the sums over the `k` nearest neighbours of every point whose id is `wanted`, in
    /// order of id; with `None` if the halo cannot certify these neighbours.
    pub fn for_some_sums(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        grown: impl FnMut(u64),
        mut each: impl FnMut(Id, Point, Option<&Sums>),
    ) {
        let mut sums = Sums::default();
        self.for_groups(k, search, wanted, grown, |own, index, id, search| {
            let known = self.sums(own, index, id, k, search, &mut sums);
            let sums = known.then_some(&sums);
            each(id, self.points.get(index), sums);
            sums.map_or(0, |sums| sums.last2)
        });
    }

    /// Sums over the `k` nearest neighbours of point `index`; false if the halo cannot certify these
    /// neighbours.
    fn sums(
        &self,
        own: &OwnPage,
        index: usize,
        id: Id,
        k: usize,
        search: &mut Search,
        sums: &mut Sums,
    ) -> bool {
        let point = self.points.get(index);
        let mut summed = sum_nearest(search.level, search, point, k, sums);
        if summed == Err(Unknown::Few) && self.gather_for_one(own, index, k, search) {
            summed = sum_nearest(search.level, search, point, k, sums);
        }
        match summed {
            Ok(()) => true,
            Err(Unknown::Few) => false,
            Err(Unknown::Close) => {
                let known = self.nearest(own, index, id, k, search).is_some();
                if known {
                    *sums = search.near.sums(k, search.level);
                }
                known
            }
        }
    }
}

impl Query<'_> {
    /// Sums over the `count` nearest neighbours, computed faster than a list. `None` if the halo does not
    /// reach that far.
    #[must_use]
    pub fn sums(&mut self, count: usize) -> Option<Sums> {
        let mut sums = Sums::default();
        loop {
            let point = self.point;
            let summed = self.search.with_last(count, |search| {
                sum_nearest(search.level, search, point, count, &mut sums)
            });
            match summed {
                Ok(()) => {
                    self.search.note_wider(count, sums.last2);
                    return Some(sums);
                }
                Err(Unknown::Few) => {
                    let next = self.farther(self.search.candidates.complete2);
                    if next > self.own.reach2 {
                        return None;
                    }
                    self.gather(next);
                }
                Err(Unknown::Close) => {
                    let listed = self.extend_to(count);
                    return listed.then(|| self.near().sums(count, self.search.level));
                }
            }
        }
    }
}

/// The reason why there are no sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unknown {
    /// There are too few neighbours within the distance up to which the candidates are complete.
    Few,
    /// Ties at the last place, which would be decided by id; or distances too close or too large to be
    /// separated.
    Close,
}

kernel! {
    /// Measures the candidates from `point` and sums over the `k` nearest neighbours.
    fn sum_nearest(search: &mut Search, point: Point, k: usize, sums: &mut Sums) -> Result<(), Unknown> = sum_body<Eight>
}

#[inline(always)]
fn sum_body<P: Pick>(
    search: &mut Search,
    point: Point,
    k: usize,
    sums: &mut Sums,
) -> Result<(), Unknown> {
    let (room, limit) = divided_body::<P, false>(search, point, k)?;
    if k >= MOST_SUMMED || certain_body(limit) >= SUMMED_LIMIT2 as f64 {
        return Err(Unknown::Close);
    }
    let distances = &search.distances[..room];
    let [x, y, z] = search.picked.coordinates(room);
    let (sum, products, last2) = sums_within([x, y, z], point, distances, limit);
    *sums = Sums {
        moments: Moments::from_sums(k, sum, products),
        last2,
    };
    Ok(())
}

/// Picks candidates, with ids if wanted, puts their approximate squared distances from `point` into
/// `search.distances`, and finds a limit within which exactly the point itself and its `k` nearest neighbours
/// lie. Returns the number of picked places, whole blocks, and the limit.
#[inline(always)]
pub(super) fn divided_body<P: Pick, const IDS: bool>(
    search: &mut Search,
    point: Point,
    k: usize,
) -> Result<(usize, f32), Unknown> {
    let most = above(search.candidates.complete2);
    let limits = likely_body(search.last * MARGIN, most)..=most;
    let (picked, limit) = pick_enough_body::<P, IDS>(search, point, k + 2, limits);
    // The point itself is included.
    if picked <= k {
        return Err(Unknown::Few);
    }
    let room = picked.next_multiple_of(BLOCK);
    let padded = padded(room);
    search
        .distances
        .resize(padded.max(search.distances.len()), 0.0);
    let [x, y, z] = search.picked.coordinates(room);
    let distances = &mut search.distances[..padded];
    distances_body(x, y, z, point, &mut distances[..room]);
    distances[picked..].fill(f32::INFINITY);
    let limit = divide_body::<P>(distances, picked, k + 1, limit).ok_or(Unknown::Close)?;
    search.last = limit;
    if certain_body(limit) > search.candidates.complete2 as f64 {
        return Err(Unknown::Close);
    }
    Ok((room, limit))
}

/// The length to which `room` distances are padded for [`divide_body`]: one of [`FEW`], or `room` if it is longer.
#[inline(always)]
pub(super) fn padded(room: usize) -> usize {
    FEW.into_iter().find(|few| room <= *few).unwrap_or(room)
}

/// An upper bound on the squared distances of the points whose approximate ones are within `limit`.
#[inline(always)]
pub(super) fn certain_body(limit: f32) -> f64 {
    f64::from(limit) * (1.0 + 2.0 * APPROXIMATE)
}

/// A limit within which exactly `wanted` of the first `count` numbers lie, with no other number close to it;
/// the numbers are roughly evenly distributed up to `most`, and those after the last are infinite.
#[inline(always)]
pub(super) fn divide_body<P: Pick>(
    numbers: &[f32],
    count: usize,
    wanted: usize,
    most: f32,
) -> Option<f32> {
    let (all, wanted) = (count as u32, wanted as u32);
    if let Ok(few) = numbers.try_into() {
        divide_few::<P, { FEW[0] }>(few, all, wanted, most)
    } else if let Ok(few) = numbers.try_into() {
        divide_few::<P, { FEW[1] }>(few, all, wanted, most)
    } else if let Ok(few) = numbers.try_into() {
        divide_few::<P, { FEW[2] }>(few, all, wanted, most)
    } else {
        divide_many::<P>(numbers, all, wanted, most)
    }
}

/// As [`divide_body`], by probes: of the limits tried in a round, the two next to the wanted one are where the
/// next round begins.
#[inline(always)]
fn divide_few<P: Pick, const FEW: usize>(
    numbers: &[f32; FEW],
    count: u32,
    wanted: u32,
    most: f32,
) -> Option<f32> {
    let (mut low, mut high) = (0.0, most);
    let (mut below, mut above) = (0, count);
    let mut steps = FIRST_PROBES;
    for _ in 0..DIVISIONS {
        let between = (high - low) / (above - below) as f32;
        let middle = low + (wanted as f32 + 0.5 - below as f32) * between;
        let (before, mut found) = ((low, high), f32::NAN);
        for step in steps {
            let limit = middle + step * between;
            let count = count_within_body::<P>(numbers, limit);
            // Choices, not branches: nothing predicts them.
            found = if count == wanted { limit } else { found };
            let is_low = (count < wanted) & (limit > low);
            low = if is_low { limit } else { low };
            below = if is_low { count } else { below };
            let is_high = (count > wanted) & (limit < high);
            high = if is_high { limit } else { high };
            above = if is_high { count } else { above };
        }
        if !found.is_nan() {
            return (count_within_body::<P>(numbers, found * GAP) == wanted).then_some(found);
        }
        if before == (low, high) {
            return None;
        }
        steps = NEXT_PROBES;
    }
    None
}

/// As [`divide_body`], one limit after another.
#[inline(always)]
fn divide_many<P: Pick>(numbers: &[f32], count: u32, wanted: u32, most: f32) -> Option<f32> {
    let (mut low, mut high) = (0.0, most);
    let between = most / count as f32;
    let (mut limit, mut count) = (most, count);
    for division in 0..DIVISIONS {
        // The secant step for an even distribution; bisection where that does not converge.
        limit += (wanted as f32 + 0.5 - count as f32) * between;
        if division % 4 == 3 || limit <= low || limit >= high {
            limit = 0.5 * (low + high);
        }
        count = count_within_body::<P>(numbers, limit);
        if count == wanted {
            return (count_within_body::<P>(numbers, limit * GAP) == wanted).then_some(limit);
        }
        if count < wanted {
            low = limit;
        } else {
            high = limit;
        }
    }
    None
}

/// The number of values in whole blocks that are at most `limit`.
#[inline(always)]
fn count_within_body<P: Pick>(numbers: &[f32], limit: f32) -> u32 {
    let mut count = 0;
    for block in numbers.as_chunks::<BLOCK>().0 {
        count += P::within(block, limit).count_ones();
    }
    count
}

/// First and second moments of the points within `limit`, and the largest squared distance.
#[inline(always)]
fn sums_within(
    [x, y, z]: [&[i32]; 3],
    point: Point,
    distances: &[f32],
    limit: f32,
) -> ([i64; 3], [i64; 6], u64) {
    let mut sum = [0i64; 3];
    let mut products = [0i64; 6];
    let mut last2 = 0i64;
    for (((x, y), z), distance) in x.iter().zip(y).zip(z).zip(distances) {
        let mask = -i32::from(*distance <= limit);
        let from = |c: i32, axis: usize| i64::from(c.wrapping_sub(point[axis]) & mask);
        let (x, y, z) = (from(*x, 0), from(*y, 1), from(*z, 2));
        let squares = [x * x, y * y, z * z];
        sum[0] += x;
        sum[1] += y;
        sum[2] += z;
        products[0] += squares[0];
        products[1] += squares[1];
        products[2] += squares[2];
        products[3] += x * y;
        products[4] += x * z;
        products[5] += y * z;
        last2 = last2.max(squares[0] + squares[1] + squares[2]);
    }
    (sum, products, last2 as u64)
}
