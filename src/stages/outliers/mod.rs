//! Outliers: points much farther from their neighbours than the points around them are from theirs (not in
//! the paper).
//!
//! The *spacing* of a point is the mean distance to its 8 nearest neighbours. A point is dropped if its
//! spacing is larger than a factor times the median of the spacings of its 60 nearest neighbours. The second
//! neighbourhood is much larger than the first, since the nearest neighbours of an outlier are often outliers
//! themselves, alone or in small clusters; the median of many is that of the surface. Where outliers are so
//! far off that even these 60 are outliers, another round finds them, after the ones nearer to the surface
//! have been dropped.

mod spacing;

use crate::blocks::Blocks;
use crate::cells::{TileRanges, each_neighborhood};
use crate::ids::Id;
use crate::order::{PointStore, Position, StoreWriter, StoredPoints};
use crate::tiles::Tile;
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::PageCache;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;
use serde::{Deserialize, Serialize};
use spacing::{SpacingCache, Spacings};
use std::ops::Range;

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OutlierStats {
    /// Points dropped.
    pub dropped: u64,
    /// Rounds, including the last one, which dropped nothing.
    pub rounds: u32,
}

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

/// The points that are not outliers, with new ids: their ranks among themselves. Deletes the file of the
/// input, unless no point is an outlier.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn drop_outliers(
    mut stored: StoredPoints,
    options: OutlierOptions,
    workspace: &Workspace,
) -> Result<(StoredPoints, OutlierStats)> {
    let mut stats = OutlierStats::default();
    while stats.rounds < METHOD.outliers.rounds && stored.len() > METHOD.noise.nearest {
        stats.rounds += 1;
        let store = stored.open(workspace)?;
        let kept = round(&store, options, stats.rounds, workspace)?;
        drop(store);
        let dropped = (stored.len() - kept.len()) as u64;
        if dropped == 0 {
            kept.release(workspace)?;
            break;
        }
        stats.dropped += dropped;
        std::mem::replace(&mut stored, kept).release(workspace)?;
    }
    Ok((stored, stats))
}

fn round(
    store: &PointStore,
    options: OutlierOptions,
    number: u32,
    workspace: &Workspace,
) -> Result<StoredPoints> {
    let tiles = TileRanges::new(Blocks::new(store.len(), options.block), options.tile);
    let spacings = Spacings::measure(store, tiles, number, workspace)?;
    let name = format!("outliers{number}");
    let kept = Table::<Position>::new(&name, tiles.count());
    let bytes = |tile: usize| {
        let points = tiles.ids(tile).len();
        let of_points = Tile::estimate(points) + points as u64 * 12;
        of_points + PageCache::estimate(store) + SpacingCache::BYTES
    };
    let work = |unit: &Unit<'_>| {
        let tile = unit.number();
        let ids = tiles.ids(tile);
        unit.advance(ids.len() as u64);
        let cache = SpacingCache::new(unit, &spacings);
        let points = one_tile(unit, store, ids, options.factor, cache)?;
        kept.put(unit, tile, bytemuck::cast_slice(&points))
    };
    let step = (name, "outliers: tile");
    workspace.units(step, tiles.count(), bytes, work, |_, ()| Ok(()))?;
    spacings.release(workspace)?;
    let name = format!("points-kept{number}");
    let gathered = StoreWriter::gather(workspace, &name, store.page_size(), &kept)?;
    kept.release(workspace)?;
    Ok(gathered)
}

/// The points of a tile that are kept.
fn one_tile(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    factor: f64,
    mut spacings: SpacingCache<'_>,
) -> Result<Vec<Point>> {
    // As many as a curved surface has: most are on the surface.
    let around = METHOD.plane.neighbors * METHOD.smoothing.neighbors;
    let count = around.min(store.len() - 1);
    let mut kept = vec![None; ids.len()];
    let mut failed = Ok(());
    let of = |id, near: &Neighbors| {
        let around = near.columns().ids[..count].iter();
        let out = spacings.stand_out(id, around.map(|id| Id::new(*id)), factor);
        out.unwrap_or_else(|error| {
            failed = Err(error);
            false
        })
    };
    each_neighborhood(unit, store, ids.clone(), count, of, |id, point, out| {
        kept[id - ids.start] = (!out).then_some(point);
    })?;
    failed?;
    Ok(kept.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests;
