//! Restricted Voronoi cells of all points, tile by tile (paper, sections 3.3 and 3.4).

mod cell;
mod fold;

pub use cell::{
    CellMaker, DiskRadius, Fit, Outcome, Widen, fit_in_store, fit_in_tile, near_in_store,
};

use crate::error::Result;
use crate::geom::Point;
use crate::spill::{Id, Shuffle, Table, row};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::spacing::Density;
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::Search;
use crate::stages::tiles::walk::PageCache;
use crate::workspace::Workspace;
use crate::workspace::memory::hold;
use crate::workspace::persist::persist;
use fold::TileTriples;
use serde::Serialize;
use std::ops::Range;

/// Bytes reserved for sorting the triples that are sent to other tiles.
const SHUFFLE_BUFFER: u64 = 16 << 20;

row! {
    /// A triple of ids, ascending, and the number of cells that see it.
    pub struct CountedTriple {
        /// Ids, ascending.
        triple: [u32; 3],
        /// Cells, 1 to 3.
        count: u32,
    }
    packed Above Rising Rising Above
}

row! {
    /// A counted triple that is sent to a tile or a block.
    pub struct SentTriple {
        /// Number of the tile or block.
        to: u32,
        /// Ids, ascending.
        triple: [u32; 3],
        /// Cells, 1 to 3.
        count: u32,
    }
    packed Above Above Rising Rising Above
}

/// The triples seen by cells, sorted, by the tile of their smallest vertex.
#[derive(Debug)]
pub struct CellTriples {
    /// Division into tiles.
    pub tiles: TileRanges,
    /// Triples of the tile's own cells.
    pub own: Table<CountedTriple>,
    /// Triples seen by the cells of later tiles.
    pub received: Table<SentTriple>,
    /// Points off the surface of their neighbours, ascending, by tile.
    pub off: Table<Id>,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct CellStats {
    /// Cells not certified by the halo of their tile, which were computed from the whole store.
    pub second_looks: u64,
    /// Points without a plane: all their neighbours are on one line.
    pub no_plane: u64,
    /// Points off the surface of their neighbours; they are not in the mesh.
    pub off_surface: u64,
    /// Corners of cells, i.e. triples with repetitions.
    pub raw_triples: u64,
}

/// Tiles: ranges of at most `size` ids, none of which crosses the boundary of a block.
#[derive(Debug, Clone, Copy)]
pub struct TileRanges {
    blocks: Blocks,
    block: u32,
    size: u32,
    per_block: u32,
}

impl TileRanges {
    /// Divides each block into tiles of at most `size` points.
    #[must_use]
    pub fn new(blocks: Blocks, size: u32) -> Self {
        let block = blocks.ids(0).end.max(1);
        let size = size.clamp(1, block);
        Self {
            blocks,
            block,
            size,
            per_block: block.div_ceil(size),
        }
    }

    /// Largest number of points in a tile.
    #[must_use]
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Number of tiles.
    #[must_use]
    pub fn count(&self) -> usize {
        let points = self.blocks.points();
        if points == 0 {
            0
        } else {
            self.of(points as u32 - 1) as usize + 1
        }
    }

    /// The tile of an id.
    #[must_use]
    pub fn of(&self, id: u32) -> u32 {
        self.blocks.of(id) * self.per_block + id % self.block / self.size
    }

    /// The ids of a tile.
    #[must_use]
    pub fn ids(&self, tile: usize) -> Range<usize> {
        let block = self.blocks.ids(tile / self.per_block as usize);
        let start = block.start + tile as u32 % self.per_block * self.size;
        start as usize..(start.saturating_add(self.size)).min(block.end) as usize
    }

