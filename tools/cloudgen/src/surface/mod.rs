//! The surfaces with their exact geometry.

mod basic;
mod bumpy;
mod grid;
mod room;
mod terrain;
mod tessellate;

pub(crate) use basic::{Plane, Sphere, Torus};
pub(crate) use bumpy::Bumpy;
pub(crate) use grid::{FRAME, Grid};
pub(crate) use room::Room;
pub(crate) use terrain::Terrain;

use crate::vec3::{Vec3, length, sub};

/// A point of the cloud with the normal of the surface it was taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The position, noise included.
    pub position: [f64; 3],
    /// Outward unit normal of the surface (up for open surfaces, towards the free space in a room),
    /// or zero for an outlier.
    pub normal: [f64; 3],
}

/// One line of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Part of the surface that carries it, with a meaning private to the surface.
    pub patch: u32,
    /// Place of the line in the part.
    pub at: f64,
    /// Share of the points, in proportion to the length.
    pub weight: f64,
}

/// A surface that can be sampled uniformly. Coordinates are centred on the origin.
pub(crate) trait Surface: std::fmt::Debug + Send + Sync {
    /// Area, for the spacing of scan lines.
    fn area(&self) -> f64;

    /// Corners of the bounding box.
    fn bounds(&self) -> [Vec3; 2];

    /// Uniform in area when `u` and `v` are uniform; growing `u` sweeps over the surface.
    fn at(&self, u: f64, v: f64) -> Sample;

    /// Lines about `spacing` apart that cover the surface.
    fn scan_lines(&self, spacing: f64) -> Vec<Line>;

    /// The point at fraction `t` of a line; `v` is a spare random number.
    fn on_line(&self, line: &Line, t: f64, v: f64) -> Sample;

    /// Distance of a point to the surface, to first order where there is no closed form.
    fn distance(&self, p: Vec3) -> f64;

    /// Place of the scanner when none is given: outside, off every symmetry plane.
    fn scanner(&self) -> Vec3 {
        box_point(self.bounds(), [1.4, 1.2, 1.1])
    }
}

/// The point at the given fractions of a box.
pub(crate) fn box_point([low, high]: [Vec3; 2], fraction: Vec3) -> Vec3 {
    std::array::from_fn(|k| low[k] + fraction[k] * (high[k] - low[k]))
}

/// Distance of a point to a box, zero inside.
pub(crate) fn box_distance([low, high]: [Vec3; 2], p: Vec3) -> f64 {
    length(sub(p, std::array::from_fn(|k| p[k].clamp(low[k], high[k]))))
}

/// Midpoints of equal parts of `0..extent`, about `spacing` apart.
pub(crate) fn midpoints(extent: f64, spacing: f64) -> impl Iterator<Item = f64> {
    let count = (extent / spacing).round().max(1.0) as u64;
    let step = extent / count as f64;
    (0..count).map(move |k| (k as f64 + 0.5) * step)
}
