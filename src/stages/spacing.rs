//! Local spacing by patch, and the limits of length that follow from it.

use crate::ids::{Id, Triangle};
use crate::levels::{HIGHEST, Levels};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::Point;
use outcrop_geom::distance2;
use outcrop_geom::triangle::area;
use outcrop_paper::method::METHOD;
use outcrop_paper::plane::Moments;
use serde::{Deserialize, Serialize};

/// A limit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Width {
    /// A multiple of the local spacing.
    Spacings(f64),
    /// A length in lattice steps.
    Steps(f64),
    /// No limit.
    Any,
}

impl Width {
    fn times(self, factor: f64) -> Self {
        match self {
            Self::Any => Self::Any,
            Self::Steps(steps) => Self::Steps(factor * steps),
            Self::Spacings(spacings) => Self::Spacings(factor * spacings),
        }
    }
}

/// The lengths above which points and triangles are not part of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// True if points off the surface are left out.
    pub off_surface: bool,
    /// Longest side of a triangle.
    pub edge: Width,
    /// Side of an equilateral triangle with the area of the largest triangle that fills a hole.
    pub fill: Width,
}

/// For each patch and each region, the squared distance that the `k` nearest neighbours of a point usually
/// reach (the usual reach).
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredSpacings {
    usual2: Vec<u64>,
    regions2: Vec<u64>,
}

/// [`StoredSpacings`] with a reservation of memory.
#[derive(Debug)]
pub struct Spacings {
    stored: StoredSpacings,
    _held: Reservation,
}

/// The factors from the usual reach of a patch, squared, to that of a coarse point.
const COARSER: [u64; 4] = [1, 4, 16, 256];

/// How coarse a point is, by its place in the list of factors: the last whose factor its own squared reach
/// `last2` allows.
#[must_use]
pub fn coarseness(last2: u64, usual2: u64) -> u8 {
    let allows = |factor: &&u64| u128::from(last2) >= u128::from(**factor) * u128::from(usual2);
    let count = COARSER[1..].iter().take_while(allows).count();
    if usual2 > 0 { count as u8 } else { 0 }
}

/// The largest level of noise at coarse points: strewn points have more, and are not the surface of a coarser part.
const MOST_NOISE: u8 = 1;

/// The nearest neighbours of a point, nearest first.
#[derive(Debug, Clone, Copy)]
pub struct Nearby<'a> {
    /// Their ids.
    pub ids: &'a [Id],
    /// Their differences to the point, by axis.
    pub differences: [&'a [i32]; 3],
}

/// How a point lies to its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// As is usual in its patch.
    Usual,
    /// Coarser than its patch, as [`coarseness`] says, without much noise, and not on a line such as a wire.
    Coarse(u8),
    /// Off the surface: its neighbours reach far for the region and for where they are, and fill space or lie on a
    /// surface beside it.
    Off,
}

/// The density of the surface, and the limits that depend on it.
#[derive(Debug, Clone, Copy)]
pub struct Density<'a> {
    /// The usual reaches by patch.
    pub spacings: &'a Spacings,
    /// The level of noise at each point, if there is noise.
    pub noise: Option<&'a Levels>,
    /// How coarse each point is, as [`coarseness`] says, if any is and this is known.
    pub coarse: Option<&'a Levels>,
    /// The number of neighbours `k`.
    pub neighbors: usize,
    /// The limits, in local spacings or in lattice steps.
    pub limits: Limits,
}

/// True if neighbours at squared distances up to `last2` reach farther than those of a surface with the usual
/// reach `usual2`.
fn is_far(last2: u64, usual2: u64) -> bool {
    let reach = METHOD.disk.reach;
    last2 as f64 > reach * reach * usual2 as f64
}

