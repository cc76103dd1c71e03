//! Relaxing (section 4.3): the shape, positions that decide which points are connected.

use super::cells::{by_distance, plane_of};
use super::edges::{is_clean, is_curved};
use super::spacing::Density;
use outcrop::geom::lattice::COORDINATE_LIMIT;
use outcrop::geom::{Point, distance2};

/// The result of relaxing.
pub struct Relaxed {
    pub shape: Vec<Point>,
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Points that moved, counted in each round.
    pub moved: usize,
    /// Rough patches that stay because most rough ones of their region are curved.
    pub curved: usize,
    /// Rough patches that stay because their region has no noise.
    pub clean: usize,
}

/// Ids in a patch.
const PATCH: usize = 256;

/// Ids in a run.
const RUN: usize = 16;

/// Patches in a region.
const REGION: usize = 256;

/// The new position of a point; true if it is rough. A point without a plane, or off the surface, stays and
/// is not rough.
fn foot(points: &[Point], i: usize, k: usize, density: Option<&Density>) -> (Point, bool) {
    let others = by_distance(points, i);
    let used = &others[..k.min(others.len())];
    let (moments, plane) = plane_of(points, i, used);
    let (Some(normal), Some(&last)) = (plane.normal, used.last()) else {
        return (points[i], false);
    };
    let last2 = distance2(points[i], points[last]);
    if density.is_some_and(|d| d.is_off_surface(i, last2)) {
        return (points[i], false);
    }
    let offset = moments.project(normal);
    let to = std::array::from_fn(|axis| {
        let moved = i64::from(points[i][axis]) + offset[axis].round() as i64;
        moved.clamp(0, COORDINATE_LIMIT - 1) as i32
    });
    let square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    let spacing2 = std::f64::consts::PI * last2 as f64 / k as f64;
    (to, square > 0.2 * 0.2 * spacing2)
}

/// True if a patch is rough, by its samples.
fn uneven(rough: &[bool]) -> bool {
    16 * rough.iter().filter(|r| **r).count() > rough.len()
}

/// True if a rough patch has noise, by its telling points.
fn noisy(points: &[Point], telling: &[usize], k: usize) -> bool {
    let curved = telling.iter().filter(|&&id| is_curved(points, id, k));
    2 * curved.count() < telling.len()
}

/// At most `rounds` rounds; smoothed points are never clean.
pub fn relax(
    points: &[Point],
    k: usize,
    rounds: u32,
    smoothed: bool,
    density: Option<&Density>,
) -> Relaxed {
    let foot = |points: &[Point], id: usize, k: usize| foot(points, id, k, density);
    let mut relaxed = Relaxed {
        shape: points.to_vec(),
        rounds: 0,
        moved: 0,
        curved: 0,
        clean: 0,
    };
    let patches = points.len().div_ceil(PATCH);
    let ids = |patch: usize| PATCH * patch..points.len().min(PATCH * (patch + 1));
    let some = |patch: usize| ids(patch).filter(|id| (id / RUN).is_multiple_of(8));
    let look =
        |patch: usize| -> Vec<bool> { some(patch).map(|id| foot(points, id, k).1).collect() };
    let mut moving: Vec<usize> = (0..patches).filter(|&p| uneven(&look(p))).collect();
    let of_region =
        |all: &[usize], p: usize| all.iter().filter(|&&q| q / REGION == p / REGION).count();
    let in_region = |p: usize| (0..patches).filter(|q| q / REGION == p / REGION).count();
    let rough = moving.clone();
    // The first rough samples of a patch.
    let telling = |p: usize| -> Vec<usize> {
        some(p)
            .filter(|&id| foot(points, id, k).1)
            .take(3)
            .collect()
    };
    let mut noise = rough.clone();
    noise.retain(|&p| noisy(points, &telling(p), k));
    let is_clean_region = |p: usize| {
        let of_region = rough.iter().filter(|&&q| q / REGION == p / REGION);
        let telling: Vec<usize> = of_region.flat_map(|&q| telling(q)).collect();
        let told = telling.iter().filter_map(|&id| is_clean(points, id, k));
        let told: Vec<bool> = told.collect();
        let (fine, clean) = (told.len(), told.iter().filter(|c| **c).count());
        !smoothed && 10 * clean > fine && 10 * clean <= 7 * fine
    };
    let regions = patches.div_ceil(REGION);
    let clean: Vec<bool> = (0..regions)
        .map(|region| is_clean_region(REGION * region))
        .collect();
    moving.retain(|&p| {
        let (noise, rough) = (of_region(&noise, p), of_region(&rough, p));
        let moves = 8 * noise >= in_region(p) && 10 * noise >= 3 * rough;
        relaxed.curved += usize::from(!moves && 8 * rough >= in_region(p));
        relaxed.clean += usize::from(moves && clean[p / REGION]);
        moves && !clean[p / REGION]
    });
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
