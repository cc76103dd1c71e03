//! Weighted sums over the positions around a point, and over their coordinates in a turned frame.
//!
//! A sum has eight parts: position `j` adds to part `j mod 8`. The parts are added in a fixed order. So every
//! level gives the same bits. The sums of several points stand side by side, one point in each lane, for
//! arithmetic on all of them at once.

use super::corners::LANES;
use super::eight::Eight;
use super::kernel;
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

/// Adds the parts of each sum and writes the totals to a lane. (A function passed to `map` would not be
/// compiled for the level.)
#[inline(always)]
fn put_totals<F: Eight, const N: usize>(sums: [F; N], to: &mut LaneSums<N>, lane: usize) {
    for (to, parts) in to.iter_mut().zip(sums) {
        to[lane] = parts.total();
    }
}

#[inline(always)]
fn splat<F: Eight, const N: usize>(from: &[f64; N]) -> [F; N] {
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
    let mut s = [F::splat(0.0); 10];
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
    put_totals(s, sums, lane);
}

#[inline(always)]
fn add<F: Eight, const N: usize>(sums: &mut [F; N], terms: [F; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum = *sum + term;
    }
}

/// The terms of a group of positions in the sums of a surface.
#[inline(always)]
fn surface_terms<F: Eight>(u: F, v: F, h: F, w: F) -> [F; 23] {
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
    [u, v, h]: &[Vec<[f64; GROUP]>; 3],
    weights: &[[f64; GROUP]],
    weigh: &impl Weigh<F>,
    sums: &mut SurfaceSums,
    lane: usize,
) {
    let mut s = [F::splat(0.0); 23];
    for (((u, v), h), w) in u.iter().zip(v).zip(h).zip(weights) {
        let [u, v, h, w] = [F::load(u), F::load(v), F::load(h), F::load(w)];
        add(&mut s, surface_terms(u, v, h, weigh.weigh(u, v, h, w)));
    }
    put_totals(s, sums, lane);
}

/// The height over the surface `c[0] + c[1] u + c[2] v + c[3] uu + c[4] uv + c[5] vv`.
#[inline(always)]
fn over<F: Eight>(c: &[F; 6], u: F, v: F, h: F) -> F {
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

impl<F: Eight> Weigh<F> for Square {
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
    let (surface, part) = (splat(surface), F::splat(1.0 / limit));
    let fade = Fade { surface, part };
    put_surface_sums::<F>(&all.at, &all.near, &fade, sums, lane);
}

struct Fade<F> {
    surface: [F; 6],
    /// 1 / limit.
    part: F,
}

impl<F: Eight> Weigh<F> for Fade<F> {
    #[inline(always)]
    fn weigh(&self, u: F, v: F, h: F, w: F) -> F {
        let off = over(&self.surface, u, v, h);
        let rest = (F::splat(1.0) - off * off * self.part).larger(F::splat(0.0));
        w * w * (rest * rest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    /// All that the kernels of a level compute.
    fn all_of(level: Level, columns: [&[i32]; 3], count: usize) -> Vec<f64> {
        let mut all = Weighted::default();
        let mut spread = [[0.0; LANES]; 10];
        take_weighted(
            level,
            &mut all,
            columns,
            count,
            1.0 / 2000.0,
            &mut spread,
            LANE,
        );
        let mut found = lane(&spread);
        let mut sums = [[0.0; LANES]; 23];
        let frame = [[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [0.8, -0.6, 0.0]];
        turn(level, &mut all, &frame, &mut sums, LANE);
        found.extend(lane(&sums));
        let surface = [0.1, 0.2, -0.1, 0.3, 0.1, -0.2];
        let dropped = drop_beyond(level, &mut all, &surface, 0.1, &mut sums, LANE);
        found.push(f64::from(u8::from(dropped)));
        found.extend(lane(&sums));
        square_weights(level, &all, &mut sums, LANE);
        found.extend(lane(&sums));
        fade(level, &all, &surface, 0.2, &mut sums, LANE);
        found.extend(lane(&sums));
        // The other lanes are left alone.
        let others = spread.iter().chain(&sums).flat_map(|of| &of[..LANE]);
        assert!(others.copied().all(|sum| sum == 0.0));
        found
    }

    const LANE: usize = 5;

    fn lane<const N: usize>(sums: &LaneSums<N>) -> Vec<f64> {
        sums.iter().map(|of| of[LANE]).collect()
    }

    proptest! {
        #[test]
        fn every_level_gives_the_same_sums(
            points in prop::collection::vec(prop::array::uniform3(-1000i32..1000), 1..60),
        ) {
            let whole = points.len().next_multiple_of(GROUP);
            let column = |axis: usize| {
                let mut all: Vec<i32> = points.iter().map(|p| p[axis]).collect();
                all.resize(whole, 0);
                all
            };
            let (x, y, z) = (column(0), column(1), column(2));
            let expected = all_of(Level::BASE, [&x, &y, &z], points.len());
            for level in Level::all() {
                prop_assert_eq!(&all_of(level, [&x, &y, &z], points.len()), &expected);
            }
            // Against plain sums.
            let at = |p: &[i32; 3]| p.map(|c| f64::from(c) / 2000.0);
            let near = |p: &[i32; 3]| 1.0 - at(p).iter().map(|c| c * c).sum::<f64>();
            let close = |found: f64, sum: f64| (found - sum).abs() < 1e-9;
            let weights: f64 = points.iter().map(near).sum();
            let xy: f64 = points.iter().map(|p| near(p) * at(p)[0] * at(p)[1]).sum();
            prop_assert!(close(expected[0], weights) && close(expected[7], xy));
            let turned = |p: &[i32; 3]| {
                let [x, y, z] = at(p);
                [0.6 * x + 0.8 * y, z, 0.8 * x - 0.6 * y]
            };
            let uuvv = points.iter().map(|p| near(p) * (turned(p)[0] * turned(p)[1]).powi(2)).sum();
            let huv = points.iter().map(|p| near(p) * turned(p).iter().product::<f64>()).sum();
            prop_assert!(close(expected[10 + 12], uuvv) && close(expected[10 + 19], huv));
            let over = |p: &[i32; 3]| {
                let [u, v, h] = turned(p);
                h - (0.1 + 0.2 * u - 0.1 * v + 0.3 * u * u + 0.1 * u * v - 0.2 * v * v)
            };
            let kept = points.iter().filter(|p| over(p).powi(2) <= 0.1);
            prop_assert!(close(expected[34], kept.map(near).sum()));
            prop_assert!(close(expected[57], points.iter().map(|p| near(p).powi(2)).sum()));
            let faded = points.iter().map(|p| {
                let rest = (1.0 - over(p).powi(2) / 0.2).max(0.0);
                near(p).powi(2) * rest * rest
            });
            prop_assert!(close(expected[80], faded.sum()));
        }
    }
}
