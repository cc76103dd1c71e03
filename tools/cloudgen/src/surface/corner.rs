//! Three plates that meet at a sharp corner.

use super::refine::rectangle;
use super::tessellate::Tessellation;
use super::{Line, Sample, Surface, box_distance, midpoints};
use crate::vec3::{Vec3, sub};

/// Three orthogonal squares with a common corner, seen from between them.
#[derive(Debug)]
pub(crate) struct Corner {
    side: f64,
}

impl Corner {
    pub(crate) fn new(size: f64) -> Self {
        Corner {
            side: size / 3f64.sqrt(),
        }
    }

    /// The point of plate `axis`, which is normal to that axis.
    fn point(&self, axis: usize, s: f64, t: f64) -> Sample {
        let mut position = [-self.side / 2.0; 3];
        position[(axis + 1) % 3] += s;
        position[(axis + 2) % 3] += t;
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        Sample { position, normal }
    }
}

impl Surface for Corner {
    fn area(&self) -> f64 {
        3.0 * self.side * self.side
    }

    fn bounds(&self) -> [Vec3; 2] {
        [[-self.side / 2.0; 3], [self.side / 2.0; 3]]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        let plate = (3.0 * u).floor().min(2.0);
        self.point(plate as usize, self.side * (3.0 * u - plate), self.side * v)
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        let lines = |patch| {
            midpoints(self.side, spacing).map(move |at| Line {
                patch,
                at,
                weight: 1.0,
            })
        };
        (0..3).flat_map(lines).collect()
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        self.point(line.patch as usize, self.side * t, line.at)
    }

    fn distance(&self, p: Vec3) -> f64 {
        let [low, high] = self.bounds();
        let plate = |axis: usize| {
            let mut flat = high;
            flat[axis] = low[axis];
            box_distance([low, flat], p)
        };
        (0..3).map(plate).fold(f64::INFINITY, f64::min)
    }

    fn reference(&self, _tolerance: f64) -> Tessellation {
        let mut mesh = Tessellation::default();
        for axis in 0..3 {
            let [low, s, t] = [(0.0, 0.0), (self.side, 0.0), (0.0, self.side)]
                .map(|(s, t)| self.point(axis, s, t).position);
            rectangle(&mut mesh, low, sub(s, low), sub(t, low));
        }
        mesh
    }

    fn scanner(&self) -> Vec3 {
        [0.1, 0.2, 0.3].map(|c| c * self.side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::dot;

    #[test]
    fn plates_meet_at_right_angles() {
        let corner = Corner::new(3f64.sqrt());
        let normals = [0.1, 0.5, 0.9].map(|u| corner.at(u, 0.3).normal);
        assert_eq!(normals, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(dot(normals[0], normals[1]), 0.0);
        let apex = corner.point(0, 0.0, 0.0).position;
        assert!((1..3).all(|axis| corner.point(axis, 0.0, 0.0).position == apex));
        assert!((corner.distance([0.0; 3]) - 0.5).abs() < 1e-12);
    }
}
