//! Weighted sums over the positions around a point, and over their coordinates in a turned frame.
//!
//! A sum has eight parts: position `j` adds to part `j mod 8`. The parts are added in a fixed order. So every
//! level gives the same bits. The sums of several points stand side by side, one point in each lane, for
//! arithmetic on all of them at once.

use super::corners::LANES;
use super::eight::Eight;
use super::kernel;
use super::numbers::Numbers;
use super::pick::first_bits;

/// Positions of one group.
const GROUP: usize = 8;

/// `N` sums of each of several points.
pub type LaneSums<const N: usize> = [[f64; LANES]; N];

/// Sums of weights `w` times 1, x, y, z, xx, yy, zz, xy, xz, yz.
pub type SpreadSums = LaneSums<10>;

/// Sums of weights `w` times 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv, then times
/// h, hu, hv, huu, huv, hvv, hh; and the sum of `w²`.
pub type SurfaceSums = LaneSums<23>;

/// Positions around a point at the origin, in columns of groups; after the last one, zeros without weight.
#[derive(Debug, Clone, Default)]
pub struct Weighted {
    /// x, y, z; later u, v, h.
    at: [Vec<[f64; GROUP]>; 3],
    /// The weight by distance, 1 − (x² + y² + z²).
    near: Vec<[f64; GROUP]>,
    /// The same, or 0 for positions that [`drop_beyond`] took out.
    kept: Vec<[f64; GROUP]>,
}

impl Weighted {
    /// Removes all positions and makes room for `count`.
    fn reset(&mut self, count: usize) {
        let groups = count.div_ceil(GROUP);
        for column in self.at.iter_mut().chain([&mut self.near, &mut self.kept]) {
            column.resize(groups, [0.0; GROUP]);
        }
    }
}

/// Adds the eight parts of each sum and writes the totals to a lane. (A function passed to `map` would not be
/// compiled for the level.)
#[inline(always)]
fn put_totals<F: Eight, const N: usize>(
    first: [F::Part; N],
    last: [F::Part; N],
    to: &mut LaneSums<N>,
    lane: usize,
) {
    for ((to, first), last) in to.iter_mut().zip(first).zip(last) {
        to[lane] = F::of_parts(first, last).total();
    }
}

#[inline(always)]
fn splat<F: Numbers, const N: usize>(from: &[f64; N]) -> [F; N] {
    let mut to = [F::splat(0.0); N];
    for (to, x) in to.iter_mut().zip(from) {
        *to = F::splat(*x);
    }
    to
}

kernel! {
    /// Takes `count` positions from columns of whole groups, multiplied by `scale`, with weights by distance,
    /// and writes the sums over them to a lane.
    pub fn take_weighted(
        all: &mut Weighted,
        columns: [&[i32]; 3],
        count: usize,
        scale: f64,
        sums: &mut SpreadSums,
        lane: usize,
    ) -> () = take_body<Eight>
}

#[inline(always)]
fn take_body<F: Eight>(
    all: &mut Weighted,
    columns: [&[i32]; 3],
    count: usize,
    scale: f64,
    sums: &mut SpreadSums,
    lane: usize,
) {
    all.reset(count);
    let [x, y, z] = columns.map(|column| column.as_chunks::<GROUP>().0);
    let [to_x, to_y, to_z] = &mut all.at;
    let to = to_x.iter_mut().zip(to_y).zip(to_z).zip(&mut all.near);
    let (scale, one, none) = (F::splat(scale), F::splat(1.0), F::splat(0.0));
    let mut left = count;
    for ((((to_x, to_y), to_z), near), ((x, y), z)) in to.zip(x.iter().zip(y).zip(z)) {
        let (x, y, z) = (F::convert(x), F::convert(y), F::convert(z));
        let (x, y, z) = (x * scale, y * scale, z * scale);
        let w = one - (x * x + y * y + z * z);
        // The weights after the last position are 0.
        let some = u64::from(first_bits(left)) & F::ALL;
        left = left.saturating_sub(GROUP);
        let [w] = F::choose(some, [w], [none]);
        x.store(to_x);
        y.store(to_y);
        z.store(to_z);
        w.store(near);
    }
    let first = spread_sums::<F>(all, 0);
    let last = if F::PARTS > 1 {
        spread_sums::<F>(all, 1)
    } else {
        first
    };
    put_totals::<F, 10>(first, last, sums, lane);
}

