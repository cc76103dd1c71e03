//! A smooth closed surface of genus 5 with bumps.

use super::refine::{orient, refine};
use super::tessellate::{Tessellation, tessellate};
use super::{Line, Sample, Surface, inside};
use crate::picker::Picker;
use crate::vec3::{Vec3, add, cross, dot, length, normalize, scale, sub};

/// Zero set of a "tangle cube": eight blobs at the corners of a cube joined along its twelve edges,
/// with a wavy term on top. A cube's edge graph has 12 - 8 + 1 = 5 loops.
///
/// Points are drawn from a fixed tessellation and moved onto the surface along the gradient. Each triangle is
/// weighted with the area of its piece of the surface, so the density is uniform to about a percent.
#[derive(Debug)]
pub(crate) struct Bumpy {
    triangles: Vec<[Vec3; 3]>,
    picker: Picker,
    /// Output units per native unit.
    unit: f64,
    bounds: [Vec3; 2],
}

/// Smaller values make the tubes thicker; the topology is the same between 6.25 and 12.5.
const LEVEL: f64 = 10.0;
const BUMP: f64 = 1.0;
const BUMP_WAVES: f64 = 4.0;
const HALF: f64 = 2.5;
/// Step of the finite differences for the curvature.
const TURN_STEP: f64 = 1e-4;
const CELLS: usize = 80;

/// Normal of the planes of the scan lines, not in any symmetry plane.
const SCAN_NORMAL: Vec3 = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];

/// The implicit function, negative inside.
fn value(p: Vec3) -> f64 {
    let bump: f64 = p.map(|c| libm::sin(BUMP_WAVES * c)).iter().product();
    p.iter().map(|c| c * c * (c * c - 5.0)).sum::<f64>() + LEVEL + BUMP * bump
}

/// The implicit function and its gradient.
fn value_and_gradient(p: Vec3) -> (f64, Vec3) {
    let waves = p.map(|c| libm::sincos(BUMP_WAVES * c));
    let mut sum = LEVEL + BUMP * waves[0].0 * waves[1].0 * waves[2].0;
    let mut gradient = [0.0; 3];
    for k in 0..3 {
        let (c, square) = (p[k], p[k] * p[k]);
        let others = waves[(k + 1) % 3].0 * waves[(k + 2) % 3].0;
        sum += square * (square - 5.0);
        gradient[k] = c * (4.0 * square - 10.0) + BUMP * BUMP_WAVES * waves[k].1 * others;
    }
    (sum, gradient)
}

/// Moves a point near the surface onto it; returns it with the gradient there.
fn project(mut p: Vec3) -> (Vec3, Vec3) {
    let (mut f, mut gradient) = value_and_gradient(p);
    for _ in 0..8 {
        if f.abs() < 1e-13 {
            break;
        }
        p = sub(p, scale(gradient, f / dot(gradient, gradient)));
        (f, gradient) = value_and_gradient(p);
    }
    (p, gradient)
}

/// Moves a point along the surface to the plane `SCAN_NORMAL . p = level`. None where the surface is parallel
/// to the plane.
fn slide(start: Vec3, level: f64, reach: f64) -> Option<(Vec3, Vec3)> {
    let mut p = start;
    for _ in 0..12 {
        let (f, gradient) = value_and_gradient(p);
        let miss = level - dot(SCAN_NORMAL, p);
        if f.abs() < 1e-12 && miss.abs() < 1e-12 {
            return Some((p, gradient));
        }
        // The shortest step that satisfies both linearised conditions.
        let (gg, gn) = (dot(gradient, gradient), dot(gradient, SCAN_NORMAL));
        let determinant = gg - gn * gn;
        if determinant < 0.05 * gg {
            return None;
        }
        let a = (-f - gn * miss) / determinant;
        let b = (gg * miss + gn * f) / determinant;
        p = add(p, add(scale(gradient, a), scale(SCAN_NORMAL, b)));
        if length(sub(p, start)) > reach {
            return None;
        }
    }
    None
}

impl Bumpy {
    pub(crate) fn new(size: f64) -> Self {
        let mesh = tessellate(value, HALF, CELLS);
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for vertex in &mesh.vertices {
            for (k, &c) in vertex.iter().enumerate() {
                bounds[0][k] = bounds[0][k].min(c);
                bounds[1][k] = bounds[1][k].max(c);
            }
        }
        let unit = size / length(sub(bounds[1], bounds[0]));
        let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
        let triangles: Vec<_> = mesh.triangles.iter().map(corners).collect();
        let picker = Picker::new(triangles.iter().map(piece_area));
        Bumpy {
            triangles,
            picker,
            unit,
            bounds: bounds.map(|b| scale(b, unit)),
        }
    }

    fn sample(&self, (place, gradient): (Vec3, Vec3)) -> Sample {
        Sample {
            position: scale(place, self.unit),
            normal: normalize(gradient),
        }
    }
}

