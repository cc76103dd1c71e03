//! An exact integer lattice in a plane.

use super::Sample;
use super::refine::rectangle;
use super::tessellate::Tessellation;
use crate::error::{Error, Result};
use crate::vec3::{Vec3, add, cross, dot, normalize, scale, sub};

/// A square grid whose nodes all have integer coordinates, so that neighbouring nodes are exactly
/// equidistant and four are exactly on a circle.
#[derive(Debug)]
pub(crate) struct Grid {
    columns: u64,
    rows: u64,
    u: [i64; 3],
    v: [i64; 3],
}

/// Orthogonal integer vectors of length 3: a frame that leaves the lattice integer.
pub(crate) const FRAME: [[i64; 3]; 3] = [[2, 1, 2], [-2, 2, 1], [-1, -2, 2]];

impl Grid {
    /// A nearly square grid with this number of nodes and a diagonal of about `size`, or more if unit steps
    /// need more.
    pub(crate) fn new(points: u64, size: f64, rotated: bool) -> Result<Self> {
        let columns = points.isqrt().max(1);
        let rows = points.div_ceil(columns).max(1);
        let (u, v, unit) = if rotated {
            (FRAME[0], FRAME[1], 3.0)
        } else {
            ([1, 0, 0], [0, 1, 0], 1.0)
        };
        let diagonal = libm::hypot((columns - 1) as f64, (rows - 1) as f64) * unit;
        let step = (size / diagonal.max(unit)).round().max(1.0);
        if step * diagonal.max(1.0) > 4e15 {
            return Err(Error::parameter(
                "size",
                size,
                "a grid with coordinates below 2^52",
            ));
        }
        let by = |w: [i64; 3]| w.map(|c| c * step as i64);
        Ok(Grid {
            columns,
            rows,
            u: by(u),
            v: by(v),
        })
    }

    /// Node number `index`, row by row.
    pub(crate) fn node(&self, index: u64) -> Sample {
        let (row, column) = ((index / self.columns) as i64, (index % self.columns) as i64);
        Sample {
            position: self.place(column, row),
            normal: self.normal(),
        }
    }

    fn place(&self, column: i64, row: i64) -> Vec3 {
        std::array::from_fn(|k| (self.u[k] * column + self.v[k] * row) as f64)
    }

    fn normal(&self) -> Vec3 {
        normalize(cross(self.u.map(|c| c as f64), self.v.map(|c| c as f64)))
    }

    /// Corners of the bounding box.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        let (c, r) = (self.columns as i64 - 1, self.rows as i64 - 1);
        let corners = [
            self.place(0, 0),
            self.place(c, 0),
            self.place(0, r),
            self.place(c, r),
        ];
        let fold = |pick: fn(f64, f64) -> f64| {
            std::array::from_fn(|k| corners.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0))
        };
        [fold(f64::min), fold(f64::max)]
    }

    /// The rectangle of the grid.
    pub(crate) fn reference(&self) -> Tessellation {
        let mut mesh = Tessellation::default();
        let [u, v] = [
            self.place(self.columns as i64 - 1, 0),
            self.place(0, self.rows as i64 - 1),
        ];
        rectangle(&mut mesh, [0.0; 3], u, v);
        mesh
    }

    /// Distance of a point from the rectangle of the grid.
    pub(crate) fn distance(&self, p: Vec3) -> f64 {
        let mut nearest = [0.0; 3];
        for (axis, count) in [(self.u, self.columns), (self.v, self.rows)] {
            let axis = axis.map(|c| c as f64);
            let steps = (dot(p, axis) / dot(axis, axis)).clamp(0.0, (count - 1) as f64);
            nearest = add(nearest, scale(axis, steps));
        }
        let off = sub(p, nearest);
        dot(off, off).sqrt()
    }
}
