//! Smoothing that keeps edges and does not shrink: a point moves to the plane of its neighbours, or, where a
//! plane is not enough, to a curved surface through those of them that lie on one surface with it
//! (docs/method.md, section 3.2).
//!
//! Sums run over the point and its neighbours in order of id, in eight parts, with `+ - * / sqrt` only. So
//! the bits are the same on every machine and do not depend on how the neighbours were found.

use super::edges::frame;
use crate::geom::plane::least_direction;
use crate::kernels::{
    Level, SurfaceSums, Weighted, drop_beyond, fade, spread_sums, surface_sums, take_weighted, turn,
};
use crate::method::METHOD;
use crate::stages::tiles::near::Around;

/// Unknowns of a plane over a frame.
const PLANE: usize = 3;

/// Unknowns of a surface of second order.
const TERMS: usize = 6;

/// The foot of one point, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct Foot {
    level: Level,
    around: Weighted,
}

impl Foot {
    /// Offset of the point's new position, in steps.
    pub(super) fn offset(&mut self, around: &Around) -> [f64; 3] {
        if around.last2() == 0 {
            return [0.0; 3];
        }
        let reach = (METHOD.smoothing.reach2 * around.last2() as f64).sqrt();
        let (columns, count) = (around.columns(), around.count());
        take_weighted(self.level, &mut self.around, columns, count, 1.0 / reach);
        let Some(normal) = self.normal() else {
            return [0.0; 3];
        };
        let [u, v] = frame(normal);
        let frame = [u, v, normal];
        turn(self.level, &mut self.around, &frame);
        let mut fit = self.fit();
        let limit = METHOD.smoothing.stray2 * fit.mean2();
        if drop_beyond(self.level, &mut self.around, &fit.curved, limit) {
            fit = self.fit();
        }
        let (beside, mean2) = self.beside_edges();
        let share = fit.share().max(apart(mean2, fit.mean2()));
        let mut offset = [0.0; 3];
        let mut add = |part: f64, terms: &[f64; TERMS]| {
            let foot = foot(&frame, terms);
            (0..3).for_each(|axis| offset[axis] += part * reach * foot[axis]);
        };
        if share < 1.0 {
            add(1.0 - share, &fit.plane);
        }
        if share > 0.0 {
            add(share, &beside);
        }
        offset
    }

    /// The direction of least scatter.
    fn normal(&self) -> Option<[f64; 3]> {
        let [total, x, y, z, xx, yy, zz, xy, xz, yz] = spread_sums(self.level, &self.around);
        let [mx, my, mz] = [x / total, y / total, z / total];
        let scatter = [
            xx - x * mx,
            yy - y * my,
            zz - z * mz,
            xy - x * my,
            xz - x * mz,
            yz - y * mz,
        ];
        let [x, y, z] = least_direction(&scatter)?.map(f64::from);
        let length = (x * x + y * y + z * z).sqrt();
        Some([x / length, y / length, z / length])
    }

    fn fit(&self) -> Fit {
        Fit::of(&surface_sums(self.level, &self.around))
    }

    /// The surface of those neighbours that lie on one surface with the point, and the mean squared height over
    /// it; points across an edge or on another layer lose their weight.
    fn beside_edges(&mut self) -> ([f64; TERMS], f64) {
        self.around.square_weights();
        let first = self.fit();
        if first.mean2() > 0.0 {
            let limit = METHOD.smoothing.height2 * first.mean2();
            fade(self.level, &mut self.around, &first.curved, limit);
        }
        let fit = self.fit();
        if fit.over_plane <= METHOD.smoothing.gain * fit.over_curved {
            (fit.plane, fit.over_plane / fit.total)
        } else {
            (fit.curved, fit.mean2())
        }
    }
}

/// The share of the surface beside edges by how much smaller the mean squared height over it is: 1 if the
/// neighbours lie on several surfaces.
fn apart(beside: f64, all: f64) -> f64 {
    let [alike, apart] = [METHOD.smoothing.alike, METHOD.smoothing.apart];
    let ratio = beside / all;
    if ratio < alike {
        ((alike - ratio) / (alike - apart)).min(1.0)
    } else {
        0.0
    }
}

