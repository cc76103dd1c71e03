//! A scanner: rays, what they hit, and the errors of the ranges.

use std::f64::consts::FRAC_1_SQRT_2;

use super::{Measured, Task};
use crate::rng::{Purpose, Rng};
use crate::spots::{Spots, median};
use crate::triangles::Triangles;
use crate::vec3::{Vec3, add, cross, dot, length, normalize, scale, sub};

/// Points at which the spacing is taken, at most.
const SPACINGS: usize = 4096;

/// Neighbours by which the spacing is taken.
const NEIGHBORS: usize = 6;

/// Ranges of two successive rays this many spacings apart are a depth edge.
const EDGE: f64 = 10.0;

/// What a ray has hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    direction: Vec3,
    range: f64,
    pub(super) place: Vec3,
    normal: Vec3,
}

/// The limits of a scanner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Largest range.
    pub(super) far: f64,
    /// Least cosine of the angle between ray and normal: grazing rays give nothing back.
    pub(super) grazing: f64,
}

/// One scan: the hits of all rays in rows.
#[derive(Debug, Default)]
pub(super) struct Scan {
    hits: Vec<Option<Hit>>,
    /// Rays of a row; 0 if they are in no order.
    row: usize,
}

impl Scan {
    /// Casts rays, in rows of some length.
    pub(super) fn new(
        tree: &Triangles,
        rays: impl Iterator<Item = (Vec3, Vec3)>,
        row: usize,
        limits: Limits,
    ) -> Self {
        let hits = rays.map(|(origin, direction)| cast(tree, origin, direction, limits));
        Scan {
            hits: hits.collect(),
            row,
        }
    }

    /// Number of hits.
    pub(super) fn count(&self) -> usize {
        self.hits.iter().flatten().count()
    }

    /// Rays at depth edges: the ray and the next one of its row.
    fn edges(&self, depth: f64) -> Vec<usize> {
        let edge = |at: &usize| {
            let ends = self.row == 0 || (at + 1).is_multiple_of(self.row);
            match (self.hits[*at], self.hits.get(at + 1).copied().flatten()) {
                (Some(a), Some(b)) if !ends => (a.range - b.range).abs() > depth,
                _ => false,
            }
        };
        (0..self.hits.len()).filter(edge).collect()
    }
}

fn cast(tree: &Triangles, origin: Vec3, direction: Vec3, limits: Limits) -> Option<Hit> {
    let direction = normalize(direction);
    let found = tree.first_on_ray(origin, direction)?;
    let seen = -dot(found.normal, direction) > limits.grazing && found.distance < limits.far;
    seen.then(|| Hit {
        direction,
        range: found.distance,
        place: add(origin, scale(direction, found.distance)),
        normal: found.normal,
    })
}

/// The median spacing of points, by some of them.
pub(super) fn spacing(places: &[Vec3]) -> f64 {
    let spots = Spots::new(places);
    let every = places.len().div_ceil(SPACINGS).max(1);
    let some = places.iter().step_by(every);
    median(some.map(|p| spots.spacing(*p, NEIGHBORS)).collect())
}

/// The points of scans; `growth` is the noise at a range, in units of the mean range.
pub(super) fn measure(scans: &[Scan], task: &Task, growth: impl Fn(f64) -> f64) -> Vec<Measured> {
    let hits = || scans.iter().flat_map(|scan| scan.hits.iter().flatten());
    let places: Vec<Vec3> = hits().map(|hit| hit.place).collect();
    let spacing = spacing(&places);
    let mean = hits().map(|hit| hit.range).sum::<f64>() / places.len().max(1) as f64;
    let reach = places.iter().map(|p| length(*p)).fold(0.0, f64::max);
    let noise = task.measuring.noise * spacing;
    let mut points = Vec::with_capacity(places.len());
    for (number, scan) in scans.iter().enumerate() {
        let mut rng = task.random(Purpose::Scanner, number);
        let [turn, shift] = misfit(&mut rng, task.measuring.registration * spacing, reach);
        let edges = scan.edges(EDGE * spacing);
        let flying = chosen(edges, scan.count(), task, number);
        for (at, hit) in scan.hits.iter().enumerate() {
            let Some(hit) = hit else { continue };
            let next = scan.hits.get(at + 1).copied().flatten();
            let flies = flying.binary_search(&at).is_ok();
            let mut rng = task.random(Purpose::Noise, points.len());
            let range = match next {
                Some(next) if flies => {
                    let part = 0.1 + 0.8 * rng.uniform();
                    (next.range - hit.range) * part
                }
                _ => noise * growth(hit.range / mean) * rng.normal(),
            };
            let moved = scale(hit.direction, range);
            let place = add(hit.place, moved);
            let drift = add(cross(turn, place), shift);
            points.push(Measured {
                place: hit.place,
                normal: hit.normal,
                error: add(moved, drift),
                real: !flies,
            });
        }
    }
    points
}

/// The rotation, as axis times angle, and the shift of a scan that does not fit: each has about 0.7 of the
/// error, the rotation at half the reach.
fn misfit(rng: &mut Rng, error: f64, reach: f64) -> [Vec3; 2] {
    let mut vector = |size: f64| {
        let any = [(); 3].map(|()| rng.normal());
        scale(normalize(any), size * FRAC_1_SQRT_2)
    };
    if error > 0.0 {
        [vector(error / (0.5 * reach)), vector(error)]
    } else {
        [[0.0; 3]; 2]
    }
}

/// The rays of a scan whose points lie between near and far, in order.
fn chosen(edges: Vec<usize>, count: usize, task: &Task, scan: usize) -> Vec<usize> {
    let wanted = (task.measuring.flying * count as f64).round() as usize;
    let mut keyed: Vec<(u64, usize)> = edges
        .into_iter()
        .map(|at| {
            let seed = task.seed.wrapping_add(scan as u64);
            (Rng::at(seed, Purpose::Outlier, at as u64).next_u64(), at)
        })
        .collect();
    keyed.sort_unstable();
    keyed.truncate(wanted);
    let mut chosen: Vec<usize> = keyed.into_iter().map(|key| key.1).collect();
    chosen.sort_unstable();
    chosen
}

/// True if nothing is between two places; the second is on the surface.
pub(super) fn sees(tree: &Triangles, eye: Vec3, place: Vec3) -> bool {
    let way = sub(place, eye);
    let hit = tree.first_on_ray(eye, way);
    // In units of the way.
    hit.is_none_or(|hit| hit.distance > 1.0 - 1e-6)
}
