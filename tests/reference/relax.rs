//! Smoothing of noisy points (section 4): the shape, positions that decide which points are connected.

use super::Settings;
use super::cells::{by_distance, widened_plane};
use super::edges::{heights2, offset_from};
use outcrop_geom::lattice::COORDINATE_LIMIT;
use outcrop_geom::{Point, distance2};

/// The result of relaxing.
pub struct Relaxed {
    pub shape: Vec<Point>,
    /// The level of noise of each point.
    pub noise: Vec<u8>,
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Noisy points.
    pub moved: usize,
    /// Points whose nearest neighbours show noise and which are kept in place by clean ones.
    pub kept: usize,
}

/// Ids in a run, runs of which one is sampled, ids in a region.
const RUN: usize = 16;
const SAMPLED: usize = 8;
const REGION: usize = 65_536;

/// Points that have the noise of the first of them.
const EVERY: usize = 4;

/// The number of limits that the noise at a point exceeds, and true if it is plain: twice the first.
fn level(points: &[Point], i: usize, k: usize) -> (u8, bool) {
    let others = by_distance(points, i);
    let plane = widened_plane(points, i, k, true).1;
    let (Some(normal), Some(nearest)) = (plane.normal, others.get(..8)) else {
        return (0, false);
    };
    let Some(left) = heights2(points, i, nearest, normal) else {
        return (0, false);
    };
    let reach2 = distance2(points[i], points[others[k.min(others.len()) - 1]]);
    let spacing2 = std::f64::consts::PI * reach2 as f64 / k as f64;
    let above = |limit: f64| left / 3.0 > limit * limit * spacing2;
    let level = [0.02, 0.1, 0.2]
        .into_iter()
        .take_while(|limit| above(*limit))
        .count();
    (level as u8, above(0.04))
}

/// The levels of all points; 0 in regions without a sampled run of which fewer than a tenth has no plain noise.
fn levels(points: &[Point], k: usize) -> Vec<u8> {
    let ids: Vec<usize> = (0..points.len()).collect();
    let of_region = |region: &[usize]| -> Vec<u8> {
        let all: Vec<(u8, bool)> = region.iter().map(|&i| level(points, i, k)).collect();
        let runs = all.chunks_exact(RUN).step_by(SAMPLED);
        let clean = |run: &[(u8, bool)]| run.iter().filter(|(_, plain)| !plain).count();
        let noisy = { runs }.any(|run| 10 * clean(run) < RUN);
        let level = |i: usize| if noisy { all[i - i % EVERY].0 } else { 0 };
        (0..region.len()).map(level).collect()
    };
    ids.chunks(REGION).flat_map(of_region).collect()
}

/// The number of rounds in which a point moves.
fn rounds(points: &[Point], levels: &[u8], i: usize, k: usize) -> u8 {
    let mut around = by_distance(points, i);
    around.truncate(2 * k);
    around.push(i);
    let below = |limit: u8| around.iter().filter(|&&j| levels[j] < limit).count();
    (1..=3)
        .take_while(|&limit| 10 * below(limit) < around.len())
        .count() as u8
}

/// A point and those nearest to it that are not left out; itself only if it is not.
fn around(points: &[Point], i: usize, left_out: &[bool]) -> Vec<usize> {
    let mut around = by_distance(points, i);
    around.insert(0, i);
    around.retain(|&j| !left_out[j]);
    around
}

/// The nearest of the points around a point, one more than `count`.
fn nearest(around: &[usize], count: usize) -> &[usize] {
    &around[..around.len().min(count + 1)]
}

/// Squared distance of the last of the points around a point.
fn last2(points: &[Point], i: usize, around: &[usize]) -> u64 {
    let distances = around.iter().map(|&j| distance2(points[i], points[j]));
    distances.max().unwrap_or(0)
}

