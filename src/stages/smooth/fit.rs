//! Least-squares surfaces of first and second order, fitted for several points at a time.

pub use outcrop_paper::kernels::eight::{Eight, loaded, stored};
pub use outcrop_paper::kernels::numbers::Numbers;
use outcrop_paper::kernels::{LANES, SurfaceSums, kernel};
use outcrop_paper::method::METHOD;

/// Unknowns of a plane over a frame.
const PLANE: usize = 3;

/// Unknowns of a surface of second order.
pub(super) const TERMS: usize = 6;

/// A surface of first and one of second order, with a ridge; for one point or, with arrays, for several.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit<T> {
    /// Terms of the plane: 1, u, v; then zeros.
    pub plane: [T; TERMS],
    /// Terms of the surface of second order: 1, u, v, uu, uv, vv.
    pub curved: [T; TERMS],
    /// Least sum for the plane: weights times squared heights over it, and the ridge.
    pub over_plane: T,
    /// The same for the surface of second order.
    pub over_curved: T,
    /// Sum of the weights.
    pub total: T,
    /// Sum of the squared weights.
    squares: T,
}

kernel! {
    /// The surfaces from sums.
    pub(super) fn fits(sums: &SurfaceSums) -> Fit<[f64; LANES]> = fits_body<Eight>
}

#[inline(always)]
fn fits_body<F: Eight>(sums: &SurfaceSums) -> Fit<[f64; LANES]> {
    let fit = Fit::of(&loaded::<F, 23>(sums));
    let [over_plane, over_curved, total, squares] =
        stored([fit.over_plane, fit.over_curved, fit.total, fit.squares]);
    Fit {
        plane: stored(fit.plane),
        curved: stored(fit.curved),
        over_plane,
        over_curved,
        total,
        squares,
    }
}

impl<F: Numbers> Fit<F> {
    #[inline(always)]
    fn of(sums: &[F; 23]) -> Self {
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
        let half = F::splat(0.5);
        let ridge = F::splat(METHOD.smoothing.ridge) * w;
        let second = half * ridge;
        // Normal equations; the last column is the right-hand side.
        let mut m = [
            [w, u, v, uu, uv, vv, h],
            [u, uu + ridge, uv, uuu, uuv, uvv, hu],
            [v, uv, vv + ridge, uuv, uvv, vvv, hv],
            [uu, uuu, uuv, u4 + second, u3v, u2v2, huu],
            [uv, uuv, uvv, u3v, u2v2 + half * second, uv3, huv],
            [vv, uvv, vvv, u2v2, uv3, v4 + second, hvv],
        ];
        let mut left = hh;
        let mut over_plane = hh;
        for pivot in 0..TERMS {
            if pivot == PLANE {
                over_plane = left;
            }
            let from = m[pivot];
            let part = F::splat(1.0) / from[pivot];
            left = left - from[TERMS] * (from[TERMS] * part);
            for equation in &mut m[pivot + 1..] {
                let factor = equation[pivot] * part;
                for j in pivot + 1..=TERMS {
                    equation[j] = equation[j] - factor * from[j];
                }
            }
        }
        Self {
            plane: solved::<F, PLANE>(&m),
            curved: solved::<F, TERMS>(&m),
            over_plane,
            over_curved: left,
            total: w,
            squares,
        }
    }
}

/// The first `N` unknowns of equations in triangular form, without the others.
#[inline(always)]
fn solved<F: Numbers, const N: usize>(m: &[[F; TERMS + 1]; TERMS]) -> [F; TERMS] {
    let mut terms = [F::splat(0.0); TERMS];
    for i in (0..N).rev() {
        let mut right = m[i][TERMS];
        for j in i + 1..N {
            right = right - m[i][j] * terms[j];
        }
        terms[i] = right / m[i][i];
    }
    terms
}

impl Fit<[f64; LANES]> {
    /// The terms of the surface of second order of the point in `lane`.
    pub fn curved(&self, lane: usize) -> [f64; TERMS] {
        self.curved.map(|term| term[lane])
    }

    /// Weighted mean of the squared heights over that surface.
    pub fn mean2(&self, lane: usize) -> f64 {
        (self.over_curved[lane] / self.total[lane]).max(0.0)
    }

    /// The surfaces of all points.
    #[inline(always)]
    pub fn loaded<F: Eight>(&self) -> Fit<F> {
        Fit {
            plane: loaded(&self.plane),
            curved: loaded(&self.curved),
            over_plane: F::load(&self.over_plane),
            over_curved: F::load(&self.over_curved),
            total: F::load(&self.total),
            squares: F::load(&self.squares),
        }
    }
}

impl<F: Numbers> Fit<F> {
    /// Weighted mean of the squared heights over the surface of second order.
    #[inline(always)]
    pub fn mean2_body(&self) -> F {
        (self.over_curved / self.total).larger(F::splat(0.0))
    }

