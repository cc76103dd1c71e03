//! How dense the surface is, patch by patch, and what is too far apart for that.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::distance2;
use crate::geom::triangle::area;
use crate::method::METHOD;
use crate::workspace::memory::Reservation;
use crate::workspace::persist::{Persist, Saved};

/// A limit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Width {
    /// In local spacings.
    Spacings(f64),
    /// In lattice steps.
    Steps(f64),
    /// None.
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

/// The distances above which points and triangles are no part of one surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Points off the surface are left out.
    pub off_surface: bool,
    /// Sides of triangles.
    pub edge: Width,
    /// Triangles that fill holes: the sides of an equilateral one as large as the largest.
    pub fill: Width,
}

/// For each patch the squared distance that the `k` nearest neighbours of a point usually reach.
#[derive(Debug)]
pub struct Spacings {
    usual2: Vec<u64>,
    _held: Reservation,
}

/// How dense the surface is, and what that limits.
#[derive(Debug, Clone, Copy)]
pub struct Density<'a> {
    /// By patch.
    pub spacings: &'a Spacings,
    /// `k`.
    pub neighbors: usize,
    /// The limits, in local spacings or lattice steps.
    pub limits: Limits,
}

/// True if neighbours that reach as far as `last2` reach farther than a surface does where `usual2` is
/// usual.
#[must_use]
pub fn is_far(last2: u64, usual2: u64) -> bool {
    u128::from(last2) > METHOD.off_surface.far * METHOD.off_surface.far * u128::from(usual2)
}

/// The square of the local spacing: on a plane, so many neighbours lie in the disk up to the last one,
/// which is so far away.
#[must_use]
pub fn spacing2(last2: u64, neighbors: usize) -> f64 {
    std::f64::consts::PI * last2 as f64 / neighbors as f64
}

impl Spacings {
    /// Takes over what was measured.
    #[must_use]
    pub fn new(usual2: Vec<u64>, held: Reservation) -> Self {
        Self {
            usual2,
            _held: held,
        }
    }

    /// Bytes for so many points.
    #[must_use]
    pub fn bytes(points: usize) -> u64 {
        8 * points.div_ceil(METHOD.curve.patch) as u64
    }

    /// The squared distance that the nearest neighbours of a point usually reach.
    #[must_use]
    #[inline(always)]
    pub fn usual2(&self, id: u32) -> u64 {
        self.usual2[id as usize / METHOD.curve.patch]
    }
}

impl Density<'_> {
    /// True if a point is off the surface: its `k` nearest neighbours reach as far as `last2`.
    #[must_use]
    pub fn is_off_surface(&self, id: u32, last2: u64) -> bool {
        self.limits.off_surface && is_far(last2, self.spacings.usual2(id))
    }

    /// Tells of triangles whether they have a side that is too long for the surface at both of its ends.
    pub fn is_long(self) -> impl Fn([u32; 3], [Point; 3]) -> bool + Copy {
        let (density, width) = (self, self.limits.edge);
        let sure = self.surely_within(width);
        #[inline(always)]
        move |t: [u32; 3], at: [Point; 3]| {
            // The third side squared is at most twice the sum of the squares of the others.
            let two = distance2(at[0], at[1]) as f64 + distance2(at[0], at[2]) as f64;
            let usual2 = |v: u32| density.spacings.usual2(v);
            let least = usual2(t[0]).min(usual2(t[1])).min(usual2(t[2]));
            2.0 * two > sure * least as f64 && density.exceeds(width, t, at)
        }
    }

    /// Sides whose squares are at most so many times the least `usual2` at their ends are within the limit,
    /// however that is rounded.
    fn surely_within(&self, width: Width) -> f64 {
        match width {
            Width::Spacings(x) => x * x * std::f64::consts::PI / self.neighbors as f64 * 0.999,
            Width::Steps(_) | Width::Any => 0.0,
        }
    }

    /// True if a triangle is too wide to fill a hole: it has a side that is far too long for the surface
    /// at both of its ends, or a larger area than an equilateral triangle whose sides are just not too
    /// long.
    #[must_use]
    pub fn is_wide(&self, t: [u32; 3], at: [Point; 3]) -> bool {
        let width = self.limits.fill;
        let most = |usual2: u64| 0.25 * 3f64.sqrt() * self.square(width, usual2);
        let usual2 = t.map(|v| self.spacings.usual2(v));
        width != Width::Any
            && (self.exceeds(width.times(METHOD.filling.slender), t, at)
                || area(at) > most(usual2[0].max(usual2[1]).max(usual2[2])))
    }

    /// The square of a width where neighbours usually reach so far.
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

impl Persist for Spacings {
    fn save(&self, out: &mut Vec<u8>) {
        self.usual2.save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let usual2: Vec<u64> = Persist::load(from)?;
        let bytes = 8 * usual2.len() as u64;
        let held = from.workspace.reserve("patch spacings", bytes)?;
        Ok(Self::new(usual2, held))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
    use crate::workspace::progress::{Cancel, Silent};
    use proptest::prelude::*;
    use std::sync::Arc;

    fn spacings(usual2: Vec<u64>) -> Spacings {
        let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        let folder = std::env::temp_dir();
        let workspace =
            crate::workspace::Workspace::new(&folder, memory, 1, Arc::new(Silent), Cancel::new());
        let held = workspace.unwrap().reserve("patch spacings", 0).unwrap();
        Spacings::new(usual2, held)
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