/// True if the mean squared height of the `count` nearest over their surface, which reach as far as `2 k` of all points,
/// is more than that of `limit` spacings.
fn is_over(
    points: &[Point],
    i: usize,
    around: &[usize],
    (count, k): (usize, usize),
    limit: f64,
) -> bool {
    let around = nearest(around, count);
    let Some((_, mean2)) = offset_from(points, i, around) else {
        return false;
    };
    let spacing2 = std::f64::consts::PI * last2(points, i, around) as f64 / (2 * k) as f64;
    mean2 > limit * limit * spacing2
}

/// The position to which a point moves by `count` of the points around it, or by fewer in layers; one too far from the
/// surface stays.
fn moved(
    points: &[Point],
    i: usize,
    around: &[usize],
    (count, k): (usize, usize),
    rounds: u8,
) -> Point {
    let fewer = k.max(30);
    let layers = 0.4 * f64::from(rounds);
    let in_layers = fewer < count && is_over(points, i, around, (count, k), layers);
    let around = nearest(around, if in_layers { fewer } else { count });
    let Some((offset, _)) = offset_from(points, i, around) else {
        return points[i];
    };
    let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    if length2 > 0.25 * last2(points, i, around) as f64 {
        return points[i];
    }
    std::array::from_fn(|axis| {
        let to = i64::from(points[i][axis]) + offset[axis].round() as i64;
        to.clamp(0, COORDINATE_LIMIT - 1) as i32
    })
}

/// True if a point follows the point before it, of which the `rounds` are given.
fn follows(points: &[Point], i: usize, k: usize, rounds: &[u8]) -> bool {
    if i.is_multiple_of(2) || rounds[i - 1] < 2 {
        return false;
    }
    let around = around(points, i - 1, &vec![false; points.len()]);
    let reach2 = last2(points, i - 1, nearest(&around, 2 * k));
    4 * distance2(points[i], points[i - 1]) <= reach2
        && !is_over(points, i - 1, &around, (2 * k, k), 0.7)
}

/// The shape of a cloud.
pub fn relax(points: &[Point], settings: &Settings) -> Relaxed {
    let k = settings.neighbors;
    let mut relaxed = Relaxed {
        shape: points.to_vec(),
        noise: vec![0; points.len()],
        rounds: 0,
        moved: 0,
        kept: 0,
    };
    if settings.relax == 0 {
        return relaxed;
    }
    let levels = levels(points, k);
    if levels.iter().all(|level| *level == 0) {
        return relaxed;
    }
    let most = settings.relax.min(3) as u8;
    // A run without noise stays.
    let run = |i: usize| levels[i - i % RUN..].iter().take(RUN);
    let is_in_noise = |i: usize| run(i).any(|level| *level > 0);
    let own = |i: usize| rounds(points, &levels, i, k).min(most);
    let all = (0..points.len()).map(|i| if is_in_noise(i) { own(i) } else { 0 });
    let mut all: Vec<u8> = all.collect();
    let follows: Vec<bool> = { 0..points.len() }
        .map(|i| follows(points, i, k, &all))
        .collect();
    for i in (0..points.len()).filter(|i| follows[*i]) {
        all[i] = all[i - 1];
    }
    relaxed.moved = all.iter().filter(|rounds| **rounds > 0).count();
    relaxed.kept = levels
        .iter()
        .zip(&all)
        .filter(|(level, rounds)| **level > **rounds)
        .count();
    relaxed.noise = levels;
    relaxed.rounds = u32::from(all.iter().copied().max().unwrap_or(0));
    let none = vec![false; points.len()];
    for round in 1..=most {
        let before = relaxed.shape.clone();
        let moves = |i: &usize| all[*i] == round || all[*i] > round && !follows[*i];
        for i in (0..points.len()).filter(moves) {
            let is_first = round == 1;
            let left_out = if is_first { &none } else { &follows };
            let run = left_out[i - i % RUN..].iter().take(RUN);
            let count = 2 * k * (RUN - run.filter(|follows| **follows).count()) / RUN;
            let around = around(&before, i, left_out);
            relaxed.shape[i] = moved(&before, i, &around, (count, k), all[i]);
        }
    }
    relaxed
}
