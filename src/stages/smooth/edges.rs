//! Tests of relaxing: whether the neighbours of a point lie on a curved surface, and whether they show noise
//! (docs/method.md, section 4.3).
//!
//! Sums run over the point and then its neighbours, nearest first, with `+ - * / sqrt` only. So the bits are
//! the same on every machine and do not depend on how the neighbours were found.

use crate::geom::plane::{Normal, least_direction};
use crate::method::METHOD;
use crate::stages::spacing::spacing2;
use crate::stages::tiles::neighbors::Neighbors;

/// Unknowns of a surface of second order.
const TERMS: usize = 6;

/// Neighbours of a point, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct WeightedNeighbors {
    /// Differences to the point, divided by the reach; the first is the point itself.
    at: Vec<[f64; 3]>,
    weights: Vec<f64>,
}

impl WeightedNeighbors {
    /// True if the heights of a point and `count` neighbours over their plane come from a curved surface:
    /// with equal weights, it leaves less than half of the sum of their squares.
    pub(super) fn is_curved(&mut self, near: &Neighbors, count: usize) -> bool {
        self.gather(near, count).is_some()
            && self
                .heights_alike()
                .is_some_and(|heights| heights.left < METHOD.relax.curved * heights.square)
    }

    /// True if the nearest neighbours of a point show no noise: they lie on a curved surface. The local
    /// spacing follows from `count` neighbours. `None` if there are too few, or if they lie in few layers.
    pub(super) fn is_clean(&mut self, near: &Neighbors, count: usize) -> Option<bool> {
        let last = near.iter().take(count).last()?;
        let (nearest, height) = (METHOD.relax.nearest, METHOD.relax.height);
        if near.len() < nearest || in_layers(near) {
            return None;
        }
        let freedom = (nearest + 1 - TERMS) as f64;
        let limit = freedom * height * height * spacing2(last.distance2, count);
        let reach = self.gather(near, nearest)?;
        let heights = self.heights_alike()?;
        Some(heights.left * (reach * reach) < limit)
    }

    /// Heights over a plane and over a curved surface, with equal weights.
    fn heights_alike(&mut self) -> Option<Heights> {
        self.weights.fill(1.0);
        let normal = self.normal()?;
        Some(self.heights(normal, &self.surface(normal)))
    }

    /// Reads the first `count` neighbours, with weights by distance. Returns the reach; `None` if all are at
    /// the position of the point itself.
    fn gather(&mut self, near: &Neighbors, count: usize) -> Option<f64> {
        let count = count.min(near.len());
        let last2 = near.get(count.wrapping_sub(1)).map_or(0, |n| n.distance2);
        if last2 == 0 {
            return None;
        }
        let reach = (METHOD.smoothing.reach2 * last2 as f64).sqrt();
        self.at.clear();
        self.at.push([0.0; 3]);
        let differences = near.iter().take(count).map(|n| n.difference);
        self.at
            .extend(differences.map(|d| d.map(|c| c as f64 / reach)));
        self.weights.clear();
        self.weights.extend(self.at.iter().map(|&a| {
            let t = 1.0 - dot(a, a);
            t * t
        }));
        Some(reach)
    }

    /// The direction of least scatter.
    fn normal(&self) -> Option<[f64; 3]> {
        let (mut total, mut sum, mut products) = (0.0, [0.0; 3], [0.0; 6]);
        for (a, w) in self.at.iter().zip(&self.weights) {
            let b = a.map(|x| w * x);
            total += w;
            (0..3).for_each(|k| sum[k] += b[k]);
            let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
            (0..6).for_each(|k| products[k] += b[pairs[k].0] * a[pairs[k].1]);
        }
        let mean = sum.map(|s| s / total);
        let crossed = [
            sum[0] * mean[0],
            sum[1] * mean[1],
            sum[2] * mean[2],
            sum[0] * mean[1],
            sum[0] * mean[2],
            sum[1] * mean[2],
        ];
        let scatter = std::array::from_fn(|k| products[k] - crossed[k]);
        least_direction(&scatter).map(unit)
    }

    /// Heights over the plane with `normal` and over a curved surface.
    fn heights(&self, normal: [f64; 3], curved: &Surface) -> Heights {
        let (mut total, mut sum, mut square, mut left) = (0.0, 0.0, 0.0, 0.0);
        for (a, w) in self.at.iter().zip(&self.weights) {
            let height = dot(*a, normal);
            let off = curved.off(*a);
            total += w;
            sum += w * height;
            square += w * height * height;
            left += w * off * off;
        }
        let mean = sum / total;
        Heights {
            square: square - sum * mean,
            left,
        }
    }

    /// The least-squares surface of second order over the plane with `normal`.
    fn surface(&self, normal: [f64; 3]) -> Surface {
        let [u, v] = frame(normal);
        let frame = [u, v, normal];
        // Normal equations; the last column is the right-hand side.
        let mut m = [[0.0; TERMS + 1]; TERMS];
        for (a, w) in self.at.iter().zip(&self.weights) {
            let row = row(&frame, *a);
            for (i, equation) in m.iter_mut().enumerate() {
                let weighted = w * row[i];
                (0..=TERMS).for_each(|j| equation[j] += weighted * row[j]);
            }
        }
        let ridge = METHOD.smoothing.ridge * m[0][0];
        (1..TERMS).for_each(|i| m[i][i] += ridge);
        // The constant term is solved first. No pivot is smaller than the ridge.
        for pivot in (1..TERMS).rev() {
            let from = m[pivot];
            for equation in &mut m[..pivot] {
                let factor = equation[pivot] / from[pivot];
                (0..=TERMS).for_each(|j| equation[j] -= factor * from[j]);
            }
        }
        let mut terms = [0.0; TERMS];
        for i in 0..TERMS {
            let known: f64 = (0..i).map(|j| m[i][j] * terms[j]).sum();
            terms[i] = (m[i][TERMS] - known) / m[i][i];
        }
        Surface { frame, terms }
    }
}

/// True if the nearest neighbours and the point lie in few layers across an axis.
fn in_layers(near: &Neighbors) -> bool {
    (0..3).any(|axis| {
        let nearest = near.iter().take(METHOD.relax.nearest);
        let mut along = vec![0];
        along.extend(nearest.map(|n| n.difference[axis]));
        along.sort_unstable();
        let different = 1 + along.windows(2).filter(|pair| pair[0] != pair[1]).count();
        different < METHOD.relax.different
    })
}

/// Weighted heights over the least-squares plane.
struct Heights {
    /// Sum of the squared deviations from the mean.
    square: f64,
    /// Sum of the squared heights over a curved surface.
    left: f64,
}

/// The terms of second order at a position, and its height.
fn row(frame: &[[f64; 3]; 3], a: [f64; 3]) -> [f64; TERMS + 1] {
    let [x, y, height] = frame.map(|axis| dot(a, axis));
    let (xx, yy) = (x * x, y * y);
    [1.0, x, y, xx + yy, xx - yy, 2.0 * x * y, height]
}

/// A surface of second order.
#[derive(Debug, Clone, Copy)]
struct Surface {
    /// Two directions in the plane, and the normal.
    frame: [[f64; 3]; 3],
    terms: [f64; TERMS],
}

impl Surface {
    /// Height of a position above the surface.
    fn off(&self, a: [f64; 3]) -> f64 {
        let row = row(&self.frame, a);
        let on: f64 = (0..TERMS).map(|i| self.terms[i] * row[i]).sum();
        row[TERMS] - on
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
