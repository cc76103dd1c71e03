//! The density of the surface (sections 4.1 and 4.2), and the limits of distance.

use super::Settings;
use super::cells::{by_distance, plane_of};
use super::insert::normal;
use super::surface::Triangle;
use outcrop::geom::{Point, distance2};

/// Ids in a patch, and patches in a region.
const PATCH: usize = 256;
const REGION: usize = 256;

/// The usual reach of neighbours, by patch, and the resulting limits.
pub struct Density {
    usual2: Vec<u64>,
    settings: Settings,
}

/// The squared distance of the last of `N_k`; true if `i` and these fill space.
fn reach(points: &[Point], i: usize, k: usize) -> (u64, bool) {
    let others = by_distance(points, i);
    let used = &others[..k.min(others.len())];
    let (moments, plane) = plane_of(points, i, used);
    let last2 = used.last().map_or(0, |&j| distance2(points[i], points[j]));
    (last2, plane.normal.is_some_and(|n| moments.fill_space(n)))
}

fn lower_quartile(mut all: Vec<u64>) -> u64 {
    all.sort_unstable();
    all[all.len() / 4]
}

/// True if neighbours reach more than five times as far as is usual.
fn is_far(last2: u64, usual2: u64) -> bool {
    u128::from(last2) > 25 * u128::from(usual2)
}

/// Measures a cloud before relaxing.
pub fn measure(points: &[Point], settings: &Settings) -> Density {
    let ids: Vec<usize> = (0..points.len()).collect();
    let looks: Vec<Vec<(u64, bool)>> = ids
        .chunks(PATCH)
        .map(|patch| {
            let looked = patch.iter().filter(|&&id| (id / 16).is_multiple_of(8));
            looked
                .map(|&id| reach(points, id, settings.neighbors))
                .collect()
        })
        .collect();
    let quartile = |look: &Vec<(u64, bool)>| lower_quartile(look.iter().map(|l| l.0).collect());
    let mut usual2 = Vec::new();
    for region in looks.chunks(REGION) {
        let own: Vec<u64> = region.iter().map(quartile).collect();
        let usual = lower_quartile(own.clone());
        let far = own.iter().filter(|own| is_far(**own, usual)).count();
        let one_in = if 16 * far <= region.len() { 16 } else { 2 };
        for (look, own) in region.iter().zip(own) {
            let fills = one_in * look.iter().filter(|l| l.1).count() >= look.len();
            usual2.push(if fills && is_far(own, usual) {
                usual
            } else {
                own
            });
        }
    }
    Density {
        usual2,
        settings: *settings,
    }
}

impl Density {
    /// True if a point with the last of `N_k` at this distance is off the surface.
    pub fn is_off_surface(&self, id: usize, last2: u64) -> bool {
        !self.settings.keep_all && is_far(last2, self.usual2[id / PATCH])
    }

    /// The square of the local spacing at a point.
    fn local2(&self, v: u32) -> f64 {
        let usual2 = self.usual2[v as usize / PATCH];
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
