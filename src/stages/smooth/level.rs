//! The level of noise at a point: how far its nearest neighbours are from a surface of second order
//! (docs/method.md, section 4.2).
//!
//! Sums run over the point and then its neighbours, nearest first, with `+ - * / sqrt` only. So the bits are
//! the same on every machine and do not depend on how the neighbours were found.

use crate::cells::Fit;
use crate::levels::HIGHEST;
use crate::spacing::spacing2;
use crate::tiles::neighbors::Neighbors;
use outcrop_geom::method::METHOD;
use outcrop_geom::plane::Normal;

/// Unknowns of a surface of second order.
const TERMS: usize = 6;

/// Measures levels of noise, in memory that is reused.
#[derive(Debug, Default)]
pub struct Gauge {
    /// Differences to the point, divided by the reach; the first is the point itself.
    at: Vec<[f64; 3]>,
}

impl Gauge {
    /// The noise at a point, in local spacings, as [`Gauge::level`] judges it; and true if the level is not 0.
    /// `None` if there is no plane, or too few neighbours.
    pub fn noise(&mut self, near: &Neighbors, fit: &Fit, neighbors: usize) -> Option<(f64, bool)> {
        let spacing2 = spacing2(fit.near2, neighbors);
        let noise = (self.noise2(near, fit)? / spacing2).sqrt();
        Some((noise, noise > limit(1)))
    }

    /// The level of noise at a point whose plane is `fit`, through `neighbors` of its neighbours or more: the
    /// number of limits that the noise exceeds; and true if it is plain, at twice the first limit. The level is
    /// 0 if there is no plane, or too few neighbours.
    pub fn level(&mut self, near: &Neighbors, fit: &Fit, neighbors: usize) -> (u8, bool) {
        let Some(noise2) = self.noise2(near, fit) else {
            return (0, false);
        };
        let spacing2 = spacing2(fit.near2, neighbors);
        let above = |limit: f64| noise2 > limit * limit * spacing2;
        let level = (1..=HIGHEST)
            .take_while(|level| above(limit(*level)))
            .count();
        (level as u8, above(2.0 * limit(1)))
    }

    /// The mean square of the heights over the surface, for each degree of freedom, in steps.
    fn noise2(&mut self, near: &Neighbors, fit: &Fit) -> Option<f64> {
        let nearest = METHOD.noise.nearest;
        let last2 = near.get(nearest - 1)?.distance2;
        let normal = fit.plane.normal.filter(|_| last2 > 0)?;
        let reach = (METHOD.smoothing.reach2 * last2 as f64).sqrt();
        self.at.clear();
        self.at.push([0.0; 3]);
        let differences = near.iter().take(nearest).map(|near| near.difference);
        let scaled = differences.map(|d| d.map(|c| c as f64 / reach));
        self.at.extend(scaled);
        let surface = self.surface(unit(normal));
        let left: f64 = self.at.iter().map(|&at| surface.height2(at)).sum();
        Some(left * (reach * reach) / (nearest + 1 - TERMS) as f64)
    }

    /// The least-squares surface of second order over the plane with `normal`.
    fn surface(&self, normal: [f64; 3]) -> Surface {
        let [u, v] = frame(normal);
        let frame = [u, v, normal];
        // Normal equations; the last column is the right-hand side.
        let mut m = [[0.0; TERMS + 1]; TERMS];
        for at in &self.at {
            let row = row(&frame, *at);
            for (i, equation) in m.iter_mut().enumerate() {
                (i..=TERMS).for_each(|j| equation[j] += row[i] * row[j]);
            }
        }
        let ridge = METHOD.smoothing.ridge * m[0][0];
        let ridges = [0.0, 1.0, 1.0, 0.5, 0.25, 0.5];
        (0..TERMS).for_each(|i| m[i][i] += ridge * ridges[i]);
        for pivot in 0..TERMS {
            let from = m[pivot];
            for i in pivot + 1..TERMS {
                let factor = from[i] / from[pivot];
                (i..=TERMS).for_each(|j| m[i][j] -= factor * from[j]);
            }
        }
        let mut terms = [0.0; TERMS];
        for i in (0..TERMS).rev() {
            let known: f64 = (i + 1..TERMS).map(|j| m[i][j] * terms[j]).sum();
            terms[i] = (m[i][TERMS] - known) / m[i][i];
        }
        Surface { frame, terms }
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
fn row(frame: &[[f64; 3]; 3], at: [f64; 3]) -> [f64; TERMS + 1] {
    let [x, y, height] = frame.map(|axis| dot(at, axis));
    [1.0, x, y, x * x, x * y, y * y, height]
}

/// A surface of second order.
#[derive(Debug, Clone, Copy)]
struct Surface {
    /// Two directions in the plane, and the normal.
    frame: [[f64; 3]; 3],
    terms: [f64; TERMS],
}

impl Surface {
    /// Square of the height of a position above the surface.
    fn height2(&self, at: [f64; 3]) -> f64 {
        let row = row(&self.frame, at);
        let on: f64 = (0..TERMS).map(|i| self.terms[i] * row[i]).sum();
        (row[TERMS] - on) * (row[TERMS] - on)
    }
}

/// A normal, scaled to unit length.
pub(super) fn unit(normal: Normal) -> [f64; 3] {
    let normal = normal.map(f64::from);
    let length = dot(normal, normal).sqrt();
    normal.map(|n| n / length)
}

/// Two unit vectors at right angles to each other and to `n`.
pub(super) fn frame(n: [f64; 3]) -> [[f64; 3]; 2] {
    // Across x, unless x is close to the normal.
    let u = if n[0] * n[0] < 0.5 {
        [0.0, n[2], -n[1]]
    } else {
        [-n[2], 0.0, n[0]]
    };
    let length = dot(u, u).sqrt();
    let u = u.map(|x| x / length);
    let v = [
        n[1] * u[2] - n[2] * u[1],
        n[2] * u[0] - n[0] * u[2],
        n[0] * u[1] - n[1] * u[0],
    ];
    [u, v]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
