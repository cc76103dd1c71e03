//! The step that finds out which side of the surface is out, as far as that is known without it.

use super::Stages;
use super::values::Values;
use crate::params::Facing;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::order::PointStore;
use outcrop_stages::outside::{Outside, StoredExtremes};
use outcrop_stages::scanners::{FARTHEST, on_lattice};

/// What tells which side is out.
#[derive(Debug)]
pub(in crate::pipeline) enum Side {
    /// What the files tell of each point; up, where they tell nothing.
    Told,
    /// Up, whatever files tell.
    Up,
    /// A position that the surface faces.
    Position([i64; 3]),
    /// The points at the ends of columns.
    Extremes(StoredExtremes),
}

impl Side {
    /// The same for the stages; nothing if only the highest points tell something.
    pub fn outside<'a>(&'a self, values: &'a Values) -> Option<Outside<'a>> {
        match self {
            Self::Told => Outside::told(values.told()),
            Self::Up => None,
            Self::Position(place) => Some(Outside::Position(*place)),
            Self::Extremes(stored) => Some(Outside::Extremes(stored)),
        }
    }

    /// Deletes its files.
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        match self {
            Self::Extremes(stored) => stored.release(workspace),
            _ => Ok(()),
        }
    }
}

impl Stages<'_> {
    /// Refuses a position too far from the points.
    pub fn check_facing(&self, lattice: &Lattice) -> Result<()> {
        match self.job.params.facing {
            Facing::At(position) => faced(position, lattice).map(drop),
            _ => Ok(()),
        }
    }

    /// What tells which side is out, of the positions that decide the connectivity.
    pub fn side(&mut self, shape: &PointStore, blocks: Blocks, lattice: &Lattice) -> Result<Side> {
        let inward = match self.job.params.facing {
            Facing::Auto => return Ok(Side::Told),
            Facing::Up => return Ok(Side::Up),
            Facing::At(position) => return faced(position, lattice).map(Side::Position),
            Facing::Out => false,
            Facing::In => true,
        };
        let workspace = self.workspace;
        let find = || StoredExtremes::of(shape, inward, blocks, workspace);
        let stored = self.clock.stage("facing", "points", 0, find)?;
        Ok(Side::Extremes(stored))
    }
}

/// The place of the position that the surface faces.
fn faced(position: [f64; 3], lattice: &Lattice) -> Result<[i64; 3]> {
    on_lattice(position, lattice).ok_or_else(|| {
        let [x, y, z] = position;
        Error::Parameter {
            name: "facing",
            found: format!("{x:?},{y:?},{z:?}"),
            expected: format!("a position less than {:.0} away", FARTHEST * lattice.step),
        }
    })
}
