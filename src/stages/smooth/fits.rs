//! The planes and neighbours of the points of a tile, for smoothing and relaxing.

use crate::error::Result;
use crate::geom::Point;
use crate::geom::plane::{Moments, planes};
use crate::kernels::{LANES, Level};
use crate::stages::cells::{Fit, Widen, fit_in_store, fit_in_tile, near_in_store};
use crate::stages::order::PointStore;
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::{Search, Sums};
use crate::stages::tiles::neighbors::Neighbors;
use crate::stages::tiles::walk::PageCache;
use std::cell::RefCell;
use std::ops::Range;

/// Calls `each` with the plane of every point of a tile whose id is `wanted`.
pub(super) fn each_fit(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    wanted: impl Fn(usize) -> bool,
    each: impl FnMut(usize, Point, Fit),
) -> Result<()> {
    each_plane(store, ids, neighbors, Widen::Never, wanted, each)
}

/// Calls `each` with the plane of every point of a tile whose id is `wanted`: through exactly `neighbors`
/// neighbours, or widened as for a cell.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`].
pub fn each_plane(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    widen: Widen,
    wanted: impl Fn(usize) -> bool,
    each: impl FnMut(usize, Point, Fit),
) -> Result<()> {
    let look = |tile: &Tile, found: &mut Found<'_, Fit>| {
        if widen == Widen::Never {
            each_sum(tile, neighbors, &wanted, found);
        } else {
            let mut search = Search::default();
            tile.for_some_queries(neighbors, &mut search, &wanted, |id, point, query| {
                let fit = query.map(|mut query| fit_in_tile(&mut query, neighbors, widen));
                found(id, point, fit.transpose().map(Option::flatten));
            });
        }
    };
    let in_store = |cache: &mut PageCache, id: u32, point: Point| {
        fit_in_store(store, cache, id, point, neighbors, widen)
    };
    each_found(store, ids, &wanted, look, in_store, each)
}

/// A tile in which planes through exactly the nearest neighbours, or these neighbours, can be requested
/// repeatedly.
pub(super) struct Planes<'a> {
    store: &'a PointStore,
    tile: Tile,
    neighbors: usize,
}

impl<'a> Planes<'a> {
    /// Loads the tile of the points `ids`, for planes through `neighbors` neighbours.
    pub fn load(store: &'a PointStore, ids: Range<usize>, neighbors: usize) -> Result<Self> {
        Ok(Self {
            store,
            tile: Tile::load(store, ids)?,
            neighbors,
        })
    }

    /// Calls `each` with the plane of every point whose id is `wanted`.
    pub fn each(
        &self,
        wanted: impl Fn(usize) -> bool,
        mut each: impl FnMut(usize, Point, Fit),
    ) -> Result<()> {
        let look = |tile: &Tile, found: &mut Found<'_, Fit>| {
            each_sum(tile, self.neighbors, &wanted, found);
        };
        let uncertain = look_in_tile(&self.tile, look, &mut each)?;
        let in_store = |cache: &mut PageCache, id: u32, point: Point| {
            fit_in_store(self.store, cache, id, point, self.neighbors, Widen::Never)
        };
        look_in_store(&uncertain, in_store, each)
    }

    /// Calls `each` with the value of `of` for the neighbours of every point whose id is `wanted`.
    pub fn each_neighborhood<T>(
        &self,
        wanted: impl Fn(usize) -> bool,
        of: impl FnMut(Point, &Neighbors) -> T,
        mut each: impl FnMut(usize, Point, T),
    ) -> Result<()> {
        let (of, count) = (RefCell::new(of), self.neighbors);
        let look = |tile: &Tile, found: &mut Found<'_, T>| {
            let mut search = Search::default();
            tile.for_some_queries(count, &mut search, wanted, |id, point, query| {
                let known = query.and_then(|mut query| {
                    let known = query.extend_to(count);
                    known.then(|| (of.borrow_mut())(point, query.near()))
                });
                found(id, point, Ok(known));
            });
        };
        let uncertain = look_in_tile(&self.tile, look, &mut each)?;
        let in_store = |cache: &mut PageCache, id: u32, point: Point| {
            let near = near_in_store(self.store, cache, id, point, count)?;
            Ok(Some((of.borrow_mut())(point, &near)))
        };
        look_in_store(&uncertain, in_store, each)
    }
}

