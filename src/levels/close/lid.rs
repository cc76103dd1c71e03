//! A loop closed without new vertices: by the triangulation of least weight if it is short, else by ears.

use super::ears::clip;
use crate::meet::norm;
use outcrop_geom::vector::{V3, add, cross, dot, scale, sub};

/// Longest loop whose triangulation of least weight is sought: its time grows with the cube of the length. At 100 it
/// takes 10 ms.
const EXACT: usize = 100;

/// Longest loop of which the triangulation of least area is sought, if its lid crosses something: it takes 2 s.
pub(super) const TAUT: usize = 600;

/// A boundary loop, counter-clockwise as the triangles that close it see it.
#[derive(Debug, Clone, Default)]
pub(super) struct Loop {
    /// Its vertices in the mesh.
    pub vertices: Vec<u32>,
    /// Their positions from a point near by.
    pub points: Vec<V3>,
    /// The third corner of the triangle of the mesh at the edge from each vertex to the next.
    pub apexes: Vec<V3>,
    /// Pairs of vertices, by place in the loop and the lower first, that must not become an edge; sorted.
    pub forbidden: Vec<[u32; 2]>,
    /// True for vertices at which several loops meet.
    pub pinched: Vec<bool>,
    /// True if its vertices are those of a triangle of the mesh.
    pub is_triangle: bool,
}

/// Triangles that close a loop. Corners below the length of the loop are its vertices, others are new.
#[derive(Debug, Clone, Default)]
pub(super) struct Patch {
    /// Positions of the new vertices.
    pub new: Vec<V3>,
    /// The three vertices whose values each new vertex has the mean of.
    pub parents: Vec<[u32; 3]>,
    /// The triangles.
    pub triangles: Vec<[u32; 3]>,
}

impl Loop {
    /// Number of edges.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if two vertices may become the ends of a new edge.
    pub fn allows(&self, a: u32, b: u32) -> bool {
        let pair = [a.min(b), a.max(b)];
        let pinched = |v: u32| self.pinched[v as usize];
        self.forbidden.binary_search(&pair).is_err() && !(pinched(a) && pinched(b))
    }

    /// Half of it is the area that the loop encloses, seen from where that is largest.
    pub fn vector_area(&self) -> V3 {
        let n = self.len();
        let each = (0..n).map(|k| cross(self.points[k], self.points[(k + 1) % n]));
        each.fold([0.0; 3], add)
    }

    /// The mean, weighted by the lengths of edges, of the cosine between the triangles of the mesh along the loop and
    /// the plane of the loop: 1 where the surface runs on into it, -1 for the outline of a plane.
    pub fn runs_on(&self) -> f64 {
        let (n, area) = (self.len(), self.vector_area());
        let (mut sum, mut lengths) = (0.0, 0.0);
        for k in 0..n {
            let (a, b) = (self.points[k], self.points[(k + 1) % n]);
            // The triangle of the mesh has the edge the other way round.
            let normal = cross(sub(a, b), sub(self.apexes[k], b));
            let (size, length) = (norm(normal), norm(sub(b, a)));
            if size > 0.0 {
                sum += dot(normal, area) * length / size;
                lengths += length;
            }
        }
        let all = lengths * norm(area);
        if all > 0.0 { sum / all } else { 0.0 }
    }
}

/// The triangles between the vertices of a loop whose area is least; none of a loop that is too long, or if the mesh
/// has edges where they would be.
pub(super) fn taut(around: &Loop) -> Option<Patch> {
    if around.len() > TAUT || around.is_triangle {
        return None;
    }
    let triangles = least(around, false)?;
    Some(Patch {
        triangles,
        ..Patch::default()
    })
}

/// Closes a loop without new vertices; only where no edge is left that the mesh allows, around one new vertex.
pub(super) fn lid(around: &Loop) -> Patch {
    let n = around.len();
    if around.is_triangle {
        return with_fan(around, Vec::new(), &[0, 1, 2]);
    }
    if n <= EXACT
        && let Some(triangles) = least(around, true)
    {
        return Patch {
            triangles,
            ..Patch::default()
        };
    }
    let plane = Axes::of(around.vector_area());
    let flat: Vec<[f64; 2]> = around.points.iter().map(|p| plane.flat(*p)).collect();
    let clipped = clip(&flat, &around.points, |a, b| around.allows(a, b));
    with_fan(around, clipped.triangles, &clipped.left)
}