    /// The tiles of a block.
    #[must_use]
    pub fn of_block(&self, block: usize) -> Range<usize> {
        let start = block * self.per_block as usize;
        start..(start + self.per_block as usize).min(self.count())
    }
}

persist!(CellTriples {
    tiles,
    own,
    received,
    off
});
persist!(CellStats {
    second_looks,
    no_plane,
    off_surface,
    raw_triples
});
persist!(TileRanges {
    blocks,
    block,
    size,
    per_block
});

/// Computes all cells and collects their triples.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn cells(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    radius: DiskRadius,
    widen: Widen,
    density: Option<Density<'_>>,
    workspace: &Workspace,
) -> Result<(CellTriples, CellStats)> {
    let own = Table::create(workspace, "cells.own", tiles.count())?;
    let off = Table::create(workspace, "cells.off", tiles.count())?;
    let shuffle = Shuffle::between_units(workspace, "cells.sent", SHUFFLE_BUFFER, tiles.count())?;
    let bytes = |tile: usize| {
        let points = tiles.ids(tile).len() as u64;
        Tile::bytes(points as usize) + PageCache::bytes(store) + TileTriples::bytes(points as usize)
    };
    let work = |tile| {
        let ids = tiles.ids(tile);
        let mut seen = TileTriples::new(ids.clone());
        let mut maker = CellMaker::new(neighbors, radius, widen, density);
        let (mut stats, mut no_cell) =
            one_tile(store, ids.clone(), neighbors, &mut maker, &mut seen)?;
        no_cell.sort_unstable();
        off.put(tile, &no_cell)?;
        stats.raw_triples = seen.len() as u64;
        let (kept, sent) = seen.fold(&tiles);
        let _held = hold((size_of_val(&*kept) + size_of_val(&*sent)) as u64);
        own.put(tile, &kept)?;
        shuffle.send_from(tile, &sent)?;
        workspace.advance(ids.len() as u64);
        Ok(stats)
    };
    let mut stats = CellStats::default();
    workspace.units("cells: tile", tiles.count(), bytes, work, |_, more| {
        stats.second_looks += more.second_looks;
        stats.no_plane += more.no_plane;
        stats.off_surface += more.off_surface;
        stats.raw_triples += more.raw_triples;
        Ok(())
    })?;
    let received = shuffle.deliver(workspace, tiles.count())?;
    Ok((
        CellTriples {
            tiles,
            own,
            received,
            off,
        },
        stats,
    ))
}

fn one_tile(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    maker: &mut CellMaker<'_>,
    seen: &mut TileTriples,
) -> Result<(CellStats, Vec<Id>)> {
    let tile = Tile::load(store, ids)?;
    let mut search = Search::default();
    let mut uncertain: Vec<(u32, Point)> = Vec::new();
    let mut no_plane = 0;
    let mut off = Vec::new();
    let mut failed = None;
    tile.for_each_query(neighbors, &mut search, |id, point, query| {
        let outcome = match query {
            None => Ok(Outcome::Uncertain),
            Some(mut query) => maker.from_tile(&mut query, |a, b| seen.see(id, a, b)),
        };
        match outcome {
            Ok(Outcome::Complete) => {}
            Ok(Outcome::NoPlane) => no_plane += 1,
            Ok(Outcome::OffSurface) => off.push(Id { id }),
            Ok(Outcome::Uncertain) => uncertain.push((id, point)),
            Err(error) => failed = Some(error),
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    // The list has grown beside the tile and the search.
    seen.report_usage(0);
    drop(tile);
    let mut cache = PageCache::default();
    for &(id, point) in &uncertain {
        let each = |a, b| seen.see(id, a, b);
        match maker.from_store(store, &mut cache, id, point, each)? {
            Outcome::NoPlane => no_plane += 1,
            Outcome::OffSurface => off.push(Id { id }),
            Outcome::Complete | Outcome::Uncertain => {}
        }
    }
    let stats = CellStats {
        second_looks: uncertain.len() as u64,
        no_plane,
        off_surface: off.len() as u64,
        raw_triples: 0,
    };
    Ok((stats, off))
}
