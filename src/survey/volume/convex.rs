//! Convex polygons in plan, with heights, and how they are cut.

use super::sums::{Layers, Scales};
use outcrop_geom::vector::V3;

/// Most corners: those of a triangle, and one more for each of the lines that cut it, four of a box and four of a
/// trapezoid.
const MOST: usize = 12;

/// A convex polygon in plan with the height of each corner: a part of a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Convex {
    corners: [V3; MOST],
    count: usize,
}

impl Convex {
    pub fn of(triangle: &[V3; 3]) -> Self {
        let mut corners = [[0.0; 3]; MOST];
        corners[..3].copy_from_slice(triangle);
        Self { corners, count: 3 }
    }

    pub fn corners(&self) -> &[V3] {
        &self.corners[..self.count]
    }

    /// Corners whose heights may be changed.
    pub fn corners_mut(&mut self) -> &mut [V3] {
        &mut self.corners[..self.count]
    }

    pub fn is_empty(&self) -> bool {
        self.count < 3
    }

    /// Keeps the part where `side`, a linear function of x and y, is not below 0.
    #[inline]
    pub fn keep(&mut self, side: impl Fn(V3) -> f64) {
        if self.corners().iter().any(|corner| side(*corner) < 0.0) {
            *self = self.cut(side);
        }
    }

    /// The part where `side`, a linear function of x and y, is not below 0.
    pub fn cut(&self, side: impl Fn(V3) -> f64) -> Self {
        let mut sides = [0.0; MOST];
        for (at, corner) in sides.iter_mut().zip(self.corners()) {
            *at = side(*corner);
        }
        let sides = &sides[..self.count];
        if sides.iter().all(|at| *at >= 0.0) {
            return *self;
        }
        let mut part = Self {
            corners: [[0.0; 3]; MOST],
            count: 0,
        };
        for k in 0..self.count {
            let next = (k + 1) % self.count;
            if sides[k] >= 0.0 {
                part.push(self.corners[k]);
            }
            if (sides[k] >= 0.0) != (sides[next] >= 0.0) {
                // From the outer end on, so that two triangles cut their common edge at the same place.
                let (out, inn) = if sides[k] < 0.0 { (k, next) } else { (next, k) };
                let share = sides[out] / (sides[out] - sides[inn]);
                let (a, b) = (self.corners[out], self.corners[inn]);
                part.push([0, 1, 2].map(|axis| a[axis] + share * (b[axis] - a[axis])));
            }
        }
        part
    }

    fn push(&mut self, corner: V3) {
        // Rounding may bend a side a little; more corners than lines and sides are not possible otherwise.
        if self.count < MOST {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }

    /// Triangles that make it up.
    pub fn triangles(&self) -> impl Iterator<Item = [V3; 3]> + '_ {
        let first = self.corners[0];
        let rest = self.corners().get(1..).unwrap_or_default();
        rest.windows(2).map(move |pair| [first, pair[0], pair[1]])
    }

    /// Lowest and highest x and y.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in self.corners() {
            for axis in 0..2 {
                min[axis] = min[axis].min(corner[axis]);
                max[axis] = max[axis].max(corner[axis]);
            }
        }
        [min, max]
    }

    /// Adds it to sums, times `sign`.
    pub fn add_to(&self, layers: &mut Layers, scales: &Scales, sign: f64) {
        for triangle in self.triangles() {
            let area = sign * super::sums::plan_area(&triangle);
            if area != 0.0 {
                layers.add(scales, area, triangle.map(|corner| corner[2]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sums::plan_area;
    use super::*;

    #[test]
    fn a_cut_keeps_the_area_of_both_parts() {
        let triangle = [[0.0, 0.0, 1.0], [4.0, 0.0, 2.0], [1.0, 3.0, 5.0]];
        let area = |part: &Convex| part.triangles().map(|t| plan_area(&t)).sum::<f64>();
        for (a, b, c) in [
            (1.0, 0.0, -1.0),
            (0.3, -1.0, 0.2),
            (0.0, 1.0, -1.5),
            (1.0, 1.0, 9.0),
        ] {
            let side = |p: V3| a * p[0] + b * p[1] + c;
            let whole = Convex::of(&triangle);
            let parts = [whole.cut(side), whole.cut(|p| -side(p))];
            let sum: f64 = parts.iter().map(area).sum();
            assert!((sum - 6.0).abs() < 1e-14, "{sum}");
            // Heights stay on the plane of the triangle: z = 1 + x / 4 + (y * 15 / 4) / 3.
            for corner in parts.iter().flat_map(Convex::corners) {
                let z = 1.0 + corner[0] / 4.0 + corner[1] * 1.25;
                assert!((corner[2] - z).abs() < 1e-14);
            }
        }
        assert!(Convex::of(&triangle).cut(|p| p[0] - 7.0).is_empty());
    }
}
