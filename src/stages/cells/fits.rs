//! The planes and neighbours of the points of a tile, for stages other than this one.

use super::fit::{Fit, Widen, fit_in_store, fit_in_tile, near_in_store, some_near_in_store};
use crate::ids::Id;
use crate::order::PointStore;
use crate::tiles::Tile;
use crate::tiles::near::{Around, Query, Search, Sums};
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::PageCache;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::Holding;
use outcrop_geom::Point;
use outcrop_paper::kernels::Level;
use outcrop_paper::plane::{Moments, PLANES, planes};
use std::cell::RefCell;
use std::ops::Range;

/// Calls `each` with the plane of every point of a tile whose id is `wanted`: through exactly `neighbors`
/// neighbours, or widened as for a cell.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn each_plane(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    widen: Widen,
    wanted: impl Fn(usize) -> bool,
    each: impl FnMut(usize, Point, &Fit),
) -> Result<()> {
    let planes = Planes::load(unit, store, ids, &wanted, neighbors)?;
    Planes { widen, ..planes }.each(wanted, each)
}

/// A tile in which planes through the nearest neighbours, or these neighbours, can be requested repeatedly.
pub(crate) struct Planes<'a> {
    pub unit: &'a Unit<'a>,
    store: &'a PointStore,
    tile: Tile,
    neighbors: usize,
    widen: Widen,
    _held: Holding<'a>,
}

impl<'a> Planes<'a> {
    /// Loads the tile of the points `ids`, of which only those `wanted` can be requested, for planes through
    /// exactly `neighbors` neighbours.
    pub fn load(
        unit: &'a Unit<'_>,
        store: &'a PointStore,
        ids: Range<usize>,
        wanted: impl Fn(usize) -> bool,
        neighbors: usize,
    ) -> Result<Self> {
        let tile = Tile::load_some(store, ids, wanted)?;
        unit.give_back(tile.spare());
        Ok(Self {
            unit,
            store,
            _held: unit.hold(tile.bytes()),
            tile,
            neighbors,
            widen: Widen::Never,
        })
    }

