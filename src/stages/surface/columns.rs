//! The highest point of each vertical column of space.
//!
//! At the highest point the surface faces up: ground, roofs, tree crowns, and the outside of any closed body.
//! A column has a square base; there is about one for every 64 points.

use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::spill::{Id, Table};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::workspace::Unit;
use crate::workspace::memory::bytes_of;
use std::sync::atomic::{AtomicU64, Ordering};

/// Division of a cloud's bounding box into columns.
#[derive(Debug, Clone, Copy)]
struct Columns {
    origin: [i32; 2],
    /// Binary logarithm of the side of a column.
    shift: u32,
    wide: usize,
    deep: usize,
}

impl Columns {
    /// The narrowest columns of which there are not more than one for a fixed number of points.
    fn of(store: &PointStore) -> Self {
        let bounds = store.bounds();
        let origin = [bounds.min[0], bounds.min[1]];
        let extent =
            [0, 1].map(|axis| (i64::from(bounds.max[axis]) - i64::from(bounds.min[axis])) as u64);
        let most = (store.len() as u64 / METHOD.orientation.column).max(1);
        let count = |shift: u32| extent.map(|e| (e >> shift) + 1);
        let fits = |shift: &u32| {
            let [wide, deep] = count(*shift);
            wide * deep <= most
        };
        let shift = (0..32).find(fits).unwrap_or(32);
        let [wide, deep] = count(shift).map(|n| n as usize);
        Self {
            origin,
            shift,
            wide,
            deep,
        }
    }

    fn at(&self, p: Point) -> usize {
        let [x, y] = [0, 1].map(|axis| ((p[axis] - self.origin[axis]) as usize) >> self.shift);
        y * self.wide + x
    }
}

/// For each block, the ids of its points that are the highest of their columns, ascending; of equally high
/// points the one with the smallest id.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn highest(store: &PointStore, blocks: Blocks, unit: &Unit<'_>) -> Result<Table<Id>> {
    let columns = Columns::of(store);
    let count = columns.wide * columns.deep;
    let reserved = unit.reserve("columns", 8 * count as u64)?;
    // The height is in the upper half of the word, so that a larger word is higher; in the lower half a
    // smaller id gives a larger value.
    let highest: Vec<AtomicU64> = (0..count).map(|_| AtomicU64::new(0)).collect();
    let bytes = |block: usize| 12 * blocks.ids(block).len() as u64;
    unit.for_each_unit("columns: block", blocks.count(), bytes, |unit| {
        let ids = blocks.ids(unit.number());
        let points = store.slice(ids.start as usize..ids.end as usize)?;
        let _held = unit.hold(bytes_of(&points));
        for (id, p) in ids.zip(&points) {
            let place = (p[2] as u64) << 32 | u64::from(!id);
            let highest = &highest[columns.at(*p)];
            // Most points are not.
            if place > highest.load(Ordering::Relaxed) {
                highest.fetch_max(place, Ordering::Relaxed);
            }
        }
        Ok(())
    })?;
    let places = highest.iter().map(|place| place.load(Ordering::Relaxed));
    let places = places.filter(|place| *place != 0);
    let mut ids: Vec<u32> = places.map(|place| !(place as u32)).collect();
    drop((highest, reserved));
    let _held = unit.reserve("columns", bytes_of(&ids))?;
    ids.sort_unstable();
    let sections = Table::new("stitch.highest", blocks.count());
    for part in ids.chunk_by(|a, b| blocks.of(*a) == blocks.of(*b)) {
        let block = blocks.of(part[0]) as usize;
        sections.put(unit, block, bytemuck::cast_slice(part))?;
    }
    Ok(sections)
}
