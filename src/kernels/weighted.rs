//! Weighted sums over the positions around a point, and over their coordinates in a turned frame.
//!
//! A sum has eight parts: position `j` adds to part `j mod 8`. The parts are added in a fixed order. So every
//! level gives the same bits.

use super::eight::Eight;
use super::kernel;

/// Positions of one group.
const GROUP: usize = 8;

/// Sums of weights `w` times 1, x, y, z, xx, yy, zz, xy, xz, yz.
pub type SpreadSums = [f64; 10];

/// Sums of weights `w` times 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv, then times
/// h, hu, hv, huu, huv, hvv, hh; and the sum of `w²`.
pub type SurfaceSums = [f64; 23];

/// Positions around a point at the origin, in columns of groups; after the last one, zeros without weight.
#[derive(Debug, Clone, Default)]
pub struct Weighted {
    count: usize,
    /// x, y, z.
    at: [Vec<[f64; GROUP]>; 3],
    /// Coordinates in a turned frame: u, v, h.
    turned: [Vec<[f64; GROUP]>; 3],
    /// The weight by distance, 1 − (x² + y² + z²).
    near: Vec<[f64; GROUP]>,
    /// The weight that sums use.
    weight: Vec<[f64; GROUP]>,
}

impl Weighted {
    /// Removes all positions and makes room for `count`.
    fn reset(&mut self, count: usize) {
        let groups = count.div_ceil(GROUP);
        let columns = self.at.iter_mut().chain(&mut self.turned);
        for column in columns.chain([&mut self.near, &mut self.weight]) {
            column.resize(groups, [0.0; GROUP]);
        }
        self.count = count;
    }

    /// Sets each weight to the square of that by distance.
    pub fn square_weights(&mut self) {
        for (to, near) in self.weight.iter_mut().zip(&self.near) {
            *to = near.map(|w| w * w);
        }
    }

    /// The weights after the last position are 0.
    fn end(&mut self) {
        let rest = self.count % GROUP;
        if let Some(last) = self.near.last_mut().filter(|_| rest > 0) {
            last[rest..].fill(0.0);
        }
        self.weight.clone_from(&self.near);
    }
}

/// The sum of all parts, for each sum. (A function passed to `map` would not be compiled for the level.)
#[inline(always)]
fn totals<F: Eight, const N: usize>(sums: [F; N]) -> [f64; N] {
    let mut totals = [0.0; N];
    for (total, parts) in totals.iter_mut().zip(sums) {
        let mut p = [0.0; GROUP];
        parts.store(&mut p);
        *total = ((p[0] + p[4]) + (p[2] + p[6])) + ((p[1] + p[5]) + (p[3] + p[7]));
    }
    totals
}

#[inline(always)]
fn splat<F: Eight>(c: &[f64; 6]) -> [F; 6] {
    [
        F::splat(c[0]),
        F::splat(c[1]),
        F::splat(c[2]),
        F::splat(c[3]),
        F::splat(c[4]),
        F::splat(c[5]),
    ]
}

kernel! {
    /// Takes `count` positions from columns of whole groups, multiplied by `scale`, with weights by distance.
    pub fn take_weighted(all: &mut Weighted, columns: [&[i32]; 3], count: usize, scale: f64) -> () = take_body<Eight>
}

#[inline(always)]
fn take_body<F: Eight>(all: &mut Weighted, columns: [&[i32]; 3], count: usize, scale: f64) {
    all.reset(count);
    let [x, y, z] = columns.map(|column| column.as_chunks::<GROUP>().0);
    let [to_x, to_y, to_z] = &mut all.at;
    let to = to_x.iter_mut().zip(to_y).zip(to_z).zip(&mut all.near);
    let (scale, one) = (F::splat(scale), F::splat(1.0));
    for ((((to_x, to_y), to_z), near), ((x, y), z)) in to.zip(x.iter().zip(y).zip(z)) {
        let (x, y, z) = (F::convert(x), F::convert(y), F::convert(z));
        let (x, y, z) = (x * scale, y * scale, z * scale);
        x.store(to_x);
        y.store(to_y);
        z.store(to_z);
        (one - (x * x + y * y + z * z)).store(near);
    }
    all.end();
}

kernel! {
    /// Sums over the positions.
    pub fn spread_sums(all: &Weighted) -> SpreadSums = spread_body<Eight>
}

#[inline(always)]
fn spread_body<F: Eight>(all: &Weighted) -> SpreadSums {
    let mut sums = [F::splat(0.0); 10];
    let [x, y, z] = &all.at;
    for (((x, y), z), w) in x.iter().zip(y).zip(z).zip(&all.weight) {
        let (x, y, z, w) = (F::load(x), F::load(y), F::load(z), F::load(w));
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
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum = *sum + term;
        }
    }
    totals(sums)
}

kernel! {
    /// Computes the coordinates in the frame of three unit vectors u, v, h.
    pub fn turn(all: &mut Weighted, frame: &[[f64; 3]; 3]) -> () = turn_body<Eight>
}

#[inline(always)]
fn turn_body<F: Eight>(all: &mut Weighted, frame: &[[f64; 3]; 3]) {
    let [x, y, z] = &all.at;
    for (to, axis) in all.turned.iter_mut().zip(frame) {
        let (a, b, c) = (F::splat(axis[0]), F::splat(axis[1]), F::splat(axis[2]));
        for (((x, y), z), to) in x.iter().zip(y).zip(z).zip(to) {
            let (x, y, z) = (F::load(x), F::load(y), F::load(z));
            (x * a + y * b + z * c).store(to);
        }
    }
}