    /// Calls `each` with the plane of every point whose id is `wanted`.
    pub fn each(
        &self,
        wanted: impl Fn(usize) -> bool,
        each: impl FnMut(usize, Point, &Fit),
    ) -> Result<()> {
        let (count, widen) = (self.neighbors, self.widen);
        let in_tile = |(search, grown): Watched<'_, '_>, found: &mut Found<'_, Fit>| {
            if widen == Widen::Never {
                return each_sum(&self.tile, count, (search, grown), wanted, found);
            }
            let look = |id: Id, point: Point, query: Option<Query<'_>>| {
                let fit = query.map(|mut query| fit_in_tile(&mut query, count, widen));
                let fit = fit.transpose().map(Option::flatten);
                match fit {
                    Ok(fit) => found(id, point, Ok(fit.as_ref())),
                    Err(error) => found(id, point, Err(error)),
                }
            };
            self.tile
                .for_some_queries(count, search, wanted, grown, look);
        };
        let in_store = |cache: &mut PageCache, id: Id, point: Point| {
            let known = fit_in_store(self.store, cache, id, point, (count, 0), widen)?;
            Ok(known.map(|(fit, _)| fit))
        };
        look(self.unit, in_tile, in_store, each)
    }

    /// Calls `each` with the value of `of` for every point whose id is `wanted`: for its plane, widened as for
    /// a cell, and its neighbours, nearest first: at least the `least` nearest, or all points if there are fewer.
    pub fn each_fit<T>(
        &self,
        widen: Widen,
        least: usize,
        wanted: impl Fn(usize) -> bool,
        of: impl FnMut(Id, &Fit, &Neighbors) -> T,
        each: impl FnMut(usize, Point, &T),
    ) -> Result<()> {
        let (of, count) = (RefCell::new(of), self.neighbors);
        let in_tile = |(search, grown): Watched<'_, '_>, found: &mut Found<'_, T>| {
            let look = |id: Id, point: Point, query: Option<Query<'_>>| {
                let value = |mut query: Query<'_>| -> Result<Option<T>> {
                    let fit = fit_in_tile(&mut query, count, widen)?;
                    let enough = query.near().len() >= least || query.extend_to(least);
                    Ok(fit
                        .filter(|_| enough)
                        .map(|fit| (of.borrow_mut())(id, &fit, query.near())))
                };
                let value = query.map_or(Ok(None), value);
                match &value {
                    Ok(value) => found(id, point, Ok(value.as_ref())),
                    Err(_) => found(id, point, value.map(|_| None)),
                }
            };
            self.tile
                .for_some_queries(count, search, wanted, grown, look);
        };
        let in_store = |cache: &mut PageCache, id: Id, point: Point| {
            let counts = (count, least);
            let known = fit_in_store(self.store, cache, id, point, counts, widen)?;
            Ok(known.map(|(fit, near)| (of.borrow_mut())(id, &fit, &near)))
        };
        look(self.unit, in_tile, in_store, each)
    }

    /// Calls `each` with the value of `of` for the neighbours of every point whose id is `wanted`.
    pub fn each_neighborhood<T>(
        &self,
        wanted: impl Fn(usize) -> bool,
        of: impl FnMut(Id, &Neighbors) -> T,
        each: impl FnMut(usize, Point, &T),
    ) -> Result<()> {
        let (of, count) = (RefCell::new(of), self.neighbors);
        let in_tile = |(search, grown): Watched<'_, '_>, found: &mut Found<'_, T>| {
            let look = |id: Id, point: Point, query: Option<Query<'_>>| {
                let known = query.and_then(|mut query| {
                    let known = query.extend_to(count);
                    known.then(|| (of.borrow_mut())(id, query.near()))
                });
                found(id, point, Ok(known.as_ref()));
            };
            self.tile
                .for_some_queries(count, search, wanted, grown, look);
        };
        let in_store = |cache: &mut PageCache, id: Id, point: Point| {
            let near = near_in_store(self.store, cache, id, point, count)?;
            Ok(Some((of.borrow_mut())(id, &near)))
        };
        look(self.unit, in_tile, in_store, each)
    }
}

/// Calls `found` with the planes of the `wanted` points.
fn each_sum(
    tile: &Tile,
    neighbors: usize,
    (search, grown): Watched<'_, '_>,
    wanted: impl Fn(usize) -> bool,
    found: &mut Found<'_, Fit>,
) {
    let mut several = Several::default();
    let look = |id: Id, point: Point, sums: Option<&Sums>| match sums {
        Some(sums) => several.add(id, point, sums, found),
        None => found(id, point, Ok(None)),
    };
    tile.for_some_sums(neighbors, search, wanted, grown, look);
    several.fit(found);
}

/// Calls `each` with the value of `of` for the neighbours of every point of a tile: at least the `count`
/// nearest, or all points if there are fewer.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn each_neighborhood<T>(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    count: usize,
    of: impl FnMut(Id, &Neighbors) -> T,
    each: impl FnMut(usize, Point, &T),
) -> Result<()> {
    let all = |_| true;
    Planes::load(unit, store, ids, all, count)?.each_neighborhood(all, of, each)
}

/// Which points of a tile are looked at, and what their neighbours are.
pub(crate) struct Among<'a> {
    /// True for the points that are looked at, by their ids.
    pub wanted: &'a dyn Fn(usize) -> bool,
    /// The number of their neighbours.
    pub count: &'a dyn Fn(usize) -> usize,
    /// The largest of these numbers.
    pub most: usize,
    /// True for the points that can be neighbours, by their ids; `None` if all can.
    pub chosen: Option<&'a dyn Fn(usize) -> bool>,
}

