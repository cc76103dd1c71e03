//! The spacings of all points, in a file by tile.

use crate::error::Result;
use crate::method::METHOD;
use crate::spill::{Table, row};
use crate::stages::cells::TileRanges;
use crate::stages::order::PointStore;
use crate::stages::tiles::Tile;
use crate::stages::tiles::near::Search;
use crate::stages::tiles::walk::{PageCache, Walk};
use crate::workspace::Workspace;
use crate::workspace::memory::Holding;
use rustc_hash::FxHashMap;
use std::ops::Range;

row! {
    /// The mean distance of a point to its nearest neighbours.
    pub struct Spacing {
        /// The bits of an `f32`.
        bits: u32,
    }
    unpacked
}

/// The mean distances of all points to their nearest neighbours.
#[derive(Debug)]
pub(super) struct Spacings {
    tiles: TileRanges,
    sections: Table<Spacing>,
}

impl Spacings {
    /// Measures all spacings. There must be more points than the neighbours used for a spacing.
    pub(super) fn measure(
        store: &PointStore,
        tiles: TileRanges,
        round: u32,
        workspace: &Workspace,
    ) -> Result<Self> {
        let name = format!("spacings{round}");
        let sections = Table::create(workspace, &name, tiles.count())?;
        let bytes = |tile: usize| {
            let points = tiles.ids(tile).len();
            Tile::bytes(points) + PageCache::bytes(store) + points as u64 * 4
        };
        let work = |tile| sections.put(tile, &one_tile(store, tiles.ids(tile))?);
        let name = (name, "outliers: spacings");
        workspace.units(name, tiles.count(), bytes, work, |_, ()| Ok(()))?;
        Ok(Self { tiles, sections })
    }
}

fn one_tile(store: &PointStore, ids: Range<usize>) -> Result<Vec<Spacing>> {
    let tile = Tile::load(store, ids.clone())?;
    let mut spacings = vec![Spacing::default(); ids.len()];
    let mut search = Search::default();
    let mut uncertain = Vec::new();
    let nearest = METHOD.outliers.nearest;
    tile.for_each_query(nearest, &mut search, |id, point, query| match query {
        Some(query) => {
            let near = query.near().columns().distances2[..nearest].iter();
            spacings[id as usize - ids.start] = mean(near.copied());
        }
        None => uncertain.push((id, point)),
    });
    drop(tile);
    let mut cache = PageCache::default();
    for (id, point) in uncertain {
        let mut near = Vec::with_capacity(nearest);
        let mut walk = Walk::new(store, &mut cache, id, point);
        for _ in 0..nearest {
            near.push(walk.advance()?.map_or(0, |n| n.distance2));
        }
        spacings[id as usize - ids.start] = mean(near.into_iter());
    }
    Ok(spacings)
}

/// Mean of the distances, summed nearest first so that rounding is reproducible.
fn mean(distances2: impl Iterator<Item = u64>) -> Spacing {
    let sum: f64 = distances2.map(|d2| (d2 as f64).sqrt()).sum();
    let bits = ((sum / METHOD.outliers.nearest as f64) as f32).to_bits();
    Spacing { bits }
}

/// A cache of sections of spacings.
#[derive(Debug)]
pub(super) struct SpacingCache<'a> {
    spacings: &'a Spacings,
    sections: FxHashMap<u32, Vec<Spacing>>,
    held: usize,
    around: Vec<u32>,
    taken: Holding,
}

impl<'a> SpacingCache<'a> {
    /// Most spacings held; one more section of any size may be added.
    const HELD: usize = 1 << 20;

    /// Bytes of a full cache: one section, of at most a block, more than it holds.
    pub(super) const BYTES: u64 = 4 * (Self::HELD as u64 + (1 << 16)) + (1 << 16);

    pub(super) fn new(spacings: &'a Spacings) -> Self {
        Self {
            spacings,
            sections: FxHashMap::default(),
            held: 0,
            around: Vec::new(),
            taken: Holding::default(),
        }
    }

    /// The bits of the spacing of a point. Spacings are not negative, so their bits are ordered like their
    /// values.
    fn get(&mut self, id: u32) -> Result<u32> {
        let tiles = &self.spacings.tiles;
        let tile = tiles.of(id);
        let place = id as usize - tiles.ids(tile as usize).start;
        if let Some(section) = self.sections.get(&tile) {
            return Ok(section[place].bits);
        }
        if self.held >= Self::HELD {
            // Queries come in curve order, so the old sections are soon no longer needed.
            self.sections.clear();
            self.held = 0;
        }
        let section = self.spacings.sections.get(tile as usize)?;
        let found = section[place].bits;
        self.held += section.len();
        self.taken.set(4 * self.held as u64);
        self.sections.insert(tile, section);
        Ok(found)
    }

    /// True if the spacing of a point is larger than `factor` times the median of the spacings `around` it.
    pub(super) fn stand_out(
        &mut self,
        id: u32,
        around: impl Iterator<Item = u32>,
        factor: f64,
    ) -> Result<bool> {
        let mut found = std::mem::take(&mut self.around);
        found.clear();
        for other in around {
            found.push(self.get(other)?);
        }
        let own = f64::from(f32::from_bits(self.get(id)?));
        let middle = found.len() / 2;
        let out = middle < found.len() && {
            let (_, median, _) = found.select_nth_unstable(middle);
            own > factor * f64::from(f32::from_bits(*median))
        };
        self.around = found;
        Ok(out)
    }
}
