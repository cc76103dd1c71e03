//! The surfaces with their exact geometry.

mod basic;
mod bumpy;
mod corner;
mod grid;
mod mesh;
mod refine;
mod room;
mod terrain;
mod tessellate;

pub(crate) use basic::{Plane, Sphere, Torus};
pub(crate) use bumpy::Bumpy;
pub(crate) use corner::Corner;
use grid::FRAME;
pub(crate) use grid::Grid;
pub(crate) use mesh::{Mesh, distance2};
pub(crate) use refine::patch;
pub(crate) use room::Room;
pub(crate) use terrain::Terrain;
pub(crate) use tessellate::Tessellation;
#[cfg(test)]
pub(crate) use tessellate::topology;

use crate::vec3::{Vec3, add, dot, length, scale, sub};

/// A point of the cloud with the normal of its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The position, noise included.
    pub position: [f64; 3],
    /// Outward unit normal of the surface (up for open surfaces, towards the free space in a room), or zero
    /// if there is none: for outliers and wires.
    pub normal: [f64; 3],
}

/// One line of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Part of the surface that has the line; its meaning depends on the surface.
    pub patch: u32,
    /// Position of the line in that part.
    pub at: f64,
    /// Share of the points, in proportion to the length.
    pub weight: f64,
}

/// A surface that is sampled uniformly. Coordinates are centred on the origin.
pub(crate) trait Surface: std::fmt::Debug + Send + Sync {
    /// Area, for the spacing of scan lines.
    fn area(&self) -> f64;

    /// Corners of the bounding box.
    fn bounds(&self) -> [Vec3; 2];

    /// Uniform in area if `u` and `v` are uniform; increasing `u` sweeps over the surface.
    fn at(&self, u: f64, v: f64) -> Sample;

    /// Lines over the whole surface, about `spacing` apart.
    fn scan_lines(&self, spacing: f64) -> Vec<Line>;

    /// The point at fraction `t` of a line; `v` is a spare random number.
    fn on_line(&self, line: &Line, t: f64, v: f64) -> Sample;

    /// The surface as a mesh within `tolerance` of it; the terrain has the same mesh for any tolerance.
    fn reference(&self, tolerance: f64) -> Tessellation;

    /// Curvature at [`at`](Self::at): the root of the sum of the squares of both principal curvatures, or a
    /// substitute. None if the density cannot follow it.
    fn curvature(&self, _u: f64, _v: f64) -> Option<f64> {
        None
    }

    /// Distance of a point to the surface, to first order where there is no closed form.
    fn distance(&self, p: Vec3) -> f64;

    /// Default position of the scanner: outside, not in any symmetry plane.
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

/// The rotation as its three unit axes.
fn frame() -> [Vec3; 3] {
    FRAME.map(|axis| axis.map(|c| c as f64 / 3.0))
}

/// A point or vector rotated by the frame.
pub(crate) fn turned(p: Vec3) -> Vec3 {
    let frame = frame();
    let [a, b, c] = [0, 1, 2].map(|k| scale(frame[k], p[k]));
    add(add(a, b), c)
}

/// The point that [`turned`] maps to `p`.
pub(crate) fn turned_back(p: Vec3) -> Vec3 {
    frame().map(|axis| dot(axis, p))
}

/// Uniform point of a triangle.
pub(crate) fn inside([a, b, c]: &[Vec3; 3], t: f64, v: f64) -> Vec3 {
    let root = t.sqrt();
    let weights = [1.0 - root, root * (1.0 - v), root * v];
    add(
        add(scale(*a, weights[0]), scale(*b, weights[1])),
        scale(*c, weights[2]),
    )
}

/// Midpoints of equal parts of `0..extent`, about `spacing` apart.
pub(crate) fn midpoints(extent: f64, spacing: f64) -> impl Iterator<Item = f64> {
    let count = (extent / spacing).round().max(1.0) as u64;
    let step = extent / count as f64;
    (0..count).map(move |k| (k as f64 + 0.5) * step)
}