/// Calls `found` with the planes of the `wanted` points.
fn each_sum(
    tile: &Tile,
    neighbors: usize,
    wanted: impl Fn(usize) -> bool,
    found: &mut Found<'_, Fit>,
) {
    let mut several = Several::default();
    let mut search = Search::default();
    tile.for_some_sums(
        neighbors,
        &mut search,
        wanted,
        |id, point, sums| match sums {
            Some(sums) => several.add(id, point, sums, found),
            None => found(id, point, Ok(None)),
        },
    );
    several.fit(found);
}

/// Calls `each` with the value of `of` for the neighbours of every point of a tile: at least the `count`
/// nearest, or all points if there are fewer.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`].
pub fn each_neighborhood<T>(
    store: &PointStore,
    ids: Range<usize>,
    count: usize,
    of: impl FnMut(Point, &Neighbors) -> T,
    each: impl FnMut(usize, Point, T),
) -> Result<()> {
    Planes::load(store, ids, count)?.each_neighborhood(|_| true, of, each)
}

/// Points with summed neighbours, collected until their planes are computed together.
#[derive(Default)]
struct Several {
    level: Level,
    count: usize,
    points: [(u32, Point); LANES],
    moments: [Moments; LANES],
    /// Squared distances of the last neighbours.
    lasts: [u64; LANES],
}

impl Several {
    fn add(&mut self, id: u32, point: Point, sums: &Sums, found: &mut Found<'_, Fit>) {
        self.points[self.count] = (id, point);
        self.moments[self.count] = sums.moments;
        self.lasts[self.count] = sums.last2;
        self.count += 1;
        if self.count == LANES {
            self.fit(found);
        }
    }

    /// Computes the planes and passes them on.
    fn fit(&mut self, found: &mut Found<'_, Fit>) {
        let planes = planes(self.level, &self.moments);
        for (lane, plane) in planes.into_iter().enumerate().take(self.count) {
            let (id, point) = self.points[lane];
            let (moments, last2) = (self.moments[lane], self.lasts[lane]);
            found(
                id,
                point,
                Ok(Some(Fit {
                    plane,
                    moments,
                    last2,
                    near2: last2,
                })),
            );
        }
        self.count = 0;
    }
}

/// Receives the result for a point; `None` if the tile cannot certify it.
type Found<'a, T> = dyn FnMut(u32, Point, Result<Option<T>>) + 'a;

/// Calls `each` with the result for every `wanted` point: that of `look` in the tile if it is certified, else
/// that from the whole store.
fn each_found<T>(
    store: &PointStore,
    ids: Range<usize>,
    wanted: &impl Fn(usize) -> bool,
    look: impl FnOnce(&Tile, &mut Found<'_, T>),
    in_store: impl FnMut(&mut PageCache, u32, Point) -> Result<Option<T>>,
    mut each: impl FnMut(usize, Point, T),
) -> Result<()> {
    let tile = Tile::load_some(store, ids, wanted)?;
    let uncertain = look_in_tile(&tile, look, &mut each)?;
    drop(tile);
    look_in_store(&uncertain, in_store, each)
}

/// Calls `each` with the results of `look`; returns the points that the tile cannot certify.
fn look_in_tile<T>(
    tile: &Tile,
    look: impl FnOnce(&Tile, &mut Found<'_, T>),
    mut each: impl FnMut(usize, Point, T),
) -> Result<Vec<(u32, Point)>> {
    let mut uncertain = Vec::new();
    let mut failed = None;
    look(tile, &mut |id, point, found| match found {
        Ok(Some(found)) => each(id as usize, point, found),
        Ok(None) => uncertain.push((id, point)),
        Err(error) => failed = Some(error),
    });
    failed.map_or(Ok(uncertain), Err)
}

/// Calls `each` with the results for these points from the whole store.
fn look_in_store<T>(
    points: &[(u32, Point)],
    mut in_store: impl FnMut(&mut PageCache, u32, Point) -> Result<Option<T>>,
    mut each: impl FnMut(usize, Point, T),
) -> Result<()> {
    let mut cache = PageCache::default();
    for &(id, point) in points {
        if let Some(found) = in_store(&mut cache, id, point)? {
            each(id as usize, point, found);
        }
    }
    Ok(())
}
