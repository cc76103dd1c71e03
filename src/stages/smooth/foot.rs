//! Smoothing that keeps edges and does not shrink: a point moves to the plane of its neighbours, or, where a
//! plane is not enough, to a curved surface through those of them that lie on one surface with it
//! (docs/method.md, section 3.2).
//!
//! Sums run over the point and its neighbours in order of id, in eight parts, with `+ - * / sqrt` only. So
//! the bits are the same on every machine and do not depend on how the neighbours were found. Several points
//! are collected, and each step is taken for all of them.

use super::fit::{Fit, TERMS, fits, share_if};
use super::level::{frame, unit};
use crate::tiles::near::Around;
pub use outcrop_paper::kernels::eight::{Eight, loaded, stored};
use outcrop_paper::kernels::numbers::Numbers;
use outcrop_paper::kernels::{
    LANES, Level, SpreadSums, SurfaceSums, Weighted, drop_beyond, fade, kernel, square_weights,
    take_weighted, turn,
};
use outcrop_paper::method::METHOD;
use outcrop_paper::plane::{Normal, least_directions};

/// Two directions along a plane, and its normal, for several points.
type Frames = [[[f64; LANES]; 3]; 3];

/// A yes or a no for each of several points.
type Lanes = [bool; LANES];

/// The foot of a point on the surface around it; without a surface the point itself.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foot {
    /// From the point, in steps.
    pub offset: [f64; 3],
}

/// Receives the feet of points.
pub(super) trait Settle<T> {
    /// Receives the weighted mean of the squared heights of a point's neighbours over the surface of second order, in
    /// squared steps; true if the point is to be settled without its foot.
    fn look(&mut self, _point: &T, _mean2: f64) -> bool {
        false
    }

    /// Receives such a point and its neighbours, without ids.
    fn settle_layered(&mut self, _point: T, _around: &mut Around) {}

    /// Receives another point and its foot.
    fn settle(&mut self, point: T, foot: Foot);
}

impl<T, F: FnMut(T, Foot)> Settle<T> for F {
    fn settle(&mut self, point: T, foot: Foot) {
        self(point, foot);
    }
}

/// The feet of several points, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct Feet<T> {
    level: Level,
    count: usize,
    points: [T; LANES],
    /// Distance at which the weight is 0, in steps.
    reach: [f64; LANES],
    around: [Around; LANES],
    weighted: [Weighted; LANES],
    spread: SpreadSums,
    surface: SurfaceSums,
}

impl<T: Copy> Feet<T> {
    /// Adds a point, and swaps its neighbours for others. Passes on points whose feet are known.
    pub fn add(&mut self, point: T, around: &mut Around, to: &mut impl Settle<T>) {
        if around.last2() == 0 {
            return to.settle(point, Foot::default());
        }
        let lane = self.count;
        let reach = (METHOD.smoothing.reach2 * around.last2() as f64).sqrt();
        std::mem::swap(&mut self.around[lane], around);
        let around = &self.around[lane];
        let (columns, count, scale) = (around.columns(), around.count(), 1.0 / reach);
        take_weighted(
            self.level,
            &mut self.weighted[lane],
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
            self.finish(to);
        }
    }

    /// Passes on the points that are left.
    pub fn finish(&mut self, to: &mut impl Settle<T>) {
        if self.count == 0 {
            return;
        }
        let normals = least_directions(self.level, &scatters(self.level, &self.spread));
        let frames = frames(self.level, &normals);
        // Of the points that have a normal.
        let mut lanes: Lanes =
            std::array::from_fn(|lane| lane < self.count && normals[lane].is_some());
        self.turn(&frames, &lanes);
        let fit = self.fits_without_strays(&lanes);
        let mut layered = [false; LANES];
        for (lane, layered) in layered.iter_mut().enumerate() {
            let mean2 = fit.mean2(lane) * (self.reach[lane] * self.reach[lane]);
            *layered = lanes[lane] && to.look(&self.points[lane], mean2);
            lanes[lane] &= !*layered;
        }
        let beside = self.beside_edges(&lanes);
        let offsets = offsets(self.level, &frames, &fit, &beside, &self.reach);
        for lane in 0..self.count {
            let (point, around) = (self.points[lane], &mut self.around[lane]);
            if layered[lane] {
                to.settle_layered(point, around);
            } else if lanes[lane] {
                let offset = offsets.map(|axis| axis[lane]);
                to.settle(point, Foot { offset });
            } else {
                to.settle(point, Foot::default());
            }
        }
        self.count = 0;
    }

    fn turn(&mut self, frames: &Frames, lanes: &Lanes) {
        for (lane, around) in some(&mut self.weighted, lanes) {
            let frame = frames.map(|axis| axis.map(|c| c[lane]));
            turn(self.level, around, &frame, &mut self.surface, lane);
        }
    }

    /// The surfaces through all positions but those far off them.
    fn fits_without_strays(&mut self, lanes: &Lanes) -> Fit<[f64; LANES]> {
        let first = fits(self.level, &self.surface);
        let mut dropped = false;
        for (lane, around) in some(&mut self.weighted, lanes) {
            let limit = METHOD.smoothing.stray2 * first.mean2(lane);
            let (curved, sums) = (first.curved(lane), &mut self.surface);
            dropped |= drop_beyond(self.level, around, &curved, limit, sums, lane);
        }
        if dropped {
            fits(self.level, &self.surface)
        } else {
            first
        }
    }

