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
    /// The weights of [`drop_beyond`] or [`fade`].
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
    for (to, total) in to.iter_mut().zip(F::totals(first, last)) {
        to[lane] = total;
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

/// Adds a group of positions to the sums of weights, of first-order terms and of terms with heights.
/// Each product is added as soon as it is known, so that few of them are in registers at a time beside the sums.
#[inline(always)]
fn add_height_terms<F: Numbers>(s: &mut [F; 23], [u, v, h]: [F; 3], w: F) {
    s[0] = s[0] + w;
    s[22] = s[22] + w * w;
    let wh = w * h;
    s[15] = s[15] + wh;
    s[21] = s[21] + wh * h;
    let wu = w * u;
    s[1] = s[1] + wu;
    s[16] = s[16] + wu * h;
    s[18] = s[18] + wu * u * h;
    s[19] = s[19] + wu * v * h;
    let wv = w * v;
    s[2] = s[2] + wv;
    s[17] = s[17] + wv * h;
    s[20] = s[20] + wv * v * h;
}

/// Adds a group of positions to the other sums: terms of second to fourth order along the plane.
#[inline(always)]
fn add_plane_terms<F: Numbers>(s: &mut [F; 23], [u, v]: [F; 2], w: F) {
    let wu = w * u;
    let wuu = wu * u;
    s[3] = s[3] + wuu;
    let wuuu = wuu * u;
    s[6] = s[6] + wuuu;
    s[10] = s[10] + wuuu * u;
    s[11] = s[11] + wuuu * v;
    let wuuv = wuu * v;
    s[7] = s[7] + wuuv;
    s[12] = s[12] + wuuv * v;
    s[4] = s[4] + wu * v;
    let wvv = w * v * v;
    s[5] = s[5] + wvv;
    let wuvv = wvv * u;
    s[8] = s[8] + wuvv;
    s[13] = s[13] + wuvv * v;
    let wvvv = wvv * v;
    s[9] = s[9] + wvvv;
    s[14] = s[14] + wvvv * v;
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
    put_surface_sums::<F, false>(&all.at, &all.near, sums, lane);
}

/// Writes the sums with weights from a column, or with their squares, to a lane.
#[inline(always)]
fn put_surface_sums<F: Eight, const SQUARES: bool>(
    at: &[Vec<[f64; GROUP]>; 3],
    weights: &[[f64; GROUP]],
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let first = surface_sums::<F, SQUARES>(at, weights, 0);
    let last = if F::PARTS > 1 {
        surface_sums::<F, SQUARES>(at, weights, 1)
    } else {
        first
    };
    put_totals::<F, 23>(first, last, sums, lane);
}

/// One part of the weights of a group, or their squares.
#[inline(always)]
fn weight<F: Eight, const SQUARES: bool>(weights: &[f64; GROUP], part: usize) -> F::Part {
    let w = F::load_part(weights, part);
    if SQUARES { w * w } else { w }
}

/// The sums over one part of each group.
#[inline(always)]
fn surface_sums<F: Eight, const SQUARES: bool>(
    [u, v, h]: &[Vec<[f64; GROUP]>; 3],
    weights: &[[f64; GROUP]],
    part: usize,
) -> [F::Part; 23] {
    let mut s = [F::Part::splat(0.0); 23];
    for (((u, v), h), w) in u.iter().zip(v).zip(h).zip(weights) {
        let (u, v) = (F::load_part(u, part), F::load_part(v, part));
        let (h, w) = (F::load_part(h, part), weight::<F, SQUARES>(w, part));
        add_height_terms(&mut s, [u, v, h], w);
        if F::PARTS == 1 {
            add_plane_terms(&mut s, [u, v], w);
        }
    }
    // Few registers do not hold all sums at once.
    if F::PARTS > 1 {
        for ((u, v), w) in u.iter().zip(v).zip(weights) {
            let (u, v) = (F::load_part(u, part), F::load_part(v, part));
            add_plane_terms(&mut s, [u, v], weight::<F, SQUARES>(w, part));
        }
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
        put_surface_sums::<F, false>(&all.at, &all.kept, sums, lane);
    }
    any != 0
}

kernel! {
    /// Writes the sums with the squares of the weights by distance to a lane.
    pub fn square_weights(all: &Weighted, sums: &mut SurfaceSums, lane: usize) -> () = square_body<Eight>
}

#[inline(always)]
fn square_body<F: Eight>(all: &Weighted, sums: &mut SurfaceSums, lane: usize) {
    put_surface_sums::<F, true>(&all.at, &all.near, sums, lane);
}

kernel! {
    /// Writes the sums with the squares of the weights by distance, multiplied by the square of 1 − (squared
    /// height over a surface) / `limit`, or by 0 where that is negative, to a lane.
    pub fn fade(
        all: &mut Weighted,
        surface: &[f64; 6],
        limit: f64,
        sums: &mut SurfaceSums,
        lane: usize,
    ) -> () = fade_body<Eight>
}

#[inline(always)]
fn fade_body<F: Eight>(
    all: &mut Weighted,
    surface: &[f64; 6],
    limit: f64,
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let (c, part) = (splat(surface), F::splat(1.0 / limit));
    let (one, none) = (F::splat(1.0), F::splat(0.0));
    let [u, v, h] = &all.at;
    // The weights first: together with the sums they do not fit the registers.
    let weights = all.near.iter().zip(&mut all.kept);
    for (((u, v), h), (near, kept)) in u.iter().zip(v).zip(h).zip(weights) {
        let (u, v, h, w) = (F::load(u), F::load(v), F::load(h), F::load(near));
        let off = over(&c, u, v, h);
        let rest = (one - off * off * part).larger(none);
        (w * w * (rest * rest)).store(kept);
    }
    put_surface_sums::<F, false>(&all.at, &all.kept, sums, lane);
}

#[cfg(test)]
mod tests;