/// Area of the surface piece over a triangle: the triangle's area divided by the cosine between the two,
/// since the projection along the gradient stretches a tilted triangle by that.
fn piece_area([a, b, c]: &[Vec3; 3]) -> f64 {
    let normal = cross(sub(*b, *a), sub(*c, *a));
    let area = length(normal) / 2.0;
    if area == 0.0 {
        return 0.0;
    }
    let (_, gradient) = value_and_gradient(scale(add(add(*a, *b), *c), 1.0 / 3.0));
    let cosine = dot(normalize(normal), normalize(gradient)).abs();
    // Slivers may be tilted strongly; their share is negligible, but must be finite.
    area / cosine.max(0.25)
}

impl Surface for Bumpy {
    fn area(&self) -> f64 {
        self.picker.total() * self.unit * self.unit
    }

    fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        let (triangle, t) = self.picker.pick(u);
        self.sample(project(inside(&self.triangles[triangle], t, v)))
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        // One entry per triangle: its points move to the nearest of the parallel planes.
        let at = spacing / self.unit;
        let line = |(patch, t)| Line {
            patch: patch as u32,
            at,
            weight: piece_area(t),
        };
        self.triangles.iter().enumerate().map(line).collect()
    }

    fn on_line(&self, line: &Line, t: f64, v: f64) -> Sample {
        let place = project(inside(&self.triangles[line.patch as usize], t, v));
        let level = (dot(SCAN_NORMAL, place.0) / line.at).round() * line.at;
        self.sample(slide(place.0, level, 3.0 * line.at).unwrap_or(place))
    }

    fn reference(&self, tolerance: f64) -> Tessellation {
        let mut coarse = tessellate(value, HALF, CELLS);
        orient(&mut coarse);
        let mut mesh = refine(coarse, tolerance / self.unit, |p| project(p).0);
        for vertex in &mut mesh.vertices {
            *vertex = scale(*vertex, self.unit);
        }
        mesh
    }

    fn curvature(&self, u: f64, v: f64) -> Option<f64> {
        let (triangle, t) = self.picker.pick(u);
        let (place, gradient) = project(inside(&self.triangles[triangle], t, v));
        let normal = normalize(gradient);
        let least = [0, 1, 2].map(|k| normal[k].abs());
        let mut other = [0.0; 3];
        other[usize::from(least[1] < least[0])] = 1.0;
        let first = normalize(cross(normal, other));
        let turn = |along: Vec3| {
            let [ahead, behind] = [TURN_STEP, -TURN_STEP]
                .map(|step| normalize(value_and_gradient(add(place, scale(along, step))).1));
            let turn = scale(sub(ahead, behind), 0.5 / TURN_STEP);
            dot(turn, turn)
        };
        Some((turn(first) + turn(cross(normal, first))).sqrt() / self.unit)
    }

    fn distance(&self, p: Vec3) -> f64 {
        // First order is good only near the surface; farther out the gradient is followed.
        let native = scale(p, 1.0 / self.unit);
        let (f, gradient) = value_and_gradient(native);
        let first_order = f.abs() / length(gradient).max(1e-9);
        if first_order < 1e-3 {
            return first_order * self.unit;
        }
        let (foot, _) = project(native);
        length(sub(foot, native)) * self.unit
    }
}

#[cfg(test)]
mod tests {
    use super::super::tessellate::topology;
    use super::*;

    #[test]
    fn genus_is_five_at_any_resolution() {
        for cells in [40, CELLS] {
            let mesh = tessellate(value, HALF, cells);
            assert_eq!(topology(&mesh), (-8, true), "{cells} cells");
        }
    }

    #[test]
    fn gradient_matches_differences() {
        let step = 1e-6;
        let p = [1.3, -0.4, 2.1];
        let (f, gradient) = value_and_gradient(p);
        assert!((f - value(p)).abs() < 1e-12);
        for k in 0..3 {
            let (mut q, mut r) = (p, p);
            q[k] += step;
            r[k] -= step;
            assert!(((value(q) - value(r)) / (2.0 * step) - gradient[k]).abs() < 1e-6);
        }
    }

    #[test]
    fn density_is_uniform() {
        // Compared with the areas of a finer tessellation, in slabs of space.
        let surface = Bumpy::new(1.0);
        let cell = |p: Vec3| {
            p.map(|c| ((c + HALF) / HALF * 2.0) as usize)
                .iter()
                .sum::<usize>()
        };
        let (mut drawn, mut expected) = ([0.0; 16], [0.0; 16]);
        let n = 400_000u64;
        let mut rng = crate::rng::Rng::at(1, crate::rng::Purpose::Position, 0);
        for _ in 0..n {
            let sample = surface.at(rng.uniform(), rng.uniform());
            drawn[cell(scale(sample.position, 1.0 / surface.unit))] += 1.0 / n as f64;
        }
        let fine = tessellate(value, HALF, 2 * CELLS);
        for triangle in &fine.triangles {
            let [a, b, c] = triangle.map(|v| fine.vertices[v as usize]);
            let area = length(cross(sub(b, a), sub(c, a)));
            expected[cell(scale(add(add(a, b), c), 1.0 / 3.0))] += area;
        }
        let total: f64 = expected.iter().sum();
        for (d, e) in drawn.iter().zip(expected.map(|e| e / total)) {
            assert!(e < 0.02 || (d / e - 1.0).abs() < 0.04, "{d} {e}");
        }
    }
}
