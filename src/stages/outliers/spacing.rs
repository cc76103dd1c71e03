//! The spacings of all points, in a file by tile.

use crate::cells::{TileRanges, each_neighborhood};
use crate::ids::{Id, TileNumber};
use crate::order::PointStore;
use crate::tiles::Tile;
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::PageCache;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, release, row};
use outcrop_disk::workspace::memory::Holding;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_paper::method::METHOD;
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

release!(Spacings: sections);

impl Spacings {
    /// Measures all spacings. There must be more points than the neighbours used for a spacing.
    pub(super) fn measure(
        store: &PointStore,
        tiles: TileRanges,
        round: u32,
        workspace: &Workspace,
    ) -> Result<Self> {
        let name = format!("spacings{round}");
        let sections = Table::new(&name, tiles.count());
        let bytes = |tile: usize| {
            let points = tiles.ids(tile).len();
            Tile::estimate(points) + PageCache::estimate(store) + points as u64 * 4
        };
        let work = |unit: &Unit<'_>| {
            let tile = unit.number();
            sections.put(unit, tile, &one_tile(unit, store, tiles.ids(tile))?)
        };
        let name = (name, "outliers: spacings");
        workspace.units(name, tiles.count(), bytes, work, |_, ()| Ok(()))?;
        Ok(Self { tiles, sections })
    }
}

fn one_tile(unit: &Unit<'_>, store: &PointStore, ids: Range<usize>) -> Result<Vec<Spacing>> {
    let mut spacings = vec![Spacing::default(); ids.len()];
    let count = METHOD.noise.nearest;
    let of = |_, near: &Neighbors| mean(&near.columns().distances2[..count]);
    each_neighborhood(unit, store, ids.clone(), count, of, |id, _, spacing| {
        spacings[id - ids.start] = *spacing;
    })?;
    Ok(spacings)
}

/// Mean of the distances, summed nearest first so that rounding is reproducible.
fn mean(distances2: &[u64]) -> Spacing {
    let sum: f64 = distances2.iter().map(|&d2| (d2 as f64).sqrt()).sum();
    let bits = ((sum / METHOD.noise.nearest as f64) as f32).to_bits();
    Spacing { bits }
}

/// A cache of sections of spacings.
#[derive(Debug)]
pub(super) struct SpacingCache<'a> {
    unit: &'a Unit<'a>,
    spacings: &'a Spacings,
    sections: FxHashMap<TileNumber, Vec<Spacing>>,
    held: usize,
    around: Vec<u32>,
    taken: Holding<'a>,
}

impl<'a> SpacingCache<'a> {
    /// Most spacings held; one more section of any size may be added.
    const HELD: usize = 1 << 20;

    /// Bytes of a full cache: one section, of at most a block, more than it holds.
    pub(super) const BYTES: u64 = 4 * (Self::HELD as u64 + (1 << 16)) + (1 << 16);

    pub(super) fn new(unit: &'a Unit<'_>, spacings: &'a Spacings) -> Self {
        Self {
            unit,
            spacings,
            sections: FxHashMap::default(),
            held: 0,
            around: Vec::new(),
            taken: unit.hold(0),
        }
    }

    /// The bits of the spacing of a point. Spacings are not negative, so their bits are ordered like their
    /// values.
    fn get(&mut self, id: Id) -> Result<u32> {
        let tiles = &self.spacings.tiles;
        let tile = tiles.of(id);
        let place = id.index() - tiles.ids(tile.index()).start;
        if let Some(section) = self.sections.get(&tile) {
            return Ok(section[place].bits);
        }
        if self.held >= Self::HELD {
            // Queries come in curve order, so the old sections are soon no longer needed.
            self.sections.clear();
            self.held = 0;
        }
        let section = self.spacings.sections.get(self.unit, tile.index())?;
        let found = section[place].bits;
        self.held += section.len();
        self.taken.set(4 * self.held as u64);
        self.sections.insert(tile, section);
        Ok(found)
    }

    /// True if the spacing of a point is larger than `factor` times the median of the spacings `around` it.
    pub(super) fn stand_out(
        &mut self,
        id: Id,
        around: impl Iterator<Item = Id>,
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
