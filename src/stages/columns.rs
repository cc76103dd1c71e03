//! The extreme points of columns of space, along one axis.
//!
//! At the highest point of a vertical column the surface faces up: ground, roofs, tree crowns, and the outside of
//! any closed body. At both ends of the columns along all three axes a body faces outwards, a room inwards. A
//! column has a square base; there is about one for every 64 points.

use crate::blocks::Blocks;
use crate::ids::Id;
use crate::order::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;
use std::sync::atomic::{AtomicU64, Ordering};

/// One of the two directions along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Direction {
    /// 0 to 2 for x, y, z.
    pub axis: usize,
    /// True where coordinates grow.
    pub grows: bool,
}

impl Direction {
    /// Up.
    pub const UP: Self = Self {
        axis: 2,
        grows: true,
    };

    /// All six.
    pub const ALL: [Self; 6] = [
        Self::along(0, false),
        Self::along(0, true),
        Self::along(1, false),
        Self::along(1, true),
        Self::along(2, false),
        Self::UP,
    ];

    const fn along(axis: usize, grows: bool) -> Self {
        Self { axis, grows }
    }

    /// The name of the table of points that are extreme in this direction.
    fn table(self) -> &'static str {
        match (self.axis, self.grows) {
            (0, false) => "extreme.west",
            (0, true) => "extreme.east",
            (1, false) => "extreme.south",
            (1, true) => "extreme.north",
            (_, false) => "extreme.lowest",
            (_, true) => "extreme.highest",
        }
    }

    /// A number that is larger, the farther a point is in this direction.
    fn place(self, p: Point) -> u32 {
        // Coordinates are less than 2^30.
        let place = p[self.axis] as u32;
        if self.grows { place } else { !place }
    }
}

/// Division of a cloud's bounding box into columns along an axis.
#[derive(Debug, Clone, Copy)]
struct Columns {
    /// The axes across them.
    across: [usize; 2],
    origin: [i32; 2],
    /// Binary logarithm of the side of a column.
    shift: u32,
    wide: usize,
    deep: usize,
}

impl Columns {
    /// The narrowest columns of which there are not more than one for a fixed number of points.
    fn of(store: &PointStore, axis: usize) -> Self {
        let bounds = store.bounds();
        let across = [[1, 2], [0, 2], [0, 1]][axis];
        let origin = across.map(|axis| bounds.min[axis]);
        let extent =
            across.map(|axis| (i64::from(bounds.max[axis]) - i64::from(bounds.min[axis])) as u64);
        let most = (store.len() as u64 / METHOD.orientation.column).max(1);
        let count = |shift: u32| extent.map(|e| (e >> shift) + 1);
        let fits = |shift: &u32| {
            let [wide, deep] = count(*shift);
            wide * deep <= most
        };
        let shift = (0..32).find(fits).unwrap_or(32);
        let [wide, deep] = count(shift).map(|n| n as usize);
        Self {
            across,
            origin,
            shift,
            wide,
            deep,
        }
    }

    fn at(&self, p: Point) -> usize {
        let [x, y] = [0, 1].map(|k| ((p[self.across[k]] - self.origin[k]) as usize) >> self.shift);
        y * self.wide + x
    }
}

/// For each block, the ids of its points that are extreme in a direction in their columns along it, ascending; of
/// points equally far the one with the smallest id.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn extreme(
    store: &PointStore,
    direction: Direction,
    blocks: Blocks,
    unit: &Unit<'_>,
) -> Result<Table<Id>> {
    let columns = Columns::of(store, direction.axis);
    let count = columns.wide * columns.deep;
    let reserved = unit.reserve("columns", 8 * count as u64)?;
    // The place is in the upper half of the word, so that a farther point is a larger word; in the lower half a
    // smaller id gives a larger value.
    let farthest: Vec<AtomicU64> = (0..count).map(|_| AtomicU64::new(0)).collect();
    let bytes = |block: usize| 12 * blocks.ids(block).len() as u64;
    unit.for_each_unit("columns: block", blocks.count(), bytes, |unit| {
        let ids = blocks.ids(unit.number());
        let points = store.slice(ids.indices())?;
        let _held = unit.hold(bytes_of(&points));
        for (id, p) in ids.iter().zip(&points) {
            let place = u64::from(direction.place(*p)) << 32 | u64::from(!id.get());
            let farthest = &farthest[columns.at(*p)];
            // Most points are not.
            if place > farthest.load(Ordering::Relaxed) {
                farthest.fetch_max(place, Ordering::Relaxed);
            }
        }
        Ok(())
    })?;
    let places = farthest.iter().map(|place| place.load(Ordering::Relaxed));
    let places = places.filter(|place| *place != 0);
    let mut ids: Vec<Id> = places.map(|place| Id::new(!(place as u32))).collect();
    drop((farthest, reserved));
    let _held = unit.reserve("columns", bytes_of(&ids))?;
    ids.sort_unstable();
    let sections = Table::new(direction.table(), blocks.count());
    for part in ids.chunk_by(|a, b| blocks.of(*a) == blocks.of(*b)) {
        sections.put(unit, blocks.of(part[0]).index(), part)?;
    }
    Ok(sections)
}
