//! The level of noise at a point: how far its nearest neighbours are from a surface of second order
//! (docs/method.md, section 4.2).
//!
//! Sums run over the point and then its neighbours, nearest first, with `+ - * / sqrt` only. So the bits are
//! the same on every machine and do not depend on how the neighbours were found.

use crate::cells::Fit;
use crate::levels::HIGHEST;
use crate::spacing::spacing2;
use crate::tiles::neighbors::Neighbors;
use outcrop_paper::kernels::eight::{Eight, loaded};
use outcrop_paper::kernels::numbers::Numbers;
use outcrop_paper::kernels::{LANES, Level, kernel};
use outcrop_paper::method::METHOD;

/// Unknowns of a surface of second order.
const TERMS: usize = 6;

/// Measures the noise at a point, in memory that is reused.
#[derive(Debug, Default)]
pub struct Gauge {
    /// Differences to the neighbours.
    at: Vec<[f64; 3]>,
}

impl Gauge {
    /// The noise at a point, in local spacings, as `Gauges` judge it; and true if the level is not 0. `None` if
    /// there is no plane, or too few neighbours.
    pub fn noise(&mut self, near: &Neighbors, fit: &Fit, neighbors: usize) -> Option<(f64, bool)> {
        let (normal, reach) = plane_and_reach(near, fit)?;
        let differences = near.iter().take(METHOD.noise.nearest);
        self.at.clear();
        self.at
            .extend(differences.map(|near| near.difference.map(|c| c as f64)));
        let noise2 = noise2_body(&self.at, normal, reach);
        let noise = (noise2 / spacing2(fit.near2, neighbors)).sqrt();
        Some((noise, noise > limit(1)))
    }
}

/// Measures the levels of noise of several points at a time, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct Gauges<T> {
    level: Level,
    count: usize,
    points: [T; LANES],
    /// Squares of the local spacings.
    spacings2: [f64; LANES],
    normals: [[f64; LANES]; 3],
    reach: [f64; LANES],
    /// Differences to the neighbours, nearest first.
    at: Vec<[[f64; LANES]; 3]>,
}

impl<T: Copy> Gauges<T> {
    /// Adds a point whose plane is `fit`, through `neighbors` of its neighbours or more. Calls `put` with the
    /// points whose level is known: the number of limits that the noise exceeds; and true if it is plain, at twice
    /// the first limit. The level is 0 if there is no plane, or too few neighbours.
    pub fn add(
        &mut self,
        point: T,
        near: &Neighbors,
        (fit, neighbors): (&Fit, usize),
        put: &mut impl FnMut(T, u8, bool),
    ) {
        let Some((normal, reach)) = plane_and_reach(near, fit) else {
            return put(point, 0, false);
        };
        let lane = self.count;
        self.at.resize(METHOD.noise.nearest, [[0.0; LANES]; 3]);
        for (to, near) in self.at.iter_mut().zip(near.iter()) {
            (0..3).for_each(|axis| to[axis][lane] = near.difference[axis] as f64);
        }
        (0..3).for_each(|axis| self.normals[axis][lane] = normal[axis]);
        self.reach[lane] = reach;
        self.spacings2[lane] = spacing2(fit.near2, neighbors);
        self.points[lane] = point;
        self.count += 1;
        if self.count == LANES {
            self.finish(put);
        }
    }

    /// Calls `put` with the points that are left.
    pub fn finish(&mut self, put: &mut impl FnMut(T, u8, bool)) {
        if self.count == 0 {
            return;
        }
        let noises2 = noises2(self.level, &self.at, &self.normals, &self.reach);
        for (lane, noise2) in noises2.into_iter().enumerate().take(self.count) {
            let above = |limit: f64| noise2 > limit * limit * self.spacings2[lane];
            let level = (1..=HIGHEST)
                .take_while(|level| above(limit(*level)))
                .count();
            put(self.points[lane], level as u8, above(2.0 * limit(1)));
        }
        self.count = 0;
    }
}

/// The normal of a point's plane, and the distance by which differences are divided.
fn plane_and_reach(near: &Neighbors, fit: &Fit) -> Option<([f64; 3], f64)> {
    let last2 = near.get(METHOD.noise.nearest - 1)?.distance2;
    let normal = fit.plane.normal.filter(|_| last2 > 0)?;
    let reach = (METHOD.smoothing.reach2 * last2 as f64).sqrt();
    Some((normal.map(f64::from), reach))
}

kernel! {
    /// [`noise2_body`] of several points.
    fn noises2(
        at: &[[[f64; LANES]; 3]],
        normals: &[[f64; LANES]; 3],
        reach: &[f64; LANES],
    ) -> [f64; LANES] = noises2_body<Eight>
}

#[inline(always)]
fn noises2_body<F: Eight>(
    at: &[[[f64; LANES]; 3]],
    normals: &[[f64; LANES]; 3],
    reach: &[f64; LANES],
) -> [f64; LANES] {
    let mut noises2 = [0.0; LANES];
    let all = Each(at);
    noise2_body::<F>(&all, loaded(normals), F::load(reach)).store(&mut noises2);
    noises2
}

