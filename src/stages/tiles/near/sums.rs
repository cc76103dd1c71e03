//! Sums over the nearest neighbours of many points: which they are matters, in what order they
//! stand does not, so nothing is sorted.

use super::{APPROXIMATE, CORRECTIONS, OwnPage, Search, above, measure_body, reach_body};
use crate::geom::Point;
use crate::geom::plane::Moments;
use crate::kernels::{
    BLOCK, MOST_SUMMED, Pick, SUMMED_LIMIT2, SecondMoments, count_body, kernel, pick_body,
};
use crate::stages::tiles::Tile;

/// How often a limit that divides the nearest from the others is corrected.
const DIVISIONS: usize = 16;

/// No number up to this many times the limit: then approximate distances tell inside from outside.
const GAP: f32 = 1.0 + 8.0 * APPROXIMATE as f32;

/// The nearest neighbours of a point, summed up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sums {
    /// Exact sums over their differences to the point.
    pub moments: Moments,
    /// Squared distance of the last one.
    pub last2: u64,
}

impl Tile {
    /// Calls `each` with the sums over the `k` nearest neighbours of every point whose id is
    /// `wanted`, in order of id; with `None` where the halo cannot certify which they are.
    pub fn for_some_sums(
        &self,
        k: usize,
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        mut each: impl FnMut(u32, Point, Option<Sums>),
    ) {
        self.for_groups(k, search, wanted, |own, index, id, search| {
            let sums = self.sums(own, index, id, k, search);
            each(id, self.points[index], sums);
            sums.map_or(0, |sums| sums.last2)
        });
    }

    fn sums(
        &self,
        own: &OwnPage,
        index: usize,
        id: u32,
        k: usize,
        search: &mut Search,
    ) -> Option<Sums> {
        if let Some((sums, last2)) = sum_nearest(search.level, search, self.points[index], k) {
            let moments = Moments::from_sums(k, sums.0, sums.1);
            return Some(Sums { moments, last2 });
        }
        // Ties at the last place are decided by id, and far neighbours may be outside of the halo.
        self.nearest(own, index, id, k, search)?;
        Some(Sums {
            moments: search.near.moments(k, search.level),
            last2: search.near.get(k.checked_sub(1)?)?.distance2,
        })
    }
}

kernel! {
    /// Measures the candidates from `point` and sums over the `k` nearest neighbours; with the
    /// squared distance of the last. `None` if approximate distances do not tell which they are, if
    /// there are fewer as far as the candidates are complete, or if they are too far for these sums.
    fn sum_nearest(search: &mut Search, point: Point, k: usize) -> Option<(SecondMoments, u64)> = sum_body<Eight>
}

#[inline(always)]
fn sum_body<P: Pick>(search: &mut Search, point: Point, k: usize) -> Option<(SecondMoments, u64)> {
    measure_body(search, point);
    let most = above(search.candidates.complete2);
    let mut corrections = CORRECTIONS;
    let wanted = k + 2;
    let limit = reach_body(
        search.measured(),
        wanted,
        search.last,
        most,
        &mut corrections,
    );
    let measured = search.measured().len();
    let [x, y, z, _] = search.candidates.columns.slices();
    let from = [x, y, z, bytemuck::cast_slice(&search.distances)];
    let picked = pick_body::<P, 4>(
        &search.distances[..measured],
        limit,
        from,
        search.picked.slices_mut(),
    );
    let room = picked.next_multiple_of(BLOCK);
    let [_, _, _, numbers] = search.picked.slices_mut();
    numbers[picked..room].fill(f32::INFINITY.to_bits());
    let distances = bytemuck::cast_slice(search.picked.numbers(room));
    // The point itself is one of them, and adds nothing to the sums.
    let limit = divide_body(distances, k + 1, limit)?;
    search.last = limit;
    let certain = f64::from(limit) * (1.0 + 2.0 * APPROXIMATE);
    let exact = k < MOST_SUMMED && certain < SUMMED_LIMIT2 as f64;
    if !exact || certain > search.candidates.complete2 as f64 {
        return None;
    }
    let [x, y, z] = search.picked.coordinates(room);
    Some(sums_within(x, y, z, point, distances, limit))
}

/// A limit within which exactly `wanted` numbers are, so that no other is close to it; they are
/// about evenly spread up to `most`.
#[inline(always)]
fn divide_body(numbers: &[f32], wanted: usize, most: f32) -> Option<f32> {
    let (mut low, mut below) = (0.0f32, 0usize);
    let (mut high, mut within) = (most, count_body(numbers, most));
    let mut limit = most;
    for division in 0..DIVISIONS {
        let count = if limit == most {
            within
        } else {
            count_body(numbers, limit)
        };
        if count == wanted {
            return (count_body(numbers, limit * GAP) == wanted).then_some(limit);
        }
        if count < wanted {
            (low, below) = (limit, count);
        } else {
            (high, within) = (limit, count);
        }
        if within < wanted || below >= within {
            return None;
        }
        // Where it is if they are spread evenly; now and then in the middle, in case they are not.
        let share = (wanted as f32 + 0.5 - below as f32) / (within - below) as f32;
        let share = if division % 3 == 2 {
            0.5
        } else {
            share.min(0.9)
        };
        limit = low + (high - low) * share;
    }
    None
}

/// Sums over the points within `limit`, and the largest squared distance.
#[inline(always)]
fn sums_within(
    x: &[i32],
    y: &[i32],
    z: &[i32],
    point: Point,
    distances: &[f32],
    limit: f32,
) -> (SecondMoments, u64) {
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
    ((sum, products), last2 as u64)
}
