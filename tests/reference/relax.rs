//! Relaxing (section 1.2): the shape, positions that decide which points are connected.

use super::cells::{by_distance, plane_of};
use outcrop::geom::lattice::COORDINATE_LIMIT;
use outcrop::geom::{Point, distance2};

/// What relaxing came to.
pub struct Relaxed {
    pub shape: Vec<Point>,
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Points that moved, once for each round.
    pub moved: usize,
}

/// Ids in a patch.
const PATCH: usize = 256;

/// Ids in a run.
const RUN: usize = 16;

/// Patches in a region.
const REGION: usize = 256;

/// Where a point goes, and whether it is rough. A point without a plane stays and is not.
fn foot(points: &[Point], i: usize, k: usize) -> (Point, bool) {
    let others = by_distance(points, i);
    let used = &others[..k.min(others.len())];
    let (moments, plane) = plane_of(points, i, used);
    let (Some(normal), Some(&last)) = (plane.normal, used.last()) else {
        return (points[i], false);
    };
    let offset = moments.project(normal);
    let to = std::array::from_fn(|axis| {
        let moved = i64::from(points[i][axis]) + offset[axis].round() as i64;
        moved.clamp(0, COORDINATE_LIMIT - 1) as i32
    });
    let square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    let spacing2 = std::f64::consts::PI * distance2(points[i], points[last]) as f64 / k as f64;
    (to, square > 0.3 * 0.3 * spacing2)
}

/// Whether a patch moves, by the points of it that were looked at.
fn uneven(rough: &[bool]) -> bool {
    16 * rough.iter().filter(|r| **r).count() > rough.len()
}

/// At most `rounds` rounds.
pub fn relax(points: &[Point], k: usize, rounds: u32) -> Relaxed {
    let mut relaxed = Relaxed {
        shape: points.to_vec(),
        rounds: 0,
        moved: 0,
    };
    let patches = points.len().div_ceil(PATCH);
    let ids = |patch: usize| PATCH * patch..points.len().min(PATCH * (patch + 1));
    let look = |patch: usize| -> Vec<bool> {
        let some = ids(patch).filter(|id| (id / RUN).is_multiple_of(8));
        some.map(|id| foot(points, id, k).1).collect()
    };
    let mut moving: Vec<usize> = (0..patches).filter(|&p| uneven(&look(p))).collect();
    let of_region =
        |all: &[usize], p: usize| all.iter().filter(|&&q| q / REGION == p / REGION).count();
    let in_region = |p: usize| (0..patches).filter(|q| q / REGION == p / REGION).count();
    let rough = moving.clone();
    moving.retain(|&p| 4 * of_region(&rough, p) >= in_region(p));
    let mut runs: Vec<Vec<usize>> = moving
        .into_iter()
        .flat_map(|p| {
            ids(p)
                .collect::<Vec<_>>()
                .chunks(RUN)
                .map(Vec::from)
                .collect::<Vec<_>>()
        })
        .collect();
    while relaxed.rounds < rounds && !runs.is_empty() {
        let before = relaxed.shape.clone();
        runs.retain(|run| {
            let mut rough = 0;
            for &id in run {
                let (to, far) = foot(&before, id, k);
                relaxed.shape[id] = to;
                rough += usize::from(far);
            }
            relaxed.moved += run.len();
            rough >= 1
        });
        relaxed.rounds += 1;
    }
    relaxed
}