    /// The share of the surface of second order: 0 if a plane is enough, 1 if it is not.
    #[inline(always)]
    pub fn share_body(&self) -> F {
        // As many points of equal weight would tell as much.
        let points = self.total * self.total / self.squares;
        let more = self.over_plane - self.over_curved;
        let freedom = points - F::splat(TERMS as f64);
        let worth = more * freedom / (self.over_curved * F::splat((TERMS - PLANE) as f64));
        let [enough, needed] = [METHOD.smoothing.enough, METHOD.smoothing.needed];
        let part = (worth - F::splat(enough)) / F::splat(needed - enough);
        share_if(worth.greater(F::splat(enough)), part)
    }
}

/// A share of at most 1 where bits are set, else 0.
#[inline(always)]
pub(super) fn share_if<F: Numbers>(bits: u64, share: F) -> F {
    let (none, one) = (F::splat(0.0), F::splat(1.0));
    let [share] = F::choose(one.greater(share), [share], [one]);
    let [share] = F::choose(bits, [share], [none]);
    share
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_paper::kernels::Level;
    use proptest::prelude::*;

    /// Sums over positions `u, v, h, w`.
    fn sums(positions: &[[f64; 4]]) -> [f64; 23] {
        let mut sums = [0.0; 23];
        for &[u, v, h, w] in positions {
            let [uu, uv, vv] = [u * u, u * v, v * v];
            let terms: [f64; 23] = [
                1.0,
                u,
                v,
                uu,
                uv,
                vv,
                uu * u,
                uu * v,
                u * vv,
                v * vv,
                uu * uu,
                uu * uv,
                uu * vv,
                uv * vv,
                vv * vv,
                h,
                h * u,
                h * v,
                h * uu,
                h * uv,
                h * vv,
                h * h,
                w,
            ];
            sums.iter_mut()
                .zip(terms)
                .for_each(|(sum, term)| *sum += w * term);
        }
        sums
    }

    fn lane(fit: &Fit<[f64; LANES]>, lane: usize) -> Fit<f64> {
        Fit {
            plane: fit.plane.map(|term| term[lane]),
            curved: fit.curved.map(|term| term[lane]),
            over_plane: fit.over_plane[lane],
            over_curved: fit.over_curved[lane],
            total: fit.total[lane],
            squares: fit.squares[lane],
        }
    }

    fn bits(fit: &Fit<f64>) -> Vec<u64> {
        let numbers = [fit.over_plane, fit.over_curved, fit.total, fit.squares];
        let all = fit.plane.iter().chain(&fit.curved).chain(&numbers);
        all.map(|x| if x.is_nan() { f64::NAN } else { *x }.to_bits())
            .collect()
    }

    proptest! {
        #[test]
        fn several_fits_are_those_of_each(
            positions in prop::collection::vec(prop::array::uniform4(-1.0f64..1.0), 1..120),
            flat in 0i32..40,
        ) {
            let at = |[u, v, h, w]: [f64; 4]| [u, v, 0.1 * u * v + h * 0.5f64.powi(flat), w.abs()];
            let positions: Vec<_> = positions.into_iter().map(at).collect();
            // From none to all of them.
            let lanes: [_; LANES] = std::array::from_fn(|lane| {
                sums(&positions[..positions.len() * lane / (LANES - 1)])
            });
            let together = std::array::from_fn(|sum| lanes.map(|lane| lane[sum]));
            for level in Level::all() {
                let found = fits(level, &together);
                for (place, sums) in lanes.iter().enumerate() {
                    prop_assert_eq!(bits(&lane(&found, place)), bits(&Fit::of(sums)));
                }
            }
        }

        #[test]
        fn a_surface_of_second_order_is_found(
            positions in prop::collection::vec(prop::array::uniform2(-1.0f64..1.0), 30..60),
            terms in prop::array::uniform6(-1.0f64..1.0),
        ) {
            let height = |u: f64, v: f64| {
                let row = [1.0, u, v, u * u, u * v, v * v];
                row.iter().zip(terms).map(|(a, b)| a * b).sum::<f64>()
            };
            let positions: Vec<_> = positions.iter().map(|&[u, v]| [u, v, height(u, v), 1.0]).collect();
            let fit = Fit::<f64>::of(&sums(&positions));
            let miss: f64 = positions.iter().map(|[u, v, h, _]| {
                let row = [1.0, *u, *v, u * u, u * v, v * v];
                let on: f64 = row.iter().zip(fit.curved).map(|(a, b)| a * b).sum();
                (h - on).powi(2)
            }).sum();
            // The ridge takes the terms a little towards 0.
            let ridge = METHOD.smoothing.ridge * positions.len() as f64;
            let squares: f64 = terms.iter().map(|t| t * t).sum();
            prop_assert!(miss <= ridge * squares + 1e-9, "{miss}");
            prop_assert!(fit.over_curved >= -1e-9 && fit.over_curved <= ridge * squares + 1e-9);
            prop_assert!(fit.over_plane >= fit.over_curved - 1e-9);
        }
    }
}
