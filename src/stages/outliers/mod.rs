//! Outliers: points much farther from their neighbours than the points around them are from theirs (not in
//! the paper).
//!
//! The *spacing* of a point is the mean distance to its 8 nearest neighbours. A point is dropped if its
//! spacing is larger than a factor times the median of the spacings of its 64 nearest neighbours. The second
//! neighbourhood is much larger than the first, since the nearest neighbours of an outlier are often outliers
//! themselves, alone or in small clusters; the median of many is that of the surface. Where outliers are so
//! far off that even these 64 are outliers, another round finds them, after the ones nearer to the surface
//! have been dropped.

mod spacing;

use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::spill::Table;
use crate::stages::blocks::Blocks;
use crate::stages::cells::{TileRanges, near_in_store};
use crate::stages::order::{PointStore, Position, StoreWriter};
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::Search;
use crate::stages::tiles::walk::PageCache;
use crate::workspace::Workspace;
use serde::Serialize;
use spacing::{SpacingCache, Spacings};
use std::ops::Range;

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct OutlierStats {
    /// Points dropped.
    pub dropped: u64,
    /// Rounds, including the last one, which dropped nothing.
    pub rounds: u32,
}

crate::workspace::persist::persist!(OutlierStats { dropped, rounds });

/// The definition of outliers, and the division of the work.
#[derive(Debug, Clone, Copy)]
pub struct OutlierOptions {
    /// A point is an outlier if its spacing is more than this times the median around it.
    pub factor: f64,
    /// Ids in a block; has no influence on the result.
    pub block: u32,
    /// Most ids in a tile; has no influence on the result.
    pub tile: u32,
}

/// The points that are not outliers, with new ids: their ranks among themselves.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn drop_outliers(
    mut store: PointStore,
    options: OutlierOptions,
    workspace: &Workspace,
) -> Result<(PointStore, OutlierStats)> {
    let mut stats = OutlierStats::default();
    while stats.rounds < METHOD.outliers.rounds && store.len() > METHOD.outliers.nearest {
        stats.rounds += 1;
        let kept = round(&store, options, stats.rounds, workspace)?;
        let dropped = (store.len() - kept.len()) as u64;
        store = kept;
        stats.dropped += dropped;
        if dropped == 0 {
            break;
        }
    }
    Ok((store, stats))
}

fn round(
    store: &PointStore,
    options: OutlierOptions,
    number: u32,
    workspace: &Workspace,
) -> Result<PointStore> {
    let tiles = TileRanges::new(Blocks::new(store.len(), options.block), options.tile);
    let spacings = Spacings::measure(store, tiles, number, workspace)?;
    let name = format!("outliers{number}");
    let kept = Table::<Position>::create(workspace, &name, tiles.count())?;
    let bytes = |tile: usize| {
        let points = tiles.ids(tile).len();
        Tile::bytes(points) + PageCache::bytes(store) + SpacingCache::BYTES + points as u64 * 12
    };
    let work = |tile| {
        let ids = tiles.ids(tile);
        workspace.advance(ids.len() as u64);
        let points = one_tile(store, ids, options.factor, SpacingCache::new(&spacings))?;
        kept.put(tile, bytemuck::cast_slice(&points))
    };
    let step = (name, "outliers: tile");
    workspace.units(step, tiles.count(), bytes, work, |_, ()| Ok(()))?;
    let name = format!("points-kept{number}");
    StoreWriter::gather(workspace, &name, store.page_size(), &kept)
}

/// The points of a tile that are kept.
fn one_tile(
    store: &PointStore,
    ids: Range<usize>,
    factor: f64,
    mut spacings: SpacingCache<'_>,
) -> Result<Vec<Point>> {
    let around = METHOD.outliers.around.min(store.len() - 1);
    let tile = Tile::load(store, ids.clone())?;
    let mut points = Vec::with_capacity(ids.len());
    let mut stays = vec![true; ids.len()];
    let mut search = Search::default();
    let mut uncertain = Vec::new();
    let mut failed = None;
    tile.for_each_query(around, &mut search, |id, point, query| {
        points.push(point);
        let Some(query) = query else {
            uncertain.push((id, point));
            return;
        };
        let near = query.near().columns().ids[..around].iter().copied();
        match spacings.stand_out(id, near, factor) {
            Ok(out) => stays[id as usize - ids.start] = !out,
            Err(error) => failed = Some(error),
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    drop(tile);
    let mut cache = PageCache::default();
    for (id, point) in uncertain {
        let near = near_in_store(store, &mut cache, id, point, around)?;
        let near = near.iter().take(around).map(|n| n.id);
        let out = spacings.stand_out(id, near, factor)?;
        stays[id as usize - ids.start] = !out;
    }
    let mut stays = stays.into_iter();
    points.retain(|_| stays.next() == Some(true));
    Ok(points)
}

#[cfg(test)]
mod tests;
