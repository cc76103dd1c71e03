//! A refined patch becomes a thin plate that runs on from its rim: the sum of the squared curvatures over its vertices
//! and those of the rim is least, where the triangles of the mesh around the rim count too. Conjugate gradients find
//! it, in double precision, one thread for a patch, so that the result is the same everywhere.

use super::lid::Loop;
use crate::meet::norm;
use outcrop_geom::vector::{V3, cross, dot, sub};

/// Least weight of an edge, as a cotangent: obtuse triangles would pull the wrong way.
const LEAST: f64 = 0.01;

/// Largest weight of an edge: triangles without area would hold everything.
const MOST: f64 = 20.0;

/// The residual that ends the search, beside that of a patch whose vertices lie at their first places.
const RESIDUAL: f64 = 1e-7;

/// The triangles of the mesh that touch the rim: corners below the length of the loop are its vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Ring {
    /// Positions of the other corners.
    pub points: Vec<V3>,
    /// The triangles; others than those of the loop are numbered after it.
    pub triangles: Vec<[u32; 3]>,
}

/// The weighted differences of each vertex from its neighbours: rows of a sparse matrix.
struct Rows {
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

/// Cotangents of the angles of a triangle, and its area.
fn cotangents(corners: [V3; 3]) -> ([f64; 3], f64) {
    let [a, b, c] = corners;
    let twice = norm(cross(sub(b, a), sub(c, a)));
    let at = |p: V3, q: V3, r: V3| {
        let cosine = dot(sub(q, p), sub(r, p));
        (cosine / twice.max(f64::MIN_POSITIVE)).clamp(LEAST, MOST)
    };
    ([at(a, b, c), at(b, c, a), at(c, a, b)], twice / 2.0)
}

impl Rows {
    /// Of the rim and the vertices inside; `points` are those of the rim, inside, and of the ring.
    fn of(points: &[V3], own: usize, triangles: &[[u32; 3]]) -> Self {
        let mut sides: Vec<(u32, u32, f64)> = Vec::with_capacity(6 * triangles.len());
        let mut areas = vec![0.0; own];
        for t in triangles {
            let (weights, area) = cotangents(t.map(|v| points[v as usize]));
            for k in 0..3 {
                if (t[k] as usize) < own {
                    areas[t[k] as usize] += area / 3.0;
                }
                let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                let weight = weights[k] / 2.0;
                sides.extend([(a, b, weight), (b, a, weight)]);
            }
        }
        sides.retain(|side| (side.0 as usize) < own);
        sides.sort_unstable_by_key(|side| (side.0, side.1));
        let mean = areas.iter().sum::<f64>() / own.max(1) as f64;
        let mut rows = Self {
            starts: vec![0],
            entries: Vec::with_capacity(sides.len()),
        };
        let mut at = 0;
        for v in 0..own as u32 {
            // Very small areas would make the vertex a nail.
            let size = 1.0 / areas[v as usize].max(0.01 * mean).sqrt();
            let end = at + sides[at..].partition_point(|side| side.0 == v);
            let mut sum = 0.0;
            for same in sides[at..end].chunk_by(|a, b| a.1 == b.1) {
                let weight: f64 = same.iter().map(|side| side.2).sum();
                rows.entries.push((same[0].1, weight * size));
                sum += weight * size;
            }
            rows.entries.push((v, -sum));
            rows.starts.push(rows.entries.len() as u32);
            at = end;
        }
        rows
    }

    fn row(&self, v: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// The gradient of half the sum of squares: the transposed rows times the rows times `x`.
    fn gradient(&self, x: &[V3], out: &mut [V3]) {
        out.fill([0.0; 3]);
        for v in 0..self.starts.len() - 1 {
            let mut sum = [0.0; 3];
            for (to, weight) in self.row(v) {
                let p = x[*to as usize];
                for k in 0..3 {
                    sum[k] += weight * p[k];
                }
            }
            for (to, weight) in self.row(v) {
                let p = &mut out[*to as usize];
                for k in 0..3 {
                    p[k] += weight * sum[k];
                }
            }
        }
    }

    /// The diagonal of that product.
    fn diagonal(&self, count: usize) -> Vec<f64> {
        let mut diagonal = vec![0.0; count];
        for (to, weight) in &self.entries {
            diagonal[*to as usize] += weight * weight;
        }
        diagonal
    }
}

/// Moves the vertices inside of a patch; `points` begin with the rim.
pub(super) fn fair(
    around: &Loop,
    ring: &Ring,
    points: &mut [V3],
    triangles: &[[u32; 3]],
    rounds: usize,
) {
    let (rim, own) = (around.len(), points.len());
    if own == rim {
        return;
    }
    // The rim, the vertices inside, and the ring.
    let mut all = points.to_vec();
    all.extend_from_slice(&ring.points);
    let moved = |v: u32| match (v as usize) < rim {
        true => v,
        false => v + (own - rim) as u32,
    };
    let mut faces = triangles.to_vec();
    faces.extend(ring.triangles.iter().map(|t| t.map(moved)));
    let rows = Rows::of(&all, own, &faces);
    solve(&rows, &mut all, rim..own, rounds);
    points.copy_from_slice(&all[..own]);
}

/// Conjugate gradients, preconditioned by the diagonal, for the three coordinates together.
fn solve(rows: &Rows, x: &mut [V3], free: std::ops::Range<usize>, rounds: usize) {
    let count = x.len();
    let diagonal = rows.diagonal(count);
    let mut product = vec![[0.0; 3]; count];
    rows.gradient(x, &mut product);
    // The residual, and the direction, are zero where nothing moves.
    let mut residual = vec![[0.0; 3]; count];
    let mut direction = vec![[0.0; 3]; count];
    let mut value = [0.0; 3];
    for v in free.clone() {
        let scaled = 1.0 / diagonal[v].max(f64::MIN_POSITIVE);
        for k in 0..3 {
            residual[v][k] = -product[v][k];
            direction[v][k] = residual[v][k] * scaled;
            value[k] += residual[v][k] * direction[v][k];
        }
    }
    let end = value.map(|first| first * RESIDUAL * RESIDUAL);
    for _ in 0..rounds {
        if (0..3).all(|k| value[k] <= end[k]) {
            break;
        }
        rows.gradient(&direction, &mut product);
        let mut curve = [0.0; 3];
        for v in free.clone() {
            for k in 0..3 {
                curve[k] += direction[v][k] * product[v][k];
            }
        }
        let step = [0, 1, 2].map(|k| match curve[k] > 0.0 {
            true => value[k] / curve[k],
            false => 0.0,
        });
        let mut next = [0.0; 3];
        for v in free.clone() {
            let scaled = 1.0 / diagonal[v].max(f64::MIN_POSITIVE);
            for k in 0..3 {
                x[v][k] += step[k] * direction[v][k];
                residual[v][k] -= step[k] * product[v][k];
                next[k] += residual[v][k] * residual[v][k] * scaled;
            }
        }
        let keep = [0, 1, 2].map(|k| match value[k] > 0.0 {
            true => next[k] / value[k],
            false => 0.0,
        });
        for v in free.clone() {
            let scaled = 1.0 / diagonal[v].max(f64::MIN_POSITIVE);
            for k in 0..3 {
                direction[v][k] = residual[v][k] * scaled + keep[k] * direction[v][k];
            }
        }
        value = next;
    }
}
