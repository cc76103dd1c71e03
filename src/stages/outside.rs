//! Which side of the surface is out, at the points where that is known without the surface (not in the paper):
//! towards what saw them, or at the ends of columns.

use super::blocks::Blocks;
use super::columns::{Direction, extreme};
use super::order::PointStore;
use super::scanners::{Scanners, Seen};
use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::spill::{Id, Table};
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The points at the ends of columns along the three axes.
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredExtremes {
    /// Those of each direction.
    tables: Vec<Table<Id>>,
    /// True if the surface faces inwards there.
    inward: bool,
}

impl StoredExtremes {
    /// Finds them.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn of(
        store: &PointStore,
        inward: bool,
        blocks: Blocks,
        workspace: &Workspace,
    ) -> Result<Self> {
        workspace.once("extremes", |unit| {
            let find = |direction| extreme(store, direction, blocks, unit);
            let tables = Direction::ALL.map(find).into_iter();
            let tables = tables.collect::<Result<_>>()?;
            Ok(Self { tables, inward })
        })
    }

    /// Deletes the files.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.tables.iter().try_for_each(|t| t.release(workspace))
    }

    /// The directions in which each point of a block is extreme, one bit each.
    fn open(&self, unit: &Unit<'_>, block: usize, ids: &Range<u32>) -> Result<Vec<u8>> {
        let mut directions = vec![0; ids.len()];
        for (bit, table) in self.tables.iter().enumerate() {
            let extreme: Vec<u32> = bytemuck::cast_vec(table.get(unit, block)?);
            for id in extreme {
                directions[(id - ids.start) as usize] |= 1 << bit;
            }
        }
        Ok(directions)
    }

    /// The unit vector out of the surface at a point that is extreme in these directions; none if they are
    /// opposite, or if there are none.
    fn toward(&self, directions: u8) -> Option<[f64; 3]> {
        let mut sum = [0i32; 3];
        for (bit, direction) in Direction::ALL.iter().enumerate() {
            if directions >> bit & 1 == 1 {
                sum[direction.axis] += if direction.grows != self.inward {
                    1
                } else {
                    -1
                };
            }
        }
        let length = f64::from(sum.iter().map(|x| x * x).sum::<i32>()).sqrt();
        (length > 0.0).then(|| sum.map(|x| f64::from(x) / length))
    }
}

/// What tells which side is out. Where it tells nothing, the highest points face up.
#[derive(Debug, Clone, Copy)]
pub enum Outside<'a> {
    /// The scanners that saw the points.
    Scanners(Scanners<'a>),
    /// A position that the whole surface faces.
    Position([i64; 3]),
    /// The points at the ends of columns.
    Extremes(&'a StoredExtremes),
}

impl<'a> Outside<'a> {
    /// True if it says all there is to say, so that the highest points say nothing.
    #[must_use]
    pub fn is_for_all(&self) -> bool {
        !matches!(self, Self::Scanners(_))
    }

    /// Bytes of memory for `ids` points while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        match self {
            Self::Scanners(scanners) => scanners.bytes(ids),
            Self::Position(_) => 0,
            // The list of one direction beside those of all points.
            Self::Extremes(_) => 5 * ids as u64,
        }
    }

    /// Which side is out at the points of a block.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, blocks: Blocks, block: usize) -> Result<Known<'a>> {
        let ids = blocks.ids(block);
        Ok(match *self {
            Self::Scanners(scanners) => Known::Scanners(scanners.open(unit, ids)?),
            Self::Position(place) => Known::Position(place),
            Self::Extremes(stored) => Known::Extremes {
                directions: stored.open(unit, block, &ids)?,
                first: ids.start,
                stored,
            },
        })
    }
}

/// Which side is out at the points of a block.
#[derive(Debug)]
pub enum Known<'a> {
    /// The scanners that saw them.
    Scanners(Seen<'a>),
    /// A position.
    Position([i64; 3]),
    /// The points at the ends of columns.
    Extremes {
        /// The id of the first point.
        first: u32,
        /// The directions in which each point is extreme.
        directions: Vec<u8>,
        /// All of them.
        stored: &'a StoredExtremes,
    },
}

impl Known<'_> {
    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Scanners(seen) => seen.bytes(),
            Self::Position(_) => 0,
            Self::Extremes { directions, .. } => bytes_of(directions),
        }
    }

    /// True if a point of the block does not face up even where it is the highest.
    #[must_use]
    pub fn has(&self, id: u32) -> bool {
        match self {
            Self::Scanners(seen) => seen.has(id),
            Self::Position(_) | Self::Extremes { .. } => true,
        }
    }

    /// True if a point of the block is a witness, if its outer side is known: points at the ends of columns are
    /// few, of others one for a number of points is enough.
    #[must_use]
    pub fn is_sampled(&self, id: u32) -> bool {
        match self {
            Self::Extremes { .. } => true,
            _ => u64::from(id) % METHOD.orientation.column == 0,
        }
    }

    /// The unit vector out of the surface at a point of the block, at `from`; none if that is not known.
    #[must_use]
    pub fn toward(&self, id: u32, from: Point) -> Option<[f64; 3]> {
        match self {
            Self::Scanners(seen) => seen.toward(id, from),
            Self::Position(place) => super::scanners::toward(*place, from),
            Self::Extremes {
                first,
                directions,
                stored,
            } => {
                let directions = directions.get((id - first) as usize)?;
                stored.toward(*directions)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_add_up() {
        let toward = |inward, directions| {
            let tables = Vec::new();
            StoredExtremes { tables, inward }.toward(directions)
        };
        let half = 1.0 / 2f64.sqrt();
        assert_eq!(toward(false, 1 << 5), Some([0.0, 0.0, 1.0]));
        assert_eq!(toward(true, 1 << 5), Some([0.0, 0.0, -1.0]));
        assert_eq!(toward(false, 0b01_0001), Some([-half, 0.0, -half]));
        // A point alone in its column is at both ends of it.
        assert_eq!(toward(false, 0b11_0000), None);
        assert_eq!(toward(false, 0b11_1000), Some([0.0, 1.0, 0.0]));
        assert_eq!(toward(true, 0), None);
    }
}