    /// The surfaces of those neighbours that lie on one surface with the point; points across an edge or on
    /// another layer lose their weight.
    fn beside_edges(&mut self, lanes: &Lanes) -> Fit<[f64; LANES]> {
        let (level, sums) = (self.level, &mut self.surface);
        for (lane, around) in some(&mut self.weighted, lanes) {
            square_weights(level, around, sums, lane);
        }
        let first = fits(level, sums);
        for (lane, around) in some(&mut self.weighted, lanes) {
            let mean2 = first.mean2(lane);
            if mean2 > 0.0 {
                let limit = METHOD.smoothing.height2 * mean2;
                fade(level, around, &first.curved(lane), limit, sums, lane);
            }
        }
        fits(level, sums)
    }
}

/// Those lanes, with their numbers, of which this is said.
fn some<'a, T>(all: &'a mut [T; LANES], lanes: &Lanes) -> impl Iterator<Item = (usize, &'a mut T)> {
    let all = all.iter_mut().enumerate();
    all.zip(lanes)
        .filter_map(|(lane, some)| some.then_some(lane))
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

kernel! {
    /// Frames along normals; without a normal any frame.
    fn frames(normals: &[Option<Normal>; LANES]) -> Frames = frames_body<Eight>
}

#[inline(always)]
fn frames_body<F: Eight>(normals: &[Option<Normal>; LANES]) -> Frames {
    let mut columns = [[0.0; LANES], [0.0; LANES], [1.0; LANES]];
    for (lane, normal) in normals.iter().enumerate() {
        if let Some(normal) = normal {
            for (column, c) in columns.iter_mut().zip(normal) {
                column[lane] = f64::from(*c);
            }
        }
    }
    let n = unit(loaded::<F, 3>(&columns));
    let [u, v] = frame(n);
    [stored(u), stored(v), stored(n)]
}

kernel! {
    /// The offsets of points, in steps: between their feet on the planes through all neighbours and those on the
    /// surfaces `beside` edges.
    fn offsets(
        frames: &Frames,
        fit: &Fit<[f64; LANES]>,
        beside: &Fit<[f64; LANES]>,
        reach: &[f64; LANES],
    ) -> [[f64; LANES]; 3] = offsets_body<Eight>
}

#[inline(always)]
fn offsets_body<F: Eight>(
    [u, v, n]: &Frames,
    fit: &Fit<[f64; LANES]>,
    beside: &Fit<[f64; LANES]>,
    reach: &[f64; LANES],
) -> [[f64; LANES]; 3] {
    let (fit, beside, reach) = (fit.loaded::<F>(), beside.loaded::<F>(), F::load(reach));
    let frame = [loaded::<F, 3>(u), loaded::<F, 3>(v), loaded::<F, 3>(n)];
    let (none, one) = (F::splat(0.0), F::splat(1.0));
    // The plane counts if the curved surface is hardly better.
    let most = F::splat(METHOD.smoothing.gain) * beside.over_curved;
    let flat = not_greater(beside.over_plane, most);
    let [over] = F::choose(
        flat,
        [beside.over_plane / beside.total],
        [beside.mean2_body()],
    );
    let terms = F::choose(flat, beside.plane, beside.curved);
    let (all, apart) = (fit.share_body(), apart(over, fit.mean2_body()));
    let share = all.larger(apart);
    let (by_plane, on_plane) = ((one - share) * reach, foot(&frame, &fit.plane));
    let (by_curve, on_curve) = (share * reach, foot(&frame, &terms));
    let (planes, curves) = (one.greater(share), share.greater(none));
    let mut offset = [none; 3];
    for ((offset, on_plane), on_curve) in offset.iter_mut().zip(on_plane).zip(on_curve) {
        // A foot without a share may be no number.
        let [plane] = F::choose(planes, [none + by_plane * on_plane], [none]);
        let [sum] = F::choose(curves, [plane + by_curve * on_curve], [plane]);
        *offset = sum;
    }
    stored(offset)
}

/// Bits of the numbers that are at most those of `other`; none where one of the two is NaN.
#[inline(always)]
fn not_greater<F: Numbers>(number: F, other: F) -> u64 {
    let below = F::splat(-1.0);
    let are_numbers = number.abs().greater(below) & other.abs().greater(below);
    are_numbers & !number.greater(other)
}

/// The share of the surface beside edges by how much smaller the mean squared height over it is: 1 if the
/// neighbours lie on several surfaces.
#[inline(always)]
fn apart<F: Numbers>(beside: F, all: F) -> F {
    let [alike, apart] = [METHOD.smoothing.alike, METHOD.smoothing.apart];
    let ratio = beside / all;
    let part = (F::splat(alike) - ratio) / F::splat(alike - apart);
    share_if(F::splat(alike).greater(ratio), part)
}

/// The foot of the origin on a surface, taken as the plane that touches it above the origin.
#[inline(always)]
fn foot<F: Numbers>([u, v, n]: &[[F; 3]; 3], terms: &[F; TERMS]) -> [F; 3] {
    let [height, a, b, ..] = *terms;
    let along = height / (F::splat(1.0) + a * a + b * b);
    let mut foot = *n;
    for ((foot, u), v) in foot.iter_mut().zip(u).zip(v) {
        *foot = (*foot - a * *u - b * *v) * along;
    }
    foot
}