/// The foot of the origin on a surface, taken as the plane that touches it above the origin.
fn foot([u, v, n]: &[[f64; 3]; 3], terms: &[f64; TERMS]) -> [f64; 3] {
    let [height, a, b, ..] = *terms;
    let along = height / (1.0 + a * a + b * b);
    std::array::from_fn(|axis| (n[axis] - a * u[axis] - b * v[axis]) * along)
}

/// Least-squares surfaces of first and second order, with a ridge.
#[derive(Debug, Clone, Copy)]
struct Fit {
    /// Terms of the plane: 1, u, v; then zeros.
    plane: [f64; TERMS],
    /// Terms of the surface of second order: 1, u, v, uu, uv, vv.
    curved: [f64; TERMS],
    /// Least sum for the plane: weights times squared heights over it, and the ridge.
    over_plane: f64,
    /// The same for the surface of second order.
    over_curved: f64,
    /// Sum of the weights.
    total: f64,
    /// Sum of the squared weights.
    squares: f64,
}

impl Fit {
    fn of(sums: &SurfaceSums) -> Self {
        let [
            w,
            u,
            v,
            uu,
            uv,
            vv,
            uuu,
            uuv,
            uvv,
            vvv,
            u4,
            u3v,
            u2v2,
            uv3,
            v4,
            h,
            hu,
            hv,
            huu,
            huv,
            hvv,
            hh,
            squares,
        ] = *sums;
        let ridge = METHOD.smoothing.ridge * w;
        let half = 0.5 * ridge;
        // Normal equations; the last column is the right-hand side.
        let mut m = [
            [w, u, v, uu, uv, vv, h],
            [u, uu + ridge, uv, uuu, uuv, uvv, hu],
            [v, uv, vv + ridge, uuv, uvv, vvv, hv],
            [uu, uuu, uuv, u4 + half, u3v, u2v2, huu],
            [uv, uuv, uvv, u3v, u2v2 + 0.5 * half, uv3, huv],
            [vv, uvv, vvv, u2v2, uv3, v4 + half, hvv],
        ];
        let mut left = hh;
        let mut over_plane = hh;
        for pivot in 0..TERMS {
            if pivot == PLANE {
                over_plane = left;
            }
            let from = m[pivot];
            let part = 1.0 / from[pivot];
            left -= from[TERMS] * (from[TERMS] * part);
            for equation in &mut m[pivot + 1..] {
                let factor = equation[pivot] * part;
                (pivot + 1..=TERMS).for_each(|j| equation[j] -= factor * from[j]);
            }
        }
        Self {
            plane: solved::<PLANE>(&m),
            curved: solved::<TERMS>(&m),
            over_plane,
            over_curved: left,
            total: w,
            squares,
        }
    }

    /// Weighted mean of the squared heights over the surface of second order.
    fn mean2(&self) -> f64 {
        (self.over_curved / self.total).max(0.0)
    }

    /// The share of the surface of second order: 0 if a plane is enough, 1 if it is not.
    fn share(&self) -> f64 {
        // As many points of equal weight would tell as much.
        let points = self.total * self.total / self.squares;
        let more = self.over_plane - self.over_curved;
        let freedom = points - TERMS as f64;
        let worth = more * freedom / (self.over_curved * (TERMS - PLANE) as f64);
        let [enough, needed] = [METHOD.smoothing.enough, METHOD.smoothing.needed];
        if worth > enough {
            ((worth - enough) / (needed - enough)).min(1.0)
        } else {
            0.0
        }
    }
}

/// The first `N` unknowns of equations in triangular form, without the others.
fn solved<const N: usize>(m: &[[f64; TERMS + 1]; TERMS]) -> [f64; TERMS] {
    let mut terms = [0.0; TERMS];
    for i in (0..N).rev() {
        let mut right = m[i][TERMS];
        (i + 1..N).for_each(|j| right -= m[i][j] * terms[j]);
        terms[i] = right / m[i][i];
    }
    terms
}
