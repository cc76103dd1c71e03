//! The pipeline's own neighbour search alone: the 30 nearest of all points, exact, with ties by id.

use crate::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_stages::order::PointStore;
use outcrop_stages::tiles::Tile;
use outcrop_stages::tiles::near::Search;
use outcrop_stages::tiles::walk::{PageCache, Walk};
use std::ops::Range;
use std::sync::Mutex;
use std::time::Instant;

/// Neighbours per query, without the query itself.
const NEIGHBORS: usize = 30;

/// Points per tile, as in the pipeline.
const TILE: usize = 1 << 16;

/// Seconds for all points, read from the ordered store tile by tile.
pub fn time(store: &PointStore, workspace: &Workspace) -> Result<f64> {
    let start = Instant::now();
    let total = Mutex::new(0.0);
    let tiles = store.len().div_ceil(TILE);
    let bytes = |_| Tile::estimate(TILE) + PageCache::estimate(store);
    workspace.for_each_unit("neighbors: tile", tiles, bytes, |unit| {
        let tile = unit.number();
        let ids = tile * TILE..((tile + 1) * TILE).min(store.len());
        let sum = one_tile(store, ids)?;
        if let Ok(mut total) = total.lock() {
            *total += sum;
        }
        Ok(())
    })?;
    let seconds = start.elapsed().as_secs_f64();
    // The sum prevents the compiler from removing the queries.
    if !total.into_inner()?.is_finite() {
        return Err("the neighbours' distances are not finite".into());
    }
    Ok(seconds)
}

/// The sum of all points' distances to their last neighbour.
fn one_tile(store: &PointStore, ids: Range<usize>) -> outcrop::Result<f64> {
    let tile = Tile::load(store, ids)?;
    let mut sum = 0.0;
    let mut uncertain = Vec::new();
    tile.for_each_query(
        NEIGHBORS,
        &mut Search::default(),
        |_| (),
        |id, point, query| match query.and_then(|q| q.near().get(NEIGHBORS - 1)) {
            Some(last) => sum += (last.distance2 as f64).sqrt(),
            None => uncertain.push((id, point)),
        },
    );
    let mut cache = PageCache::default();
    for (id, point) in uncertain {
        let mut walk = Walk::new(store, &mut cache, id, point);
        let mut last = None;
        for _ in 0..NEIGHBORS {
            last = walk.advance()?.or(last);
        }
        sum += last.map_or(0.0, |near| (near.distance2 as f64).sqrt());
    }
    Ok(sum)
}
