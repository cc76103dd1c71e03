//! A height field: smooth hills with finer roughness.

use super::refine::patch;
use super::tessellate::Tessellation;
use super::{Line, Sample, Surface, box_point, midpoints};
use crate::rng::mix;
use crate::vec3::{Vec3, normalize};

/// Height field over a square, a sum of octaves of smooth lattice noise. Points are uniform in the ground
/// plan, as those of an airborne scanner.
#[derive(Debug)]
pub(crate) struct Terrain {
    side: f64,
    low: f64,
    high: f64,
}

/// For each octave the lattice cells across the square, and the height relative to the side. The first three
/// make the hills, the others the roughness.
const OCTAVES: [(f64, f64); 8] = [
    (3.0, 0.070),
    (6.0, 0.030),
    (12.0, 0.012),
    (24.0, 0.005),
    (48.0, 0.0026),
    (96.0, 0.0013),
    (192.0, 0.0006),
    (384.0, 0.0003),
];

/// Cells per side used to find the lowest and highest point.
const SURVEY: u32 = 192;

/// Cells per side of the reference: two to three for each cell of the finest octave.
const REFERENCE: usize = 1024;

impl Terrain {
    pub(crate) fn new(size: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in 0..=SURVEY {
            for i in 0..=SURVEY {
                let place = [i, j].map(|k| f64::from(k) / f64::from(SURVEY));
                let (height, ..) = height(place[0], place[1]);
                low = low.min(height);
                high = high.max(height);
            }
        }
        let relief = high - low;
        let side = size / (2.0 + relief * relief).sqrt();
        Terrain { side, low, high }
    }

    /// The sample over the point `(x, y)` of the unit square.
    fn point(&self, x: f64, y: f64) -> Sample {
        let (height, slope_x, slope_y) = height(x, y);
        let middle = f64::midpoint(self.low, self.high);
        Sample {
            position: [x - 0.5, y - 0.5, height - middle].map(|c| c * self.side),
            normal: normalize([-slope_x, -slope_y, 1.0]),
        }
    }
}

/// Value at a lattice node, in `-1..1`, independent of the seed of the cloud.
fn node(octave: usize, x: i64, y: i64) -> f64 {
    let key = (octave as u64) << 60 ^ ((x as u64) & 0x3fff_ffff) << 30 ^ ((y as u64) & 0x3fff_ffff);
    (mix(key.wrapping_mul(0x2545_f491_4f6c_dd1d)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Quintic blend of `0..1` with zero first and second derivative at the ends, and its derivative.
fn blend(t: f64) -> (f64, f64) {
    (
        t * t * t * (t * (6.0 * t - 15.0) + 10.0),
        30.0 * t * t * (t - 1.0) * (t - 1.0),
    )
}

/// Height and both slopes over the unit square.
fn height(x: f64, y: f64) -> (f64, f64, f64) {
    let (mut sum, mut slope_x, mut slope_y) = (0.0, 0.0, 0.0);
    for (octave, (cells, amplitude)) in OCTAVES.into_iter().enumerate() {
        // Shifted, so that the nodes of the octaves do not coincide.
        let (px, py) = (
            x * cells + 0.37 * octave as f64,
            y * cells + 0.73 * octave as f64,
        );
        let (ix, iy) = (px.floor(), py.floor());
        let ((bx, dx), (by, dy)) = (blend(px - ix), blend(py - iy));
        let (ix, iy) = (ix as i64, iy as i64);
        let (a, b) = (node(octave, ix, iy), node(octave, ix + 1, iy));
        let (c, d) = (node(octave, ix, iy + 1), node(octave, ix + 1, iy + 1));
        let twist = a - b - c + d;
        sum += amplitude * (a + bx * (b - a) + by * (c - a) + bx * by * twist);
        slope_x += amplitude * cells * dx * (b - a + by * twist);
        slope_y += amplitude * cells * dy * (c - a + bx * twist);
    }
    (sum, slope_x, slope_y)
}

impl Surface for Terrain {
    fn area(&self) -> f64 {
        // The area of the ground plan, over which points are distributed.
        self.side * self.side
    }

    fn bounds(&self) -> [Vec3; 2] {
        let half = self.side / 2.0;
        let up = self.side * (self.high - self.low) / 2.0;
        [[-half, -half, -up], [half, half, up]]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        self.point(u, v)
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        midpoints(1.0, spacing / self.side)
            .map(|at| Line {
                patch: 0,
                at,
                weight: 1.0,
            })
            .collect()
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        self.point(t, line.at)
    }

    fn distance(&self, p: Vec3) -> f64 {
        // Beyond the border the height field continues, so the position is clamped to the square first.
        let half = self.side / 2.0;
        let (x, y) = (p[0].clamp(-half, half), p[1].clamp(-half, half));
        let ground = self.point(x / self.side + 0.5, y / self.side + 0.5);
        let above = (p[2] - ground.position[2]) * ground.normal[2];
        (above * above + (p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y)).sqrt()
    }

    fn reference(&self, _tolerance: f64) -> Tessellation {
        patch([REFERENCE; 2], [false; 2], |u, v| self.point(u, v).position)
    }

    fn scanner(&self) -> Vec3 {
        box_point(self.bounds(), [0.45, 0.55, 1.2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_match_differences() {
        let step = 1e-7;
        for k in 0..500 {
            let (x, y) = (0.0019 * f64::from(k), (0.618 * f64::from(k)).fract());
            let (_, slope_x, slope_y) = height(x, y);
            let by_x = (height(x + step, y).0 - height(x - step, y).0) / (2.0 * step);
            let by_y = (height(x, y + step).0 - height(x, y - step).0) / (2.0 * step);
            assert!((slope_x - by_x).abs() < 1e-4, "{slope_x} {by_x}");
            assert!((slope_y - by_y).abs() < 1e-4, "{slope_y} {by_y}");
        }
    }
}