/// Triangles, and a fan around a new vertex for the loop that is `left`.
pub(super) fn with_fan(around: &Loop, mut triangles: Vec<[u32; 3]>, left: &[u32]) -> Patch {
    let mut patch = Patch::default();
    if left.len() >= 3 {
        let middle = around.len() as u32;
        let sum = left
            .iter()
            .map(|v| around.points[*v as usize])
            .fold([0.0; 3], add);
        patch.new.push(scale(sum, 1.0 / left.len() as f64));
        patch
            .parents
            .push([left[0], left[left.len() / 3], left[2 * left.len() / 3]]);
        let next = left.iter().cycle().skip(1);
        triangles.extend(left.iter().zip(next).map(|(a, b)| [*a, *b, middle]));
    }
    patch.triangles = triangles;
    patch
}

/// Two axes of a plane.
pub(super) struct Axes([V3; 2]);

impl Axes {
    /// Of the plane with this normal, of any length.
    pub fn of(normal: V3) -> Self {
        let least = (0..3).fold(0, |best, k| {
            if normal[k].abs() < normal[best].abs() {
                k
            } else {
                best
            }
        });
        let mut away = [0.0; 3];
        away[least] = 1.0;
        let unit = |v: V3, or: V3| {
            let length = norm(v);
            if length > 0.0 {
                scale(v, 1.0 / length)
            } else {
                or
            }
        };
        let u = unit(cross(away, normal), [1.0, 0.0, 0.0]);
        let v = unit(cross(normal, u), [0.0, 1.0, 0.0]);
        Self([u, v])
    }

    /// The position in the plane.
    pub fn flat(&self, p: V3) -> [f64; 2] {
        [dot(self.0[0], p), dot(self.0[1], p)]
    }
}

/// The weight of a triangulation: the sharpest fold between neighbours, as 1 - cosine, then the area.
type Weight = (f64, f64);

fn less(a: Weight, b: Weight) -> bool {
    a.0 < b.0 || a.0 == b.0 && a.1 < b.1
}

/// The triangulation of least weight (Liepa 2003): the sharpest fold is as blunt as it can be, unless folds do not
/// count, then the area is least.
fn least(around: &Loop, folds: bool) -> Option<Vec<[u32; 3]>> {
    let n = around.len();
    let p = &around.points;
    let unit = |a: V3, b: V3, c: V3| {
        let normal = cross(sub(b, a), sub(c, a));
        let length = norm(normal);
        (length > 0.0).then(|| (scale(normal, 1.0 / length), length / 2.0))
    };
    let edge: Vec<Option<V3>> = (0..n)
        .map(|k| unit(p[(k + 1) % n], p[k], around.apexes[k]).map(|(normal, _)| normal))
        .collect();
    // For the part of the loop from i to k: its weight, the vertex of its triangle at the edge of both, its normal.
    let mut best: Vec<Option<(Weight, u32, V3)>> = vec![None; n * n];
    for length in 2..n {
        for i in 0..n - length {
            let k = i + length;
            let closes = length == n - 1;
            if !closes && !around.allows(i as u32, k as u32) {
                continue;
            }
            let mut found: Option<(Weight, u32, V3)> = None;
            for m in i + 1..k {
                let Some((normal, area)) = unit(p[i], p[m], p[k]) else {
                    continue;
                };
                let mut weight = (0.0f64, area);
                let mut side = |a: usize, b: usize| {
                    let other = if b - a == 1 {
                        edge[a]
                    } else {
                        let Some((part, _, normal)) = best[a * n + b] else {
                            return false;
                        };
                        weight = (weight.0.max(part.0), weight.1 + part.1);
                        Some(normal)
                    };
                    let fold = other.map_or(1.0, |other| 1.0 - dot(normal, other));
                    let fold = if folds { fold } else { 0.0 };
                    weight.0 = weight.0.max(fold);
                    true
                };
                if !side(i, m) || !side(m, k) {
                    continue;
                }
                if closes && folds {
                    let fold = edge[n - 1].map_or(1.0, |other| 1.0 - dot(normal, other));
                    weight.0 = weight.0.max(fold);
                }
                if found.is_none_or(|(least, ..)| less(weight, least)) {
                    found = Some((weight, m as u32, normal));
                }
            }
            best[i * n + k] = found;
        }
    }
    best[n - 1]?;
    let mut triangles = Vec::with_capacity(n - 2);
    let mut parts = vec![[0, n - 1]];
    while let Some([i, k]) = parts.pop() {
        if k - i < 2 {
            continue;
        }
        let (_, m, _) = best[i * n + k]?;
        triangles.push([i as u32, m, k as u32]);
        parts.extend([[i, m as usize], [m as usize, k]]);
    }
    Some(triangles)
}
