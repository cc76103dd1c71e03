//! Smoothing that keeps edges and does not shrink: a point moves to the plane of its neighbours, or, where a
//! plane is not enough, to a curved surface through those of them that lie on one surface with it
//! (docs/method.md, section 3.2).
//!
//! Sums run over the point and its neighbours in order of id, in eight parts, with `+ - * / sqrt` only. So
//! the bits are the same on every machine and do not depend on how the neighbours were found. Several points
//! are collected, and each step is taken for all of them.

use super::fit::{Fit, TERMS, fits};
use super::level::{frame, unit};
use crate::tiles::near::Around;
pub use outcrop_geom::kernels::eight::{Eight, loaded, stored};
use outcrop_geom::kernels::{
    LANES, Level, SpreadSums, SurfaceSums, Weighted, drop_beyond, fade, kernel, square_weights,
    take_weighted, turn,
};
use outcrop_geom::method::METHOD;
use outcrop_geom::plane::{Normal, least_directions};

/// Two directions along a plane, and its normal.
type Frame = [[f64; 3]; 3];

/// The foot of a point on the surface around it; without a surface the point itself.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foot {
    /// From the point, in steps.
    pub offset: [f64; 3],
    /// Weighted mean of the squared heights of the neighbours over the surface of second order, in steps.
    pub mean2: f64,
}

/// The feet of several points, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct Feet<T> {
    level: Level,
    count: usize,
    points: [T; LANES],
    /// Distance at which the weight is 0, in steps.
    reach: [f64; LANES],
    around: [Weighted; LANES],
    spread: SpreadSums,
    surface: SurfaceSums,
}

impl<T: Copy> Feet<T> {
    /// Adds a point. Calls `put` with points whose feet are known.
    pub fn add(&mut self, point: T, around: &Around, put: &mut impl FnMut(T, Foot)) {
        if around.last2() == 0 {
            return put(point, Foot::default());
        }
        let lane = self.count;
        let reach = (METHOD.smoothing.reach2 * around.last2() as f64).sqrt();
        let (columns, count, scale) = (around.columns(), around.count(), 1.0 / reach);
        let to = &mut self.around[lane];
        take_weighted(
            self.level,
            to,
            columns,
            count,
            scale,
            &mut self.spread,
            lane,
        );
        self.points[lane] = point;
        self.reach[lane] = reach;
        self.count += 1;
        if self.count == LANES {
            self.finish(put);
        }
    }

    /// Calls `put` with the points that are left.
    pub fn finish(&mut self, put: &mut impl FnMut(T, Foot)) {
        let frames = self.frames();
        self.turn(&frames);
        let fits = self.fits_without_strays(&frames);
        let beside = self.beside_edges(&frames);
        for lane in 0..self.count {
            let foot = frames[lane].map_or(Foot::default(), |frame| {
                let (fit, reach) = (fits.lane(lane), self.reach[lane]);
                Foot {
                    offset: offset(&frame, &fit, beside[lane], reach),
                    mean2: fit.mean2() * (reach * reach),
                }
            });
            put(self.points[lane], foot);
        }
        self.count = 0;
    }

    /// Frames along the directions of least scatter.
    fn frames(&self) -> [Option<Frame>; LANES] {
        let mut frames = [None; LANES];
        let normals = least_directions(self.level, &scatters(self.level, &self.spread));
        for (to, normal) in frames.iter_mut().zip(normals).take(self.count) {
            *to = normal.map(frame_along);
        }
        frames
    }

    fn turn(&mut self, frames: &[Option<Frame>; LANES]) {
        for (lane, (around, frame)) in self.around.iter_mut().zip(frames).enumerate() {
            if let Some(frame) = frame {
                turn(self.level, around, frame, &mut self.surface, lane);
            }
        }
    }

    /// The surfaces through all positions but those far off them.
    fn fits_without_strays(&mut self, frames: &[Option<Frame>; LANES]) -> Fit<[f64; LANES]> {
        let first = fits(self.level, &self.surface);
        let mut dropped = false;
        for (lane, around) in self.around.iter_mut().enumerate() {
            if frames[lane].is_some() {
                let fit = first.lane(lane);
                let limit = METHOD.smoothing.stray2 * fit.mean2();
                let sums = &mut self.surface;
                dropped |= drop_beyond(self.level, around, &fit.curved, limit, sums, lane);
            }
        }
        if dropped {
            fits(self.level, &self.surface)
        } else {
            first
        }
    }

    /// The surfaces of those neighbours that lie on one surface with the point, and the mean squared heights
    /// over them; points across an edge or on another layer lose their weight.
    fn beside_edges(&mut self, frames: &[Option<Frame>; LANES]) -> [([f64; TERMS], f64); LANES] {
        let Self {
            level,
            around,
            surface,
            ..
        } = self;
        let with_frame = |lane: &usize| frames[*lane].is_some();
        for lane in (0..LANES).filter(with_frame) {
            square_weights(*level, &around[lane], surface, lane);
        }
        let first = fits(*level, surface);
        for lane in (0..LANES).filter(with_frame) {
            let first = first.lane(lane);
            if first.mean2() > 0.0 {
                let limit = METHOD.smoothing.height2 * first.mean2();
                fade(*level, &around[lane], &first.curved, limit, surface, lane);
            }
        }
        let fits = fits(*level, surface);
        std::array::from_fn(|lane| {
            let fit = fits.lane(lane);
            if fit.over_plane <= METHOD.smoothing.gain * fit.over_curved {
                (fit.plane, fit.over_plane / fit.total)
            } else {
                (fit.curved, fit.mean2())
            }
        })
    }
}

kernel! {
    /// Scatters about the means, from sums.
    fn scatters(sums: &SpreadSums) -> [[f64; LANES]; 6] = scatters_body<Eight>
}

#[inline(always)]
fn scatters_body<F: Eight>(sums: &SpreadSums) -> [[f64; LANES]; 6] {
    let [total, x, y, z, xx, yy, zz, xy, xz, yz] = loaded::<F, 10>(sums);
    let [mx, my, mz] = [x / total, y / total, z / total];
    stored([
        xx - x * mx,
        yy - y * my,
        zz - z * mz,
        xy - x * my,
        xz - x * mz,
        yz - y * mz,
    ])
}

fn frame_along(normal: Normal) -> Frame {
    let normal = unit(normal);
    let [u, v] = frame(normal);
    [u, v, normal]
}

/// The offset of a point, in steps: between its foot on the plane through all neighbours and that on the
/// surface `beside` edges.
fn offset(
    frame: &Frame,
    fit: &Fit<f64>,
    (beside, mean2): ([f64; TERMS], f64),
    reach: f64,
) -> [f64; 3] {
    let share = fit.share().max(apart(mean2, fit.mean2()));
    let mut offset = [0.0; 3];
    let mut add = |part: f64, terms: &[f64; TERMS]| {
        let foot = foot(frame, terms);
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
fn foot([u, v, n]: &Frame, terms: &[f64; TERMS]) -> [f64; 3] {
    let [height, a, b, ..] = *terms;
    let along = height / (1.0 + a * a + b * b);
    std::array::from_fn(|axis| (n[axis] - a * u[axis] - b * v[axis]) * along)
}
