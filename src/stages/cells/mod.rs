//! Restricted Voronoi cells of all points, tile by tile (paper, sections 3.3 and 3.4).

mod cell;
mod directions;
mod fit;
mod fits;
mod fold;
mod together;

pub use cell::{CellMaker, DiskRadius, Outcome};
pub use directions::{DiskStats, InputDirections};
pub use fit::{Fit, Widen, fit_in_tile};
pub(crate) use fits::{Among, Planes, each_around};
pub use fits::{each_neighborhood, each_plane};

use crate::blocks::Blocks;
use crate::ids::{Id, Ids, TileNumber, Triangle, Width};
use crate::levels::Levels;
use crate::order::PointStore;
use crate::spacing::Density;
use crate::tiles::Tile;
use crate::tiles::near::Search;
use crate::tiles::walk::PageCache;
use directions::Directions;
use fold::TileTriples;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, Table, release, row};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use serde::{Deserialize, Serialize};
use std::ops::Range;

row! {
    /// A triple of ids, ascending, and the number of cells that see it.
    pub struct CountedTriple {
        /// Ids, ascending.
        triple: Triangle,
        /// Cells, 1 to 3.
        count: u32,
    }
    packed Above Rising Rising Above
}

row! {
    /// A counted triple that is sent to a tile.
    pub struct SentTriple {
        /// Number of the tile.
        to: TileNumber,
        /// Ids, ascending.
        triple: Triangle,
        /// Cells, 1 to 3.
        count: u32,
    }
    packed Above Above Rising Rising Above
}

/// The triples seen by cells, sorted, by the tile of their smallest vertex.
#[derive(Debug, Serialize, Deserialize)]
pub struct CellTriples {
    /// Division into tiles.
    pub tiles: TileRanges,
    /// Triples of the tile's own cells.
    pub own: Table<CountedTriple>,
    /// Triples sent to each tile by the cells of later tiles.
    pub sent: Shuffle<SentTriple>,
    /// Points off the surface of their neighbours, ascending, by tile.
    pub off: Table<Id>,
}

release!(CellTriples: own, sent, off);

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct CellStats {
    /// Cells not certified by the halo of their tile, which were computed from the whole store.
    pub global_fallbacks: u64,
    /// Points without a plane: all their neighbours are on one line.
    pub no_plane: u64,
    /// Points off the surface of their neighbours; they are not in the mesh.
    pub off_surface: u64,
    /// Corners of cells, i.e. triples with repetitions.
    pub raw_triples: u64,
}

/// Tiles: ranges of at most `size` ids, none of which crosses the boundary of a block.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct TileRanges {
    blocks: Blocks,
    block: Width,
    size: u32,
    per_block: u32,
}

impl TileRanges {
    /// Divides each block into tiles of at most `size` points.
    #[must_use]
    pub fn new(blocks: Blocks, size: u32) -> Self {
        let block = blocks.ids(0).end.get().max(1);
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
        let last = self.blocks.points().checked_sub(1);
        last.map_or(0, |last| self.of(Id::at(last)).index() + 1)
    }

    /// The tile of an id.
    #[must_use]
    pub fn of(&self, id: Id) -> TileNumber {
        let inside = id.get() % self.block / self.size;
        TileNumber::new(self.blocks.of(id).get() * self.per_block + inside)
    }

    /// The ids of a tile.
    #[must_use]
    pub fn ids(&self, tile: usize) -> Range<usize> {
        let block = self.blocks.ids(tile / self.per_block as usize);
        let start = block.start.behind(tile as u32 % self.per_block * self.size);
        start.index()..start.behind(self.size).min(block.end).index()
    }

    /// The tiles of a block.
    #[must_use]
    pub fn of_block(&self, block: usize) -> Range<usize> {
        let start = block * self.per_block as usize;
        start..(start + self.per_block as usize).min(self.count())
    }
}

/// Counts of cells and of their disks.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct CellCounts {
    /// The cells.
    pub cells: CellStats,
    /// The disks of points that bring normals.
    pub disks: DiskStats,
}

/// What cells are made of, besides the points.
#[derive(Debug, Clone, Copy)]
pub struct CellOptions<'a> {
    /// Neighbours for the plane.
    pub neighbors: usize,
    /// Radius of the disk.
    pub radius: DiskRadius,
    /// When planes take more neighbours.
    pub widen: Widen,
    /// If given, points off the surface get no cell.
    pub density: Option<Density<'a>>,
    /// The normals that points bring, if they are used.
    pub directions: Option<InputDirections<'a>>,
}

