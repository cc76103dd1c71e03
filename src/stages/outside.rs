//! Which side of the surface is out, at the points where that is known without the surface (not in the paper): by
//! their normals, towards what saw them, or at the ends of columns.

use super::blocks::Blocks;
use super::columns::{Direction, extreme};
use super::ids::{Id, Ids};
use super::normals::{Given, Normals, is_sample};
use super::order::PointStore;
use super::scanners::{Scanners, Seen};
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use serde::{Deserialize, Serialize};

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
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
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
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.tables.iter().try_for_each(|t| t.release(workspace))
    }

    /// The directions in which each point of a block is extreme, one bit each.
    fn open(&self, unit: &Unit<'_>, block: usize, ids: Ids) -> Result<Vec<u8>> {
        let mut directions = vec![0; ids.len()];
        for (bit, table) in self.tables.iter().enumerate() {
            for id in table.get(unit, block)? {
                directions[ids.place(id)] |= 1 << bit;
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

/// What files tell of single points. Normals count before scanners.
#[derive(Debug, Clone, Copy, Default)]
pub struct Told<'a> {
    /// The normals of the points, if these tell which side is out.
    pub normals: Option<Normals<'a>>,
    /// The scanners that saw the points.
    pub scanners: Option<Scanners<'a>>,
}

impl<'a> Told<'a> {
    fn bytes(&self, ids: usize) -> u64 {
        let normals = self.normals.map_or(0, |normals| normals.bytes(ids));
        normals + self.scanners.map_or(0, |scanners| scanners.bytes(ids))
    }

    fn open(&self, unit: &Unit<'_>, ids: Ids) -> Result<Heard<'a>> {
        let normals = self.normals.map(|n| n.open(unit, ids));
        let scanners = self.scanners.map(|s| s.open(unit, ids));
        Ok(Heard {
            normals: normals.transpose()?,
            scanners: scanners.transpose()?,
        })
    }
}

/// What files tell of the points of a block.
#[derive(Debug)]
pub struct Heard<'a> {
    normals: Option<Given>,
    scanners: Option<Seen<'a>>,
}

impl Heard<'_> {
    fn bytes(&self) -> u64 {
        let normals = self.normals.as_ref().map_or(0, Given::bytes);
        normals + self.scanners.as_ref().map_or(0, Seen::bytes)
    }

    fn normal(&self, id: Id) -> Option<[f64; 3]> {
        self.normals.as_ref()?.unit(id)
    }

    fn has(&self, id: Id) -> bool {
        let seen = || self.scanners.as_ref().is_some_and(|seen| seen.has(id));
        self.normal(id).is_some() || seen()
    }

    fn toward(&self, id: Id, from: Point) -> Option<[f64; 3]> {
        let seen = || self.scanners.as_ref()?.toward(id, from);
        self.normal(id).or_else(seen)
    }

    /// True if a point has no normal, or one that agrees with those around it.
    fn is_sure(&self, id: Id, at: impl Fn(Id) -> Point) -> bool {
        let agrees = |given: &Given| given.of(id).is_none() || given.agrees(id, at);
        self.normals.as_ref().is_none_or(agrees)
    }
}

/// What tells which side is out. Where it tells nothing, the highest points face up.
#[derive(Debug, Clone, Copy)]
pub enum Outside<'a> {
    /// What files tell of single points.
    Told(Told<'a>),
    /// A position that the whole surface faces.
    Position([i64; 3]),
    /// The points at the ends of columns.
    Extremes(&'a StoredExtremes),
}

impl<'a> Outside<'a> {
    /// What files tell; nothing if they tell nothing of any point.
    #[must_use]
    pub fn told(told: Told<'a>) -> Option<Self> {
        let some = told.normals.is_some() || told.scanners.is_some();
        some.then_some(Self::Told(told))
    }

    /// True if it says all there is to say, so that the highest points say nothing.
    #[must_use]
    pub fn is_for_all(&self) -> bool {
        !matches!(self, Self::Told(_))
    }

    /// Bytes of memory for `ids` points while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        match self {
            Self::Told(told) => told.bytes(ids),
            Self::Position(_) => 0,
            // The list of one direction beside those of all points.
            Self::Extremes(_) => 5 * ids as u64,
        }
    }

    /// Which side is out at the points of a block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, blocks: Blocks, block: usize) -> Result<Known<'a>> {
        let ids = blocks.ids(block);
        Ok(match *self {
            Self::Told(told) => Known::Heard(told.open(unit, ids)?),
            Self::Position(place) => Known::Position(place),
            Self::Extremes(stored) => Known::Extremes {
                directions: stored.open(unit, block, ids)?,
                ids,
                stored,
            },
        })
    }
}

/// Which side is out at the points of a block.
#[derive(Debug)]
pub enum Known<'a> {
    /// What files tell of them.
    Heard(Heard<'a>),
    /// A position.
    Position([i64; 3]),
    /// The points at the ends of columns.
    Extremes {
        /// The ids of the block.
        ids: Ids,
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
            Self::Heard(heard) => heard.bytes(),
            Self::Position(_) => 0,
            Self::Extremes { directions, .. } => bytes_of(directions),
        }
    }

    /// True if a point of the block does not face up even where it is the highest.
    #[must_use]
    pub fn has(&self, id: Id) -> bool {
        match self {
            Self::Heard(heard) => heard.has(id),
            Self::Position(_) | Self::Extremes { .. } => true,
        }
    }

    /// As [`Known::toward`], for witnesses only: points at the ends of columns are few, of others one for a number of
    /// points is enough, and its normal must agree with those around it. `at` has the positions of the block.
    #[must_use]
    pub fn witness(&self, id: Id, at: impl Fn(Id) -> Point) -> Option<[f64; 3]> {
        let is_one = match self {
            Self::Heard(heard) => is_sample(id) && heard.is_sure(id, &at),
            Self::Position(_) => is_sample(id),
            Self::Extremes { .. } => true,
        };
        is_one.then(|| self.toward(id, at(id))).flatten()
    }

    /// The unit vector out of the surface at a point of the block, at `from`; none if that is not known.
    #[must_use]
    pub fn toward(&self, id: Id, from: Point) -> Option<[f64; 3]> {
        match self {
            Self::Heard(heard) => heard.toward(id, from),
            Self::Position(place) => super::scanners::toward(*place, from),
            Self::Extremes {
                ids,
                directions,
                stored,
            } => {
                let directions = directions.get(ids.place(id))?;
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
