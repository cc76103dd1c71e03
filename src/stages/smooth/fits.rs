//! The planes of the points of a tile, as smoothing and relaxing need them.

use crate::error::Result;
use crate::geom::Point;
use crate::stages::cells::{Fit, fit_in_store, fit_in_tile};
use crate::stages::order::PointStore;
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::Search;
use crate::stages::tiles::walk::PageCache;
use std::ops::Range;

/// Calls `each` with the plane of every point of a tile whose id is `wanted`.
pub(super) fn each_fit(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    wanted: impl Fn(usize) -> bool,
    mut each: impl FnMut(usize, Point, Fit),
) -> Result<()> {
    let tile = Tile::load(store, ids)?;
    let mut search = Search::default();
    let mut uncertain = Vec::new();
    let mut failed = None;
    tile.for_some_queries(neighbors, &mut search, wanted, |id, point, query| {
        let fit = query.map(|mut query| fit_in_tile(&mut query, neighbors));
        match fit.transpose().map(Option::flatten) {
            Ok(Some(fit)) => each(id as usize, point, fit),
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
        if let Some(fit) = fit_in_store(store, &mut cache, id, point, neighbors)? {
            each(id as usize, point, fit);
        }
    }
    Ok(())
}