/// The sums with weights by distance over one part of each group.
#[inline(always)]
fn spread_sums<F: Eight>(all: &Weighted, part: usize) -> [F::Part; 10] {
    let mut s = [F::Part::splat(0.0); 10];
    let [x, y, z] = &all.at;
    for (((x, y), z), w) in x.iter().zip(y).zip(z).zip(&all.near) {
        let (x, y) = (F::load_part(x, part), F::load_part(y, part));
        let (z, w) = (F::load_part(z, part), F::load_part(w, part));
        let [wx, wy, wz] = [w * x, w * y, w * z];
        let terms = [
            w,
            wx,
            wy,
            wz,
            wx * x,
            wy * y,
            wz * z,
            wx * y,
            wx * z,
            wy * z,
        ];
        add(&mut s, terms);
    }
    s
}

#[inline(always)]
fn add<F: Numbers, const N: usize>(sums: &mut [F; N], terms: [F; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum = *sum + term;
    }
}

/// The terms of a group of positions in the sums of a surface.
#[inline(always)]
fn surface_terms<F: Numbers>(u: F, v: F, h: F, w: F) -> [F; 23] {
    let [wu, wv, wh] = [w * u, w * v, w * h];
    let [wuu, wuv, wvv] = [wu * u, wu * v, wv * v];
    let [wuuu, wuuv, wuvv, wvvv] = [wuu * u, wuu * v, wvv * u, wvv * v];
    [
        w,
        wu,
        wv,
        wuu,
        wuv,
        wvv,
        wuuu,
        wuuv,
        wuvv,
        wvvv,
        wuuu * u,
        wuuu * v,
        wuuv * v,
        wuvv * v,
        wvvv * v,
        wh,
        wu * h,
        wv * h,
        wuu * h,
        wuv * h,
        wvv * h,
        wh * h,
        w * w,
    ]
}

kernel! {
    /// Replaces the coordinates by those in the frame of three unit vectors u, v, h, and writes the sums with
    /// weights by distance to a lane.
    pub fn turn(all: &mut Weighted, frame: &[[f64; 3]; 3], sums: &mut SurfaceSums, lane: usize) -> ()
        = turn_body<Eight>
}

#[inline(always)]
fn turn_body<F: Eight>(
    all: &mut Weighted,
    frame: &[[f64; 3]; 3],
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let [u, v, h] = frame;
    let (u, v, h) = (splat(u), splat(v), splat(h));
    let [x, y, z] = &mut all.at;
    for ((to_x, to_y), to_z) in x.iter_mut().zip(y).zip(z) {
        let (x, y, z) = (F::load(to_x), F::load(to_y), F::load(to_z));
        (x * u[0] + y * u[1] + z * u[2]).store(to_x);
        (x * v[0] + y * v[1] + z * v[2]).store(to_y);
        (x * h[0] + y * h[1] + z * h[2]).store(to_z);
    }
    put_surface_sums::<F>(&all.at, &all.near, &Same, sums, lane);
}

/// How a position's weight follows from the one in the column. (A trait, since a closure would not be compiled
/// for the level.)
trait Weigh<F> {
    fn weigh(&self, u: F, v: F, h: F, w: F) -> F;
}

/// The weight in the column.
struct Same;

impl<F> Weigh<F> for Same {
    #[inline(always)]
    fn weigh(&self, _: F, _: F, _: F, w: F) -> F {
        w
    }
}

/// Writes the sums with weights from a column to a lane.
#[inline(always)]
fn put_surface_sums<F: Eight>(
    at: &[Vec<[f64; GROUP]>; 3],
    weights: &[[f64; GROUP]],
    weigh: &impl Weigh<F::Part>,
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let first = surface_sums::<F>(at, weights, weigh, 0);
    let last = if F::PARTS > 1 {
        surface_sums::<F>(at, weights, weigh, 1)
    } else {
        first
    };
    put_totals::<F, 23>(first, last, sums, lane);
}