kernel! {
    /// Sums over the coordinates in the turned frame.
    pub fn surface_sums(all: &Weighted) -> SurfaceSums = surface_body<Eight>
}

#[inline(always)]
fn surface_body<F: Eight>(all: &Weighted) -> SurfaceSums {
    let mut sums = [F::splat(0.0); 23];
    let [u, v, h] = &all.turned;
    for (((u, v), h), w) in u.iter().zip(v).zip(h).zip(&all.weight) {
        let (u, v, h, w) = (F::load(u), F::load(v), F::load(h), F::load(w));
        let [wu, wv, wh] = [w * u, w * v, w * h];
        let [wuu, wuv, wvv] = [wu * u, wu * v, wv * v];
        let [wuuu, wuuv, wuvv, wvvv] = [wuu * u, wuu * v, wvv * u, wvv * v];
        let terms = [
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
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum = *sum + term;
        }
    }
    totals(sums)
}

/// The height over the surface `c[0] + c[1] u + c[2] v + c[3] uu + c[4] uv + c[5] vv`.
#[inline(always)]
fn over<F: Eight>(c: &[F; 6], u: F, v: F, h: F) -> F {
    h - (c[0] + u * (c[1] + c[3] * u + c[4] * v) + v * (c[2] + c[5] * v))
}

kernel! {
    /// Takes the weight of the positions whose squared height over a surface is more than `limit`. Returns
    /// true if there are any.
    pub fn drop_beyond(all: &mut Weighted, surface: &[f64; 6], limit: f64) -> bool = drop_body<Eight>
}

#[inline(always)]
fn drop_body<F: Eight>(all: &mut Weighted, surface: &[f64; 6], limit: f64) -> bool {
    let (c, limit, none) = (splat(surface), F::splat(limit), F::splat(0.0));
    let [u, v, h] = &all.turned;
    let mut any = 0;
    for (((u, v), h), weight) in u.iter().zip(v).zip(h).zip(&mut all.weight) {
        let (u, v, h, w) = (F::load(u), F::load(v), F::load(h), F::load(weight));
        let off = over(&c, u, v, h);
        let beyond = (off * off).greater(limit) & w.greater(none);
        let [w] = F::choose(beyond, [none], [w]);
        w.store(weight);
        any |= beyond;
    }
    any != 0
}

kernel! {
    /// Multiplies the weights by the square of 1 − (squared height over a surface) / `limit`, or by 0 where
    /// that is negative.
    pub fn fade(all: &mut Weighted, surface: &[f64; 6], limit: f64) -> () = fade_body<Eight>
}

#[inline(always)]
fn fade_body<F: Eight>(all: &mut Weighted, surface: &[f64; 6], limit: f64) {
    let (c, one, none) = (splat(surface), F::splat(1.0), F::splat(0.0));
    let part = F::splat(1.0 / limit);
    let [u, v, h] = &all.turned;
    for (((u, v), h), weight) in u.iter().zip(v).zip(h).zip(&mut all.weight) {
        let (u, v, h, w) = (F::load(u), F::load(v), F::load(h), F::load(weight));
        let off = over(&c, u, v, h);
        let rest = (one - off * off * part).larger(none);
        (w * (rest * rest)).store(weight);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    /// All that the kernels of a level compute.
    fn all_of(level: Level, columns: [&[i32]; 3], count: usize) -> (Vec<f64>, Weighted) {
        let mut all = Weighted::default();
        take_weighted(level, &mut all, columns, count, 1.0 / 2000.0);
        let mut found = spread_sums(level, &all).to_vec();
        turn(
            level,
            &mut all,
            &[[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [0.8, -0.6, 0.0]],
        );
        found.extend(surface_sums(level, &all));
        let surface = [0.1, 0.2, -0.1, 0.3, 0.1, -0.2];
        found.push(f64::from(u8::from(drop_beyond(
            level, &mut all, &surface, 0.1,
        ))));
        found.extend(surface_sums(level, &all));
        all.square_weights();
        fade(level, &mut all, &surface, 0.2);
        found.extend(surface_sums(level, &all));
        (found, all)
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
            let (expected, all) = all_of(Level::BASE, [&x, &y, &z], points.len());
            for level in Level::all() {
                prop_assert_eq!(&all_of(level, [&x, &y, &z], points.len()).0, &expected);
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
            // The last sums have weights that fade; none after the last position.
            let weights = all.weight.as_flattened();
            prop_assert!(weights[points.len()..].iter().all(|w| *w == 0.0));
            let over = |p: &[i32; 3]| {
                let [u, v, h] = turned(p);
                h - (0.1 + 0.2 * u - 0.1 * v + 0.3 * u * u + 0.1 * u * v - 0.2 * v * v)
            };
            for (p, w) in points.iter().zip(weights) {
                let rest = (1.0 - over(p).powi(2) / 0.2).max(0.0);
                prop_assert!(close(*w, near(p).powi(2) * rest * rest));
            }
            let kept = points.iter().filter(|p| over(p).powi(2) <= 0.1);
            prop_assert!(close(expected[34], kept.map(near).sum()));
        }
    }
}
