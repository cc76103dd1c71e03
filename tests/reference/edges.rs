//! Smoothing that preserves edges (section 3.2).

use super::cells::by_distance;
use outcrop_geom::lattice::COORDINATE_LIMIT;
use outcrop_geom::{Point, distance2, sub};
use outcrop_paper::plane::{Normal, least_direction};

type Vec3 = [f64; 3];

/// A point around the moving one, in units of the reach, with its weight.
#[derive(Clone, Copy)]
struct Weighted {
    at: Vec3,
    weight: f64,
}

/// One round for all points at once.
pub fn smooth(points: &[Point], k: usize) -> Vec<Point> {
    (0..points.len()).map(|i| moved(points, i, k)).collect()
}

fn moved(points: &[Point], i: usize, k: usize) -> Point {
    let Some((offset, _)) = offset(points, i, 2 * k) else {
        return points[i];
    };
    std::array::from_fn(|axis| {
        let to = i64::from(points[i][axis]) + offset[axis].round() as i64;
        to.clamp(0, COORDINATE_LIMIT - 1) as i32
    })
}

/// The offset from a point to the surface through it and its `count` nearest, and the weighted mean of the squared
/// heights over the surface of second order; `None` if there is no surface.
pub fn offset(points: &[Point], i: usize, count: usize) -> Option<(Vec3, f64)> {
    let mut around = by_distance(points, i);
    around.truncate(count);
    around.insert(0, i);
    offset_from(points, i, &around)
}

/// The same for the surface through the points `around`.
pub fn offset_from(points: &[Point], i: usize, around: &[usize]) -> Option<(Vec3, f64)> {
    let distances = around.iter().map(|&j| distance2(points[i], points[j]));
    let last2 = distances.max().unwrap_or(0);
    let reach = (1.1 * last2 as f64).sqrt();
    if last2 == 0 {
        return None;
    }
    let mut all = Vec::new();
    for &j in around {
        let at = sub(points[j], points[i]).map(|c| c as f64 / reach);
        let weight = 1.0 - dot(at, at);
        all.push(Weighted { at, weight });
    }
    let normal = least_scatter(&all)?;
    let first = Surface::best(&all, normal, 6);
    let limit = 9.0 * first.left / sum(&all);
    let stray = |p: &&Weighted| first.off(p.at) * first.off(p.at) > limit;
    let kept: Vec<Weighted> = all.iter().filter(|p| !stray(p)).copied().collect();
    let plane = Surface::best(&kept, normal, 3);
    let curved = Surface::best(&kept, normal, 6);
    // What three more unknowns explain, against what is left for each degree of freedom.
    let squares: f64 = kept.iter().map(|p| p.weight * p.weight).sum();
    let freedom = sum(&kept) * sum(&kept) / squares - 6.0;
    let worth = (plane.left - curved.left) / 3.0 / (curved.left / freedom);
    let share = if worth > 1.5 {
        ((worth - 1.5) / 2.5).min(1.0)
    } else {
        0.0
    };
    // How much smaller the heights are over the surface beside edges: two layers.
    let (beside, mean2) = beside_edges(all, normal);
    let ratio = mean2 / (curved.left / sum(&kept));
    let layers = if ratio < 0.35 {
        ((0.35 - ratio) / (0.35 - 0.25)).min(1.0)
    } else {
        0.0
    };
    let share = f64::max(share, layers);
    let mut offset = [0.0; 3];
    let mut add = |part: f64, surface: &Surface| {
        let foot = surface.foot();
        (0..3).for_each(|axis| offset[axis] += part * reach * foot[axis]);
    };
    if share < 1.0 {
        add(1.0 - share, &plane);
    }
    if share > 0.0 {
        add(share, &beside);
    }
    Some((offset, curved.left / sum(&kept) * reach * reach))
}

/// The surface of those points that lie on one surface with the moving one, and the mean square over it.
fn beside_edges(mut all: Vec<Weighted>, normal: Vec3) -> (Surface, f64) {
    all.iter_mut().for_each(|p| p.weight *= p.weight);
    let first = Surface::best(&all, normal, 6);
    let mean2 = first.left / sum(&all);
    if mean2 > 0.0 {
        for p in &mut all {
            let rest = (1.0 - first.off(p.at) * first.off(p.at) / (4.0 * mean2)).max(0.0);
            p.weight *= rest * rest;
        }
    }
    let plane = Surface::best(&all, normal, 3);
    let curved = Surface::best(&all, normal, 6);
    let surface = if plane.left <= 1.25 * curved.left {
        plane
    } else {
        curved
    };
    let mean2 = surface.left / sum(&all);
    (surface, mean2)
}

/// The sum of all weights.
fn sum(all: &[Weighted]) -> f64 {
    all.iter().map(|p| p.weight).sum()
}

