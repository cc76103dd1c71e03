//! The density of the surface (sections 4.1 and 4.2), and the limits of distance.

use super::Settings;
use super::cells::by_distance;
use super::insert::normal;
use super::surface::Triangle;
use outcrop_geom::{Point, distance2};
use outcrop_paper::plane::Moments;

/// Ids in a patch, and patches in a region.
const PATCH: usize = 256;
const REGION: usize = 256;

/// The usual reach of neighbours, by patch and by region, and the resulting limits.
pub struct Density {
    usual2: Vec<u64>,
    regions2: Vec<u64>,
    /// By which a point's squared reach exceeds that of its patch; 1 if it is not coarse.
    coarse: Vec<u64>,
    /// The level of noise of each point.
    pub noise: Vec<u8>,
    settings: Settings,
}

/// The squared distance of the last of `N_k`.
fn reach2(points: &[Point], i: usize, k: usize) -> u64 {
    let others = by_distance(points, i);
    let used = &others[..k.min(others.len())];
    used.last().map_or(0, |&j| distance2(points[i], points[j]))
}

fn lower_quartile(mut all: Vec<u64>) -> u64 {
    all.sort_unstable();
    all[all.len() / 4]
}

/// True if neighbours reach more than twice as far as is usual.
fn is_far(last2: u64, usual2: u64) -> bool {
    u128::from(last2) > 4 * u128::from(usual2)
}

/// The moments of two thirds of the neighbours, the nearer ones and those as far as the last of them.
fn nearer(nearest: &[Point]) -> Moments {
    let mut moments = Moments::default();
    let Some(last) = (67 * nearest.len() / 100).checked_sub(1) else {
        return moments;
    };
    let reach2 = distance2(nearest[last], [0; 3]);
    for &at in nearest {
        if distance2(at, [0; 3]) <= reach2 {
            moments.add(at.map(i64::from));
        }
    }
    moments
}

/// Measures a cloud before points move.
pub fn measure(points: &[Point], settings: &Settings) -> Density {
    let ids: Vec<usize> = (0..points.len()).collect();
    let quartile = |patch: &[usize]| {
        let sampled = patch.iter().filter(|&&id| (id / 16).is_multiple_of(8));
        lower_quartile(
            sampled
                .map(|&id| reach2(points, id, settings.neighbors))
                .collect(),
        )
    };
    let usual2: Vec<u64> = ids.chunks(PATCH).map(quartile).collect();
    let regions = usual2.chunks(REGION);
    Density {
        regions2: regions
            .map(|region| lower_quartile(region.to_vec()))
            .collect(),
        usual2,
        coarse: vec![1; points.len()],
        noise: vec![0; points.len()],
        settings: *settings,
    }
}

impl Density {
    /// Looks at a point with `N_k` and the differences to them, nearest first, and the sums of its plane: true if
    /// it is off the surface. Notes how coarse it is.
    pub fn is_off_surface(
        &mut self,
        id: usize,
        ids: &[usize],
        nearest: &[Point],
        moments: &Moments,
    ) -> bool {
        let last2 = nearest.last().map_or(0, |&at| distance2(at, [0; 3]));
        let usual2 = u128::from(self.usual2[id / PATCH]);
        let allowed =
            |factor: &u64| usual2 > 0 && u128::from(last2) >= u128::from(*factor) * usual2;
        let mut among: Vec<u64> = ids.iter().map(|j| self.usual2[j / PATCH]).collect();
        among.sort_unstable();
        let far = !self.settings.keep_all
            && is_far(last2, self.regions2[id / (PATCH * REGION)])
            && (self.noise[id] == 3 || is_far(last2, among[among.len() / 2]));
        let nearer = nearer(nearest);
        let plane = nearer.plane();
        let fills_space = plane.normal.is_some_and(|normal| nearer.fill_space(normal));
        if far && (fills_space || moments.is_beside()) {
            return true;
        }
        if self.noise[id] <= 1 && plane.wide {
            self.coarse[id] = [4, 16, 256].into_iter().rfind(allowed).unwrap_or(1);
        }
        false
    }

    /// The square of the local spacing at a point.
    fn local2(&self, v: u32) -> f64 {
        let usual2 = self.usual2[v as usize / PATCH] * self.coarse[v as usize];
        std::f64::consts::PI * usual2 as f64 / self.settings.neighbors as f64
    }

    /// True if a side of a triangle is longer than `spacings` local spacings at both ends.
    fn exceeds(&self, spacings: f64, t: Triangle, points: &[Point]) -> bool {
        [(0, 1), (0, 2), (1, 2)].into_iter().any(|(a, b)| {
            let side2 = distance2(points[t[a] as usize], points[t[b] as usize]) as f64;
            let long = |v: u32| side2 > spacings * spacings * self.local2(v);
            long(t[a]) && long(t[b])
        })
    }

    /// True if a triangle, by its file positions, is too long.
    pub fn is_long(&self, t: Triangle, file: &[Point]) -> bool {
        self.exceeds(self.settings.max_edge, t, file)
    }

    /// True if a triangle is too long, or too large, to fill a hole.
    pub fn is_wide(&self, t: Triangle, file: &[Point]) -> bool {
        let w = self.settings.max_fill;
        let n = normal(file, t).map(|x| x as f64);
        let area = 0.5 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let local2 = t.map(|v| self.local2(v)).into_iter().fold(0.0, f64::max);
        let large = area > 0.25 * 3f64.sqrt() * (w * w * local2);
        large || self.exceeds(2.5 * w, t, file)
    }
}
