//! Points at one position of the lattice: duplicates, or different points that its steps do not tell apart.

use super::Spool;
use super::far::in_unit;
use super::stream::{Buffers, READ_BUFFERS};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use rustc_hash::{FxBuildHasher, FxHashSet};
use serde::{Deserialize, Serialize};
use std::hash::BuildHasher;

/// About how many positions are looked at.
const SAMPLE: u64 = 1 << 16;

/// Most different coordinates that are told apart.
const MOST: usize = 1 << 18;

/// Bytes of both sets, and of the buffers.
const MEMORY: u64 = 48 << 20;

/// Points are duplicates if at most one in this many of those at one position differs from the others.
const ONE_IN: u64 = 10;

/// Counts of a sample.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Counts {
    points: u64,
    positions: u64,
    coordinates: u64,
}

impl Spool {
    /// True if most points at the position of another one have its coordinates, too; none if there is no spool any
    /// more. Reads the spool once.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
    pub fn has_duplicates(
        spool: Option<&Self>,
        lattice: &Lattice,
        workspace: &Workspace,
    ) -> Result<Option<bool>> {
        let counts = workspace.once("points at one position", |_| {
            let Some(spool) = spool else {
                return Ok(None);
            };
            let file = workspace.files.open(&spool.name, true)?;
            // An attempt that was interrupted may have deleted it.
            if file.is_gone() || file.count() == 0 {
                return Ok(None);
            }
            let mut held = workspace.promise("ingest: points at one position", MEMORY)?;
            spool.count(lattice, workspace, &mut held).map(Some)
        })?;
        Ok(counts.map(|counts| {
            let folded = counts.points - counts.positions.min(counts.points);
            let different = counts.coordinates.saturating_sub(counts.positions);
            different.saturating_mul(ONE_IN) <= folded
        }))
    }

    /// Counts all points at a sample of the positions.
    fn count(
        &self,
        lattice: &Lattice,
        workspace: &Workspace,
        held: &mut Reservation,
    ) -> Result<Counts> {
        let each = (self.points() / SAMPLE).max(1);
        let is_sampled = |point: &Point| FxBuildHasher.hash_one(point).is_multiple_of(each);
        let (mut positions, mut coordinates) = (FxHashSet::default(), FxHashSet::default());
        let mut points = 0;
        self.for_each_frame(workspace, lattice, |buffers: &Buffers, native| {
            for (number, point) in buffers.points.iter().enumerate() {
                if !is_sampled(point) {
                    continue;
                }
                points += 1;
                positions.insert(*point);
                let place = buffers.place(number);
                let own = in_unit(native, buffers.frame.native(native, place));
                if coordinates.len() < MOST {
                    // Zero has one sign.
                    coordinates.insert(own.map(|c| (c + 0.0).to_bits()));
                }
            }
            Ok(())
        })?;
        let sets = positions.capacity() * size_of::<Point>()
            + coordinates.capacity() * size_of::<[u64; 3]>();
        held.set_held(sets as u64 + READ_BUFFERS);
        Ok(Counts {
            points,
            positions: positions.len() as u64,
            coordinates: coordinates.len() as u64,
        })
    }
}