/// The moments of the nearer of a point's neighbours: a share of them, and others as far as the last of these.
fn nearer(near: Nearby<'_>) -> Moments {
    let [x, y, z] = near.differences;
    let points = || (0..x.len()).map(|i| [x[i], y[i], z[i]]);
    let mut distances: Vec<u64> = points().map(|at| distance2(at, [0; 3])).collect();
    let count = (METHOD.off_surface.nearer * distances.len() as f64) as usize;
    let mut moments = Moments::default();
    if let Some(last) = count.checked_sub(1) {
        let last2 = *distances.select_nth_unstable(last).1;
        points()
            .filter(|at| distance2(*at, [0; 3]) <= last2)
            .for_each(|at| moments.add(at.map(i64::from)));
    }
    moments
}

/// The square of the local spacing: the mean spacing of `neighbors` points that fill a plane disk of squared
/// radius `last2`.
#[must_use]
pub fn spacing2(last2: u64, neighbors: usize) -> f64 {
    std::f64::consts::PI * last2 as f64 / neighbors as f64
}

impl StoredSpacings {
    /// Zeros, for a number of points.
    #[must_use]
    pub fn new(points: usize) -> Self {
        Self {
            usual2: vec![0; points.div_ceil(METHOD.curve.patch)],
            regions2: vec![0; points.div_ceil(METHOD.curve.block as usize)],
        }
    }

    /// Sets the usual reaches, squared, of the patches of the region that begins with the id `first`, and of
    /// the region.
    pub fn put(&mut self, first: usize, usual2: &[u64], region2: u64) {
        self.usual2[first / METHOD.curve.patch..][..usual2.len()].copy_from_slice(usual2);
        self.regions2[first / METHOD.curve.block as usize] = region2;
    }

    /// Reserves memory for a number of points.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn reserve(points: usize, workspace: &Workspace) -> Result<Reservation> {
        workspace.reserve("patch spacings", Self::new(points).bytes())
    }

    fn bytes(&self) -> u64 {
        8 * (self.usual2.len() + self.regions2.len()) as u64
    }

    /// The spacings with a reservation of their memory.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn open(self, workspace: &Workspace) -> Result<Spacings> {
        let held = workspace.reserve("patch spacings", self.bytes())?;
        Ok(Spacings {
            stored: self,
            _held: held,
        })
    }

    /// The squared distance that the nearest neighbours of a point usually reach.
    #[must_use]
    #[inline(always)]
    pub fn usual2(&self, id: Id) -> u64 {
        self.usual2[id.index() / METHOD.curve.patch]
    }
}

impl Spacings {
    /// See [`StoredSpacings::usual2`].
    #[must_use]
    #[inline(always)]
    pub fn usual2(&self, id: Id) -> u64 {
        self.stored.usual2(id)
    }
}