/// The sum of the squared heights of a point and its nearest over a surface of second order, in steps, with
/// equal weights and heights along a normal; `None` if all are at one position.
pub fn heights2(points: &[Point], i: usize, nearest: &[usize], normal: Normal) -> Option<f64> {
    let last2 = distance2(points[i], points[*nearest.last()?]);
    if last2 == 0 {
        return None;
    }
    let reach = (1.1 * last2 as f64).sqrt();
    let weighted = |&j: &usize| Weighted {
        at: sub(points[j], points[i]).map(|c| c as f64 / reach),
        weight: 1.0,
    };
    let all: Vec<Weighted> = [i].iter().chain(nearest).map(weighted).collect();
    let normal = normal.map(f64::from);
    let length = dot(normal, normal).sqrt();
    let curved = Surface::best(&all, normal.map(|n| n / length), 6);
    let left = all.iter().map(|p| curved.off(p.at).powi(2));
    Some(left.sum::<f64>() * (reach * reach))
}

/// The direction of least scatter of the weighted points.
fn least_scatter(all: &[Weighted]) -> Option<Vec3> {
    let mut total = 0.0;
    let mut sum = [0.0; 3];
    let mut products = [[0.0; 3]; 3];
    for Weighted { at, weight } in all {
        total += weight;
        for a in 0..3 {
            sum[a] += weight * at[a];
            for b in a..3 {
                products[a][b] += weight * at[a] * at[b];
            }
        }
    }
    let mean = sum.map(|s| s / total);
    let scatter = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
        .map(|(a, b)| products[a][b] - sum[a] * mean[b]);
    let normal = least_direction(&scatter)?.map(f64::from);
    let length = dot(normal, normal).sqrt();
    Some(normal.map(|n| n / length))
}

/// The surface `c₀ + c₁ x + … + c₅ 2 x y` over a plane.
struct Surface {
    along: [Vec3; 2],
    normal: Vec3,
    terms: [f64; 6],
    /// The weighted sum of squared residuals and ridge.
    left: f64,
}

fn terms(x: f64, y: f64) -> [f64; 6] {
    [1.0, x, y, x * x + y * y, x * x - y * y, 2.0 * x * y]
}

impl Surface {
    /// The surface with the first `count` terms and the least weighted sum of squared residuals and ridge.
    fn best(all: &[Weighted], normal: Vec3, count: usize) -> Self {
        // Any frame gives the same result up to rounding.
        let least = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()));
        let mut axis = [0.0; 3];
        axis[least.unwrap_or(0)] = 1.0;
        let across = cross(normal, axis);
        let length = dot(across, across).sqrt();
        let u = across.map(|c| c / length);
        let along = [u, cross(normal, u)];
        let mut equations = [[0.0; 7]; 6];
        for Weighted { at, weight } in all {
            let terms = terms(dot(*at, along[0]), dot(*at, along[1]));
            for a in 0..6 {
                for b in 0..6 {
                    equations[a][b] += weight * terms[a] * terms[b];
                }
                equations[a][6] += weight * terms[a] * dot(*at, normal);
            }
        }
        let ridge = 0.001 * equations[0][0];
        for (term, equation) in equations.iter_mut().enumerate().skip(1) {
            equation[term] += ridge;
        }
        // The other terms are 0.
        for term in count..6 {
            equations.iter_mut().for_each(|e| e[term] = 0.0);
            equations[term] = [0.0; 7];
            equations[term][term] = 1.0;
        }
        let mut surface = Self {
            along,
            normal,
            terms: solve(equations),
            left: 0.0,
        };
        let bent: f64 = surface.terms[1..].iter().map(|c| c * c).sum();
        let squares = all.iter().map(|p| p.weight * surface.off(p.at).powi(2));
        surface.left = squares.sum::<f64>() + ridge * bent;
        surface
    }

    fn off(&self, a: Vec3) -> f64 {
        let terms = terms(dot(a, self.along[0]), dot(a, self.along[1]));
        let on: f64 = terms.iter().zip(self.terms).map(|(t, c)| t * c).sum();
        dot(a, self.normal) - on
    }

    /// The foot of the origin on the plane that touches the surface above it.
    fn foot(&self) -> Vec3 {
        let [height, a, b, ..] = self.terms;
        let up: Vec3 =
            std::array::from_fn(|k| self.normal[k] - a * self.along[0][k] - b * self.along[1][k]);
        up.map(|c| c * height / dot(up, up))
    }
}

/// Gaussian elimination with the largest pivot of each column.
fn solve(mut m: [[f64; 7]; 6]) -> [f64; 6] {
    for column in 0..6 {
        let largest =
            (column..6).max_by(|&a, &b| m[a][column].abs().total_cmp(&m[b][column].abs()));
        m.swap(column, largest.unwrap_or(column));
        let pivot = m[column];
        for (_, row) in m.iter_mut().enumerate().filter(|(r, _)| *r != column) {
            let factor = row[column] / pivot[column];
            for (x, p) in row.iter_mut().zip(pivot) {
                *x -= factor * p;
            }
        }
    }
    std::array::from_fn(|i| m[i][6] / m[i][i])
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