/// The sums over one part of each group.
#[inline(always)]
fn surface_sums<F: Eight>(
    [u, v, h]: &[Vec<[f64; GROUP]>; 3],
    weights: &[[f64; GROUP]],
    weigh: &impl Weigh<F::Part>,
    part: usize,
) -> [F::Part; 23] {
    let mut s = [F::Part::splat(0.0); 23];
    for (((u, v), h), w) in u.iter().zip(v).zip(h).zip(weights) {
        let (u, v) = (F::load_part(u, part), F::load_part(v, part));
        let (h, w) = (F::load_part(h, part), F::load_part(w, part));
        add(&mut s, surface_terms(u, v, h, weigh.weigh(u, v, h, w)));
    }
    s
}

/// The height over the surface `c[0] + c[1] u + c[2] v + c[3] uu + c[4] uv + c[5] vv`.
#[inline(always)]
fn over<F: Numbers>(c: &[F; 6], u: F, v: F, h: F) -> F {
    h - (c[0] + u * (c[1] + c[3] * u + c[4] * v) + v * (c[2] + c[5] * v))
}

kernel! {
    /// Writes the sums without those positions whose squared height over a surface is more than `limit` to a
    /// lane. If there are none, writes nothing and returns false.
    pub fn drop_beyond(
        all: &mut Weighted,
        surface: &[f64; 6],
        limit: f64,
        sums: &mut SurfaceSums,
        lane: usize,
    ) -> bool = drop_body<Eight>
}

#[inline(always)]
fn drop_body<F: Eight>(
    all: &mut Weighted,
    surface: &[f64; 6],
    limit: f64,
    sums: &mut SurfaceSums,
    lane: usize,
) -> bool {
    let (c, limit, none) = (splat(surface), F::splat(limit), F::splat(0.0));
    let [u, v, h] = &all.at;
    let mut any = 0;
    let weights = all.near.iter().zip(&mut all.kept);
    for (((u, v), h), (near, kept)) in u.iter().zip(v).zip(h).zip(weights) {
        let (u, v, h, w) = (F::load(u), F::load(v), F::load(h), F::load(near));
        let off = over(&c, u, v, h);
        let beyond = (off * off).greater(limit) & w.greater(none);
        let [w] = F::choose(beyond, [none], [w]);
        w.store(kept);
        any |= beyond;
    }
    if any != 0 {
        put_surface_sums::<F>(&all.at, &all.kept, &Same, sums, lane);
    }
    any != 0
}

kernel! {
    /// Writes the sums with the squares of the weights by distance to a lane.
    pub fn square_weights(all: &Weighted, sums: &mut SurfaceSums, lane: usize) -> () = square_body<Eight>
}

#[inline(always)]
fn square_body<F: Eight>(all: &Weighted, sums: &mut SurfaceSums, lane: usize) {
    put_surface_sums::<F>(&all.at, &all.near, &Square, sums, lane);
}

struct Square;

impl<F: Numbers> Weigh<F> for Square {
    #[inline(always)]
    fn weigh(&self, _: F, _: F, _: F, w: F) -> F {
        w * w
    }
}

kernel! {
    /// Writes the sums with the squares of the weights by distance, multiplied by the square of 1 − (squared
    /// height over a surface) / `limit`, or by 0 where that is negative, to a lane.
    pub fn fade(
        all: &Weighted,
        surface: &[f64; 6],
        limit: f64,
        sums: &mut SurfaceSums,
        lane: usize,
    ) -> () = fade_body<Eight>
}

#[inline(always)]
fn fade_body<F: Eight>(
    all: &Weighted,
    surface: &[f64; 6],
    limit: f64,
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let (surface, part) = (splat(surface), F::Part::splat(1.0 / limit));
    let fade = Fade { surface, part };
    put_surface_sums::<F>(&all.at, &all.near, &fade, sums, lane);
}

struct Fade<F> {
    surface: [F; 6],
    /// 1 / limit.
    part: F,
}

impl<F: Numbers> Weigh<F> for Fade<F> {
    #[inline(always)]
    fn weigh(&self, u: F, v: F, h: F, w: F) -> F {
        let off = over(&self.surface, u, v, h);
        let rest = (F::splat(1.0) - off * off * self.part).larger(F::splat(0.0));
        w * w * (rest * rest)
    }
}

#[cfg(test)]
mod tests;