/// Computes all cells and collects their triples. Also returns how coarse points are, as
/// [`coarseness`](crate::spacing::coarseness), if any is coarse.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn cells(
    store: &PointStore,
    tiles: TileRanges,
    options: CellOptions<'_>,
    workspace: &Workspace,
) -> Result<(CellTriples, Option<Levels>, CellCounts)> {
    let own = Table::new("cells.own", tiles.count());
    let off = Table::new("cells.off", tiles.count());
    let shuffle = Shuffle::new("cells.sent");
    let bytes = |tile: usize| {
        let points = tiles.ids(tile).len();
        let given = options.directions.map_or(0, |d| d.bytes(points));
        Tile::estimate(points)
            + PageCache::estimate(store)
            + TileTriples::estimate(points)
            + given
            + Levels::size(points)
    };
    let work = |unit: &Unit<'_>| {
        let tile = unit.number();
        let ids = tiles.ids(tile);
        let mut seen = TileTriples::new(ids.clone());
        let mut maker = maker(unit, &ids, options)?;
        let (of_directions, _) = maker.of_directions();
        let of_directions = unit.hold(of_directions);
        let (mut stats, mut no_cell) = one_tile(unit, store, ids.clone(), &mut maker, &mut seen)?;
        let (_, disks) = maker.of_directions();
        let coarse = maker.coarse();
        let _of_coarse = unit.hold(coarse.bytes());
        drop(of_directions);
        no_cell.sort_unstable();
        off.put(unit, tile, &no_cell)?;
        stats.raw_triples = seen.len() as u64;
        let folding = seen.fold_bytes();
        let mut held = unit.hold(seen.bytes() + folding);
        let (kept, sent) = seen.fold(&tiles);
        let folded = (size_of_val(&*kept) + size_of_val(&*sent)) as u64;
        // As it was at the end of folding.
        held.set(folding + folded);
        held.set(folded);
        own.put(unit, tile, &kept)?;
        shuffle.send(unit, tile, sent)?;
        unit.advance(ids.len() as u64);
        Ok((stats, disks, coarse))
    };
    let mut counts = CellCounts::default();
    let (stats, disks) = (&mut counts.cells, &mut counts.disks);
    let mut all_coarse: Option<Levels> = None;
    let mut held = workspace.reserve("coarse points", 0)?;
    let step = "cells: tile";
    workspace.units(
        step,
        tiles.count(),
        bytes,
        work,
        |tile, (more, of_disks, coarse): Noted| {
            if !coarse.is_empty() {
                if all_coarse.is_none() {
                    held = workspace.reserve("coarse points", Levels::size(store.len()))?;
                }
                let all = all_coarse.get_or_insert_with(|| Levels::new(store.len()));
                all.put_range(tiles.ids(tile), &coarse);
            }
            disks.add(of_disks);
            stats.global_fallbacks += more.global_fallbacks;
            stats.no_plane += more.no_plane;
            stats.off_surface += more.off_surface;
            stats.raw_triples += more.raw_triples;
            Ok(())
        },
    )?;
    drop(held);
    let triples = CellTriples {
        tiles,
        own,
        sent: shuffle,
        off,
    };
    Ok((triples, all_coarse, counts))
}

/// What a unit notes besides its triples: counts, and how coarse its points are; empty if none is.
type Noted = (CellStats, DiskStats, Levels);

/// What makes the cells of a tile.
fn maker<'a>(
    unit: &Unit<'_>,
    ids: &Range<usize>,
    options: CellOptions<'a>,
) -> Result<CellMaker<'a>> {
    let CellOptions {
        neighbors,
        radius,
        widen,
        density,
        directions,
    } = options;
    let mut maker = CellMaker::new(neighbors, radius, widen, density);
    maker.note_coarse(Ids::at(ids));
    if let Some(InputDirections { normals, wanted }) = directions {
        let given = normals.open(unit, Ids::at(ids))?;
        maker.set_directions(Directions::new(given, wanted));
    }
    Ok(maker)
}

fn one_tile(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    maker: &mut CellMaker<'_>,
    seen: &mut TileTriples,
) -> Result<(CellStats, Vec<Id>)> {
    let tile = Tile::load(store, ids)?;
    let mut held = unit.hold(tile.bytes() + seen.bytes());
    unit.give_back(tile.spare());
    let mut search = Search::default();
    let mut uncertain: Vec<(Id, Point)> = Vec::new();
    let mut no_plane = 0;
    let mut off = Vec::new();
    let mut failed = None;
    let mut searching = unit.hold(0);
    let grown = |bytes| searching.set(bytes);
    tile.for_each_group(maker.neighbors, &mut search, grown, |group| {
        let outcomes = maker.from_group(group, |id, a, b| seen.see(id, [a, b]));
        for (number, (member, outcome)) in group.members().iter().zip(outcomes).enumerate() {
            let id = member.id;
            let outcome = match outcome {
                Some(outcome) => Ok(outcome),
                None => match group.query(number) {
                    None => Ok(Outcome::Uncertain),
                    Some(mut query) => maker.from_tile(&mut query, |a, b| seen.see(id, [a, b])),
                },
            };
            match outcome {
                Ok(Outcome::Complete) => {}
                Ok(Outcome::NoPlane) => no_plane += 1,
                Ok(Outcome::OffSurface) => off.push(id),
                Ok(Outcome::Uncertain) => uncertain.push((id, member.point)),
                Err(error) => failed = Some(error),
            }
        }
    });
    if let Some(error) = failed {
        return Err(error);
    }
    // The lists have grown beside the tile.
    held.set(tile.bytes() + seen.bytes());
    drop((tile, search, searching));
    let mut cache = PageCache::default();
    for &(id, point) in &uncertain {
        let each = |a, b| seen.see(id, [a, b]);
        match maker.from_store(store, &mut cache, id, point, each)? {
            Outcome::NoPlane => no_plane += 1,
            Outcome::OffSurface => off.push(id),
            Outcome::Complete | Outcome::Uncertain => {}
        }
        held.set(cache.bytes() + seen.bytes());
    }
    let stats = CellStats {
        global_fallbacks: uncertain.len() as u64,
        no_plane,
        off_surface: off.len() as u64,
        raw_triples: 0,
    };
    Ok((stats, off))
}
