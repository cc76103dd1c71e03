//! The plane through the nearest neighbours of a point.

use crate::ids::Id;
use crate::order::PointStore;
use crate::tiles::near::{Query, Sums};
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::{PageCache, Walk};
use outcrop_disk::error::Result;
use outcrop_geom::Point;
use outcrop_paper::kernels::Level;
use outcrop_paper::method::METHOD;
use outcrop_paper::plane::{Moments, Plane};

/// A source of the neighbours of a point.
pub(super) trait Source {
    /// The neighbours found so far, nearest first.
    fn near(&self) -> &Neighbors;
    /// Finds `count` neighbours, or all other points if there are fewer; false if they cannot be certified.
    fn reach(&mut self, count: usize) -> Result<bool>;
    /// The sums over the `count` nearest neighbours, or over all other points if there are fewer, and the
    /// number of points summed; `None` if they cannot be certified.
    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>>;
}

impl Source for Query<'_> {
    fn near(&self) -> &Neighbors {
        Query::near(self)
    }

    fn reach(&mut self, count: usize) -> Result<bool> {
        Ok(self.extend_to(count))
    }

    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>> {
        Ok(Query::sums(self, count).map(|sums| (sums, count)))
    }
}

/// A walk through the whole store, and the neighbours found so far.
impl Source for (Walk<'_>, Neighbors) {
    fn near(&self) -> &Neighbors {
        &self.1
    }

    fn reach(&mut self, count: usize) -> Result<bool> {
        let (walk, near) = self;
        while near.len() < count
            && let Some(next) = walk.advance()?
        {
            near.push(next);
        }
        Ok(true)
    }

    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>> {
        self.reach(count)?;
        let used = count.min(self.1.len());
        Ok(Some((self.1.sums(used, Level::best()), used)))
    }
}

/// The plane fitted to a point's neighbours, and the moments it follows from.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// The normal, and whether the neighbours span a plane.
    pub plane: Plane,
    /// The sums over the neighbours.
    pub moments: Moments,
    /// Squared distance of the last neighbour used.
    pub last2: u64,
    /// Squared distance of the last of the requested neighbours, before widening.
    pub near2: u64,
}

impl Fit {
    /// The plane of neighbours given by their sums.
    #[must_use]
    pub fn of(sums: Sums) -> Self {
        Self::with(sums.moments.plane(), sums)
    }

    /// As [`Fit::of`], if the plane of the sums is known.
    #[must_use]
    pub fn with(plane: Plane, sums: Sums) -> Self {
        Self {
            plane,
            moments: sums.moments,
            last2: sums.last2,
            near2: sums.last2,
        }
    }
}

/// The plane of the `neighbors` nearest of a source; `None` if they cannot be certified.
pub(super) fn fit_from(
    source: &mut impl Source,
    neighbors: usize,
    widen: Widen,
) -> Result<Option<Fit>> {
    if !source.reach(neighbors)? {
        return Ok(None);
    }
    let mut used = neighbors.min(source.near().len());
    let mut fit = Fit::of(source.near().sums(used, Level::best()));
    let mut wanted = neighbors;
    for _ in 0..METHOD.plane.doublings {
        if widen.is_enough(&fit.plane) || used < wanted {
            break;
        }
        // Only the set of neighbours matters here, not yet their order.
        wanted *= 2;
        let Some((sums, count)) = source.sums(wanted)? else {
            return Ok(None);
        };
        used = count;
        fit = Fit {
            near2: fit.near2,
            ..Fit::of(sums)
        };
    }
    Ok(Some(fit))
}

/// When the fit of a plane doubles the number of neighbours, up to eight times the requested one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Widen {
    /// Never: exactly the requested neighbours.
    Never,
    /// While the neighbours lie on a line.
    OnLines,
    /// While the neighbours lie on a narrow band, such as two scan lines.
    OnBands,
}

impl Widen {
    /// True if a plane needs no more neighbours.
    pub(super) fn is_enough(self, plane: &Plane) -> bool {
        match self {
            Self::Never => true,
            Self::OnLines => plane.spans,
            Self::OnBands => plane.wide,
        }
    }
}

/// The plane of the `neighbors` nearest, from the points in a tile and its halo; `None` if they cannot be
/// certified.
///
/// # Errors
/// None today; see `fit_in_store`.
pub fn fit_in_tile(query: &mut Query<'_>, neighbors: usize, widen: Widen) -> Result<Option<Fit>> {
    fit_from(query, neighbors, widen)
}

/// As [`fit_in_tile`], from the whole store; with the neighbours, nearest first: at least the `least` nearest.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn fit_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    id: Id,
    point: Point,
    (neighbors, least): (usize, usize),
    widen: Widen,
) -> Result<Option<(Fit, Neighbors)>> {
    let mut source = (Walk::new(store, cache, id, point), Neighbors::default());
    let fit = fit_from(&mut source, neighbors, widen)?;
    source.reach(least)?;
    Ok(fit.map(|fit| (fit, source.1)))
}

/// The `count` nearest neighbours of a point, or all other points if there are fewer, from the whole store.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn near_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    id: Id,
    point: Point,
    count: usize,
) -> Result<Neighbors> {
    some_near_in_store(store, cache, (id, point), |_| true, count)
}

/// The `count` nearest neighbours of a point whose ids are `wanted`, or all of these if there are fewer, from the
/// whole store.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub(super) fn some_near_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    (id, point): (Id, Point),
    wanted: impl Fn(usize) -> bool,
    count: usize,
) -> Result<Neighbors> {
    let mut walk = Walk::new(store, cache, id, point);
    let mut near = Neighbors::default();
    while near.len() < count
        && let Some(next) = walk.advance()?
    {
        if wanted(next.id.index()) {
            near.push(next);
        }
    }
    Ok(near)
}
