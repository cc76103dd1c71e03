//! Smoothing of noisy points (section 4): the shape, positions that decide which points are connected.

use super::Settings;
use super::cells::{by_distance, widened_plane};
use super::edges::{heights2, offset};
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

/// The position to which a noisy point moves; one too far from the surface stays. Where more neighbours lie in
/// layers, fewer are used.
fn moved(points: &[Point], i: usize, k: usize, rounds: u8) -> Point {
    let others = by_distance(points, i);
    let last2 = |count: usize| {
        let last = others[..count.min(others.len())].last();
        last.map_or(0, |&j| distance2(points[i], points[j]))
    };
    let mut count = 2 * k;
    let Some((mut offset, mean2)) = offset(points, i, count) else {
        return points[i];
    };
    let limit = 0.4 * f64::from(rounds);
    let spacing2 = std::f64::consts::PI * last2(count) as f64 / count as f64;
    if k.max(30) < count && mean2 > limit * limit * spacing2 {
        count = k.max(30);
        match super::edges::offset(points, i, count) {
            Some(fewer) => offset = fewer.0,
            None => return points[i],
        }
    }
    let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    if length2 > 0.25 * last2(count) as f64 {
        return points[i];
    }
    std::array::from_fn(|axis| {
        let to = i64::from(points[i][axis]) + offset[axis].round() as i64;
        to.clamp(0, COORDINATE_LIMIT - 1) as i32
    })
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
    let all: Vec<u8> = all.collect();
    relaxed.moved = all.iter().filter(|rounds| **rounds > 0).count();
    relaxed.kept = levels
        .iter()
        .zip(&all)
        .filter(|(level, rounds)| **level > **rounds)
        .count();
    relaxed.noise = levels;
    relaxed.rounds = u32::from(all.iter().copied().max().unwrap_or(0));
    for round in 1..=most {
        let before = relaxed.shape.clone();
        for i in (0..points.len()).filter(|&i| all[i] >= round) {
            relaxed.shape[i] = moved(&before, i, k, all[i]);
        }
    }
    relaxed
}
