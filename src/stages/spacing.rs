//! Local spacing by patch, and the limits of length that follow from it.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::distance2;
use crate::geom::triangle::area;
use crate::method::METHOD;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
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

/// For each patch, the squared distance that the `k` nearest neighbours of a point usually reach (the usual
/// reach).
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredSpacings {
    usual2: Vec<u64>,
}

/// [`StoredSpacings`] with a reservation of memory.
#[derive(Debug)]
pub struct Spacings {
    stored: StoredSpacings,
    _held: Reservation,
}

/// The density of the surface, and the limits that depend on it.
#[derive(Debug, Clone, Copy)]
pub struct Density<'a> {
    /// The usual reaches by patch.
    pub spacings: &'a Spacings,
    /// The number of neighbours `k`.
    pub neighbors: usize,
    /// The limits, in local spacings or in lattice steps.
    pub limits: Limits,
}

/// True if neighbours at squared distances up to `last2` reach farther than those of a surface with the usual
/// reach `usual2`.
#[must_use]
pub fn is_far(last2: u64, usual2: u64) -> bool {
    u128::from(last2) > METHOD.off_surface.far * METHOD.off_surface.far * u128::from(usual2)
}

/// The square of the local spacing: the mean spacing of `neighbors` points that fill a plane disk of squared
/// radius `last2`.
#[must_use]
pub fn spacing2(last2: u64, neighbors: usize) -> f64 {
    std::f64::consts::PI * last2 as f64 / neighbors as f64
}

impl StoredSpacings {
    /// From the measured values.
    #[must_use]
    pub fn new(usual2: Vec<u64>) -> Self {
        Self { usual2 }
    }

    /// Reserves memory for a number of points.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub fn reserve(points: usize, workspace: &Workspace) -> Result<Reservation> {
        let bytes = 8 * points.div_ceil(METHOD.curve.patch) as u64;
        workspace.reserve("patch spacings", bytes)
    }

    /// The spacings with a reservation of their memory.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub fn open(self, workspace: &Workspace) -> Result<Spacings> {
        let held = workspace.reserve("patch spacings", 8 * self.usual2.len() as u64)?;
        Ok(Spacings {
            stored: self,
            _held: held,
        })
    }

    /// The squared distance that the nearest neighbours of a point usually reach.
    #[must_use]
    #[inline(always)]
    pub fn usual2(&self, id: u32) -> u64 {
        self.usual2[id as usize / METHOD.curve.patch]
    }
}

impl Spacings {
    /// See [`StoredSpacings::usual2`].
    #[must_use]
    #[inline(always)]
    pub fn usual2(&self, id: u32) -> u64 {
        self.stored.usual2(id)
    }
}

impl Density<'_> {
    /// True if a point is off the surface; `last2` is the squared distance of the last of its `k` nearest
    /// neighbours.
    #[must_use]
    pub fn is_off_surface(&self, id: u32, last2: u64) -> bool {
        self.limits.off_surface && is_far(last2, self.spacings.usual2(id))
    }

    /// Returns a test of triangles: true if a side is longer than the limit at both of its ends.
    pub fn is_long(self) -> impl Fn([u32; 3], [Point; 3]) -> bool + Copy {
        let (density, width) = (self, self.limits.edge);
        let sure = self.surely_within(width);
        #[inline(always)]
        move |t: [u32; 3], at: [Point; 3]| {
            // The square of the third side is at most twice the sum of the squares of the other two.
            let two = distance2(at[0], at[1]) as f64 + distance2(at[0], at[2]) as f64;
            let usual2 = |v: u32| density.spacings.usual2(v);
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
    pub fn is_wide(&self, t: [u32; 3], at: [Point; 3]) -> bool {
        let width = self.limits.fill;
        let most = |usual2: u64| 0.25 * 3f64.sqrt() * self.square(width, usual2);
        let usual2 = t.map(|v| self.spacings.usual2(v));
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
    fn exceeds(&self, width: Width, t: [u32; 3], at: [Point; 3]) -> bool {
        let long = |(a, b): (usize, usize)| {
            let usual2 = self.spacings.usual2(t[a]).max(self.spacings.usual2(t[b]));
            distance2(at[a], at[b]) as f64 > self.square(width, usual2)
        };
        width != Width::Any && [(0, 1), (0, 2), (1, 2)].into_iter().any(long)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use proptest::prelude::*;

    fn spacings(usual2: Vec<u64>) -> Spacings {
        let workspace = Workspace::for_tests(1);
        StoredSpacings::new(usual2).open(&workspace).unwrap()
    }

    proptest! {
        #[test]
        fn the_quick_look_at_sides_misses_none(
            usual2 in prop::array::uniform3(0u64..5000),
            at in prop::array::uniform3(prop::array::uniform3(0i32..100)),
            limit in 0.5f64..12.0,
            steps in any::<bool>(),
        ) {
            let spacings = spacings(usual2.to_vec());
            let edge = if steps { Width::Steps(limit) } else { Width::Spacings(limit) };
            let limits = Limits { off_surface: true, edge, fill: Width::Any };
            let density = Density { spacings: &spacings, neighbors: 30, limits };
            let t = [0, 1, 2].map(|patch| patch * METHOD.curve.patch as u32 + 7);
            prop_assert_eq!(density.is_long()(t, at), density.exceeds(edge, t, at));
        }
    }
}