/// Calls `each` with every point of a tile that is looked at, and its nearest neighbours, or all if there are fewer, in
/// order of id. A point that cannot be a neighbour has one more and is not among them. `each` may swap them for others.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub(crate) fn each_around(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    among: &Among<'_>,
    each: impl FnMut(usize, Point, &mut Around),
) -> Result<()> {
    let mut tile = Tile::load_some(store, ids, among.wanted)?;
    if let Some(chosen) = among.chosen {
        tile.choose(chosen);
    }
    unit.give_back(tile.spare());
    let _held = unit.hold(tile.bytes());
    let each = RefCell::new(each);
    let in_tile = |(search, grown): Watched<'_, '_>, found: &mut Found<'_, ()>| {
        let look = |id: Id, point: Point, around: Option<&mut Around>| {
            let known = around.map(|around| (each.borrow_mut())(id.index(), point, around));
            found(id, point, Ok(known.as_ref()));
        };
        tile.for_some_around((among.most, among.count), search, among.wanted, grown, look);
    };
    let mut around = Around::default();
    let in_store = |cache: &mut PageCache, id: Id, point: Point| {
        let is_chosen = |id: usize| among.chosen.is_none_or(|chosen| chosen(id));
        let count = (among.count)(id.index());
        let own = is_chosen(id.index()).then_some(id);
        let near = some_near_in_store(store, cache, (id, point), is_chosen, count + 1)?;
        around.set(&near, count, own);
        (each.borrow_mut())(id.index(), point, &mut around);
        Ok(Some(()))
    };
    look(unit, in_tile, in_store, |_, _, _| ())
}

/// Points with summed neighbours, collected until their planes are computed together.
#[derive(Default)]
struct Several {
    level: Level,
    count: usize,
    points: [(Id, Point); PLANES],
    moments: [Moments; PLANES],
    /// Squared distances of the last neighbours.
    lasts: [u64; PLANES],
}

impl Several {
    fn add(&mut self, id: Id, point: Point, sums: &Sums, found: &mut Found<'_, Fit>) {
        self.points[self.count] = (id, point);
        self.moments[self.count] = sums.moments;
        self.lasts[self.count] = sums.last2;
        self.count += 1;
        if self.count == PLANES {
            self.fit(found);
        }
    }

    /// Computes the planes and passes them on.
    fn fit(&mut self, found: &mut Found<'_, Fit>) {
        let planes = planes(self.level, &self.moments);
        for (lane, plane) in planes.into_iter().enumerate().take(self.count) {
            let (id, point) = self.points[lane];
            let (moments, last2) = (self.moments[lane], self.lasts[lane]);
            let fit = Fit::with(plane, Sums { moments, last2 });
            found(id, point, Ok(Some(&fit)));
        }
        self.count = 0;
    }
}

/// Receives the result for a point; `None` if the tile cannot certify it.
type Found<'a, T> = dyn FnMut(Id, Point, Result<Option<&T>>) + 'a;

/// A search, and the function that is told how large it has grown.
type Watched<'a, 'g> = (&'a mut Search, &'a mut (dyn FnMut(u64) + 'g));

/// Calls `each` with the results of `in_tile`, and with those of `in_store` for the points that the tile
/// cannot certify.
fn look<T>(
    unit: &Unit<'_>,
    in_tile: impl FnOnce(Watched<'_, '_>, &mut Found<'_, T>),
    mut in_store: impl FnMut(&mut PageCache, Id, Point) -> Result<Option<T>>,
    mut each: impl FnMut(usize, Point, &T),
) -> Result<()> {
    let mut uncertain = Vec::new();
    let mut failed = Ok(());
    let mut search = Search::default();
    let mut held = unit.hold(0);
    let watched: Watched<'_, '_> = (&mut search, &mut |bytes| held.set(bytes));
    in_tile(watched, &mut |id, point, found| match found {
        Ok(Some(found)) => each(id.index(), point, found),
        Ok(None) => uncertain.push((id, point)),
        Err(error) => failed = Err(error),
    });
    failed?;
    drop(search);
    let mut cache = PageCache::default();
    for (id, point) in uncertain {
        if let Some(found) = in_store(&mut cache, id, point)? {
            each(id.index(), point, &found);
        }
        held.set(cache.bytes());
    }
    Ok(())
}