/// The mean square of the heights of a point and its nearest neighbours over the surface of second order over the
/// plane with `normal`, for each degree of freedom, in steps.
#[inline(always)]
fn noise2_body<F: Numbers>(at: &impl Differences<F>, normal: [F; 3], reach: F) -> F {
    let normal = unit(normal);
    let [u, v] = frame(normal);
    let surface = Surface::of(at, [u, v, normal], reach);
    let mut left = surface.height2([F::splat(0.0); 3]);
    for place in 0..at.count() {
        left = left + surface.height2(over(at.get(place), reach));
    }
    let freedom = at.count() + 1 - TERMS;
    left * (reach * reach) / F::splat(freedom as f64)
}

/// Differences to neighbours.
trait Differences<F> {
    fn count(&self) -> usize;
    fn get(&self, place: usize) -> [F; 3];
}

impl Differences<f64> for Vec<[f64; 3]> {
    fn count(&self) -> usize {
        self.len()
    }

    fn get(&self, place: usize) -> [f64; 3] {
        self[place]
    }
}

/// The differences of several points.
struct Each<'a>(&'a [[[f64; LANES]; 3]]);

impl<F: Eight> Differences<F> for Each<'_> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn get(&self, place: usize) -> [F; 3] {
        loaded(&self.0[place])
    }
}

/// The noise, in local spacings, above which a point has at least this level.
fn limit(level: u8) -> f64 {
    match level {
        0 | 1 => METHOD.noise.floor,
        more => f64::from(more - 1) * METHOD.noise.round,
    }
}

/// The terms of second order at a position, and its height.
#[inline(always)]
fn row<F: Numbers>([u, v, n]: &[[F; 3]; 3], at: [F; 3]) -> [F; TERMS + 1] {
    let (x, y, height) = (dot(at, *u), dot(at, *v), dot(at, *n));
    [F::splat(1.0), x, y, x * x, x * y, y * y, height]
}

/// A surface of second order.
#[derive(Debug, Clone, Copy)]
struct Surface<F> {
    /// Two directions in the plane, and the normal.
    frame: [[F; 3]; 3],
    terms: [F; TERMS],
}

impl<F: Numbers> Surface<F> {
    /// The least-squares surface through a point and its neighbours, at their differences divided by `reach`.
    #[inline(always)]
    fn of(at: &impl Differences<F>, frame: [[F; 3]; 3], reach: F) -> Self {
        // Normal equations; the last column is the right-hand side.
        let mut m = [[F::splat(0.0); TERMS + 1]; TERMS];
        // The point itself.
        m[0][0] = F::splat(1.0);
        for place in 0..at.count() {
            let row = row(&frame, over(at.get(place), reach));
            for i in 0..TERMS {
                for j in i..=TERMS {
                    m[i][j] = m[i][j] + row[i] * row[j];
                }
            }
        }
        let ridge = F::splat(METHOD.smoothing.ridge) * m[0][0];
        let ridges = [0.0, 1.0, 1.0, 0.5, 0.25, 0.5];
        for i in 0..TERMS {
            m[i][i] = m[i][i] + ridge * F::splat(ridges[i]);
        }
        for pivot in 0..TERMS {
            let from = m[pivot];
            for i in pivot + 1..TERMS {
                let factor = from[i] / from[pivot];
                for j in i..=TERMS {
                    m[i][j] = m[i][j] - factor * from[j];
                }
            }
        }
        let mut terms = [F::splat(0.0); TERMS];
        for i in (0..TERMS).rev() {
            let mut known = F::splat(0.0);
            for j in i + 1..TERMS {
                known = known + m[i][j] * terms[j];
            }
            terms[i] = (m[i][TERMS] - known) / m[i][i];
        }
        Self { frame, terms }
    }

    /// Square of the height of a position above the surface.
    #[inline(always)]
    fn height2(&self, at: [F; 3]) -> F {
        let row = row(&self.frame, at);
        let mut on = self.terms[0] * row[0];
        for (term, x) in self.terms.iter().zip(&row).skip(1) {
            on = on + *term * *x;
        }
        (row[TERMS] - on) * (row[TERMS] - on)
    }
}

/// A normal, scaled to unit length.
#[inline(always)]
pub(super) fn unit<F: Numbers>(normal: [F; 3]) -> [F; 3] {
    over(normal, dot(normal, normal).sqrt())
}

/// Two unit vectors at right angles to each other and to `n`.
#[inline(always)]
pub(super) fn frame<F: Numbers>(n: [F; 3]) -> [[F; 3]; 2] {
    let (none, minus) = (F::splat(0.0), F::splat(-1.0));
    // Across x, unless x is close to the normal.
    let across = F::splat(0.5).greater(n[0] * n[0]);
    let u = F::choose(
        across,
        [none, n[2], n[1] * minus],
        [n[2] * minus, none, n[0]],
    );
    let u = over(u, dot(u, u).sqrt());
    let v = [
        n[1] * u[2] - n[2] * u[1],
        n[2] * u[0] - n[0] * u[2],
        n[0] * u[1] - n[1] * u[0],
    ];
    [u, v]
}

/// A vector, divided.
#[inline(always)]
fn over<F: Numbers>([x, y, z]: [F; 3], by: F) -> [F; 3] {
    [x / by, y / by, z / by]
}

#[inline(always)]
fn dot<F: Numbers>(a: [F; 3], b: [F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
