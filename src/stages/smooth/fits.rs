//! The planes and the neighbours of the points of a tile, as smoothing and relaxing need them.

use crate::error::Result;
use crate::geom::Point;
use crate::stages::cells::{Fit, Widen, fit_in_store, fit_in_tile, near_in_store};
use crate::stages::order::PointStore;
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::{Query, Search};
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

/// Calls `each` with the plane of every point of a tile whose id is `wanted`, of exactly the
/// `neighbors` nearest or as a cell has it.
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
    let in_tile = |query: &mut Query<'_>, _: Point| fit_in_tile(query, neighbors, widen);
    let in_store = |cache: &mut PageCache, id: u32, point: Point| {
        fit_in_store(store, cache, id, point, neighbors, widen)
    };
    each_found(store, ids, neighbors, wanted, in_tile, in_store, each)
}

/// Calls `each` with what `of` makes of the neighbours of every point of a tile: at least the `count`
/// nearest, or all there are.
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
    let of = RefCell::new(of);
    let in_tile = |query: &mut Query<'_>, point: Point| {
        let known = query.extend_to(count);
        Ok(known.then(|| (of.borrow_mut())(point, query.near())))
    };
    let in_store = |cache: &mut PageCache, id: u32, point: Point| {
        let near = near_in_store(store, cache, id, point, count)?;
        Ok(Some((of.borrow_mut())(point, &near)))
    };
    each_found(store, ids, count, |_| true, in_tile, in_store, each)
}

/// Calls `each` with what is found around every `wanted` point: in the tile if that knows enough, else
/// in the whole store.
fn each_found<T>(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    wanted: impl Fn(usize) -> bool,
    mut in_tile: impl FnMut(&mut Query<'_>, Point) -> Result<Option<T>>,
    mut in_store: impl FnMut(&mut PageCache, u32, Point) -> Result<Option<T>>,
    mut each: impl FnMut(usize, Point, T),
) -> Result<()> {
    let tile = Tile::load_some(store, ids, &wanted)?;
    let mut search = Search::default();
    let mut uncertain = Vec::new();
    let mut failed = None;
    tile.for_some_queries(neighbors, &mut search, wanted, |id, point, query| {
        let found = query.map(|mut query| in_tile(&mut query, point));
        match found.transpose().map(Option::flatten) {
            Ok(Some(found)) => each(id as usize, point, found),
            Ok(None) => uncertain.push((id, point)),
            Err(error) => failed = Some(error),
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    drop(tile);
    let mut cache = PageCache::default();
    for (id, point) in uncertain {
        if let Some(found) = in_store(&mut cache, id, point)? {
            each(id as usize, point, found);
        }
    }
    Ok(())
}