impl Density<'_> {
    /// The squared reach of neighbours that is usual for a point: that of its patch, or more for a coarse point.
    fn reach2(&self, id: Id) -> u64 {
        let level = self.coarse.map_or(0, |coarse| coarse.get(id.index()));
        let usual2 = self.spacings.usual2(id);
        usual2.saturating_mul(COARSER[usize::from(level)])
    }

    /// How a point with these moments lies to its `k` nearest neighbours `near`, the last of which is at the squared
    /// distance `last2`.
    #[must_use]
    pub fn standing(&self, id: Id, last2: u64, moments: &Moments, near: Nearby<'_>) -> Standing {
        let coarseness = coarseness(last2, self.spacings.usual2(id));
        let far = self.limits.off_surface && self.is_remote(id, last2, near.ids);
        if !far && coarseness == 0 {
            return Standing::Usual;
        }
        let nearer = nearer(near);
        let plane = nearer.plane();
        let fills_space = || plane.normal.is_some_and(|normal| nearer.fill_space(normal));
        if far && (fills_space() || moments.is_beside()) {
            Standing::Off
        } else if coarseness > 0 && self.noise_at(id) <= MOST_NOISE && plane.wide {
            Standing::Coarse(coarseness)
        } else {
            Standing::Usual
        }
    }

    /// True if a point's neighbours `ids` reach farther than is usual in its region and, unless it has the noise of
    /// strewn points, than is usual where the neighbours are: a coarse part of a surface lies among coarse points.
    fn is_remote(&self, id: Id, last2: u64, ids: &[Id]) -> bool {
        let region2 = self.spacings.stored.regions2[id.index() / METHOD.curve.block as usize];
        is_far(last2, region2)
            && (self.noise_at(id) == HIGHEST || is_far(last2, self.usual2_among(ids)))
    }

    /// The median of the usual reaches of the patches in which points are, squared.
    fn usual2_among(&self, ids: &[Id]) -> u64 {
        let usual2 = |id: &Id| self.spacings.usual2(*id);
        let mut all: Vec<u64> = ids.iter().map(usual2).collect();
        let middle = all.len() / 2;
        if all.is_empty() {
            return 0;
        }
        *all.select_nth_unstable(middle).1
    }

    fn noise_at(&self, id: Id) -> u8 {
        self.noise.map_or(0, |noise| noise.get(id.index()))
    }

    /// True if there is noise at a point.
    #[must_use]
    pub fn is_noisy(&self, id: Id) -> bool {
        self.noise_at(id) > 0
    }

    /// Returns a test of triangles: true if a side is longer than the limit at both of its ends.
    pub fn is_long(self) -> impl Fn(Triangle, [Point; 3]) -> bool + Copy {
        let (density, width) = (self, self.limits.edge);
        let sure = self.surely_within(width);
        #[inline(always)]
        move |t: Triangle, at: [Point; 3]| {
            // The square of the third side is at most twice the sum of the squares of the other two.
            let two = distance2(at[0], at[1]) as f64 + distance2(at[0], at[2]) as f64;
            // Coarse points have larger limits.
            let usual2 = |v: Id| density.spacings.usual2(v);
            let least = usual2(t[0]).min(usual2(t[1])).min(usual2(t[2]));
            2.0 * two > sure * least as f64 && density.exceeds(width, t, at)
        }
    }

    /// A factor such that sides with squares up to this factor times the smallest `usual2` of their ends are
    /// within the limit, whatever the rounding.
    fn surely_within(&self, width: Width) -> f64 {
        match width {
            Width::Spacings(x) => x * x * std::f64::consts::PI / self.neighbors as f64 * 0.999,
            Width::Steps(_) | Width::Any => 0.0,
        }
    }

    /// True if a triangle is too wide to fill a hole: it has a side much longer than the limit at both of its
    /// ends, or a larger area than an equilateral triangle with sides of the limit.
    #[must_use]
    pub fn is_wide(&self, t: Triangle, at: [Point; 3]) -> bool {
        let width = self.limits.fill;
        let most = |usual2: u64| 0.25 * 3f64.sqrt() * self.square(width, usual2);
        let usual2 = t.map(|v| self.reach2(v));
        width != Width::Any
            && (self.exceeds(width.times(METHOD.filling.slender), t, at)
                || area(at) > most(usual2[0].max(usual2[1]).max(usual2[2])))
    }

    /// The square of a width in a patch with the usual reach `usual2`.
    fn square(&self, width: Width, usual2: u64) -> f64 {
        match width {
            Width::Any => f64::INFINITY,
            Width::Steps(steps) => steps * steps,
            Width::Spacings(spacings) => spacings * spacings * spacing2(usual2, self.neighbors),
        }
    }

    #[cold]
    fn exceeds(&self, width: Width, t: Triangle, at: [Point; 3]) -> bool {
        let long = |(a, b): (usize, usize)| {
            let usual2 = self.reach2(t[a]).max(self.reach2(t[b]));
            distance2(at[a], at[b]) as f64 > self.square(width, usual2)
        };
        width != Width::Any && [(0, 1), (0, 2), (1, 2)].into_iter().any(long)
    }
}

#[cfg(test)]
mod tests;
