//! The stage of values by id: columns of the mesh, and the scanners that saw the points.

use super::Stages;
use crate::error::Result;
use crate::geom::lattice::Lattice;
use crate::stages::attributes::{StoredAttributes, StoredColumns, attributes};
use crate::stages::ingest::Spool;
use crate::stages::order::StoredPoints;
use crate::stages::scanners::{self, Scanners};
use crate::workspace::Workspace;

/// The values of the points.
#[derive(Debug, Default)]
pub(in crate::pipeline) struct Values {
    stored: StoredAttributes,
    /// The places of the scanners in the order of their numbers.
    places: Vec<Option<[i64; 3]>>,
}

impl Values {
    /// The columns, if the mesh keeps any.
    pub fn columns(&self) -> Option<&StoredColumns> {
        self.stored.columns.as_ref()
    }

    /// The scanners, if they decide which side is out.
    pub fn scanners(&self) -> Option<Scanners<'_>> {
        let stored = self.stored.scanners.as_ref();
        stored.map(|stored| Scanners::new(stored, &self.places))
    }

    /// Deletes the files of the scanners.
    pub fn release_scanners(&self, workspace: &Workspace) -> Result<()> {
        let stored = self.stored.scanners.as_ref();
        stored.map_or(Ok(()), |stored| stored.release(workspace))
    }
}

impl Stages<'_> {
    /// The values of the points that remain, if any are needed.
    pub fn values(
        &mut self,
        spool: &Spool,
        lattice: &Lattice,
        store: &StoredPoints,
    ) -> Result<Values> {
        if self.carried.is_empty() {
            return Ok(Values::default());
        }
        let positions = self.carried.scanners().to_vec();
        let place = |position: &[f64; 3]| scanners::place(*position, lattice, store.bounds());
        let places: Vec<_> = positions.iter().map(place).collect();
        let real = positions.iter().zip(&places);
        let real = real.filter_map(|(position, place)| place.and(Some(*position)));
        self.report.scanners = real.collect();
        let unreal = positions.len() - self.report.scanners.len();
        if unreal > 0 {
            self.warn(format!(
                "{unreal} of {} positions of scanners are not used: they are too far from all points",
                positions.len()
            ));
        }
        if self.report.scanners.is_empty() {
            self.carried.drop_scanners();
        }
        let (workspace, blocks, carried) = (self.workspace, self.blocks(), &self.carried);
        let mut stored = StoredAttributes::default();
        if carried.is_empty() {
            spool.release(workspace)?;
        } else {
            let points = spool.points();
            stored = self.clock.stage("attributes", "points", points, || {
                attributes(spool, lattice, carried, store, blocks, workspace)
            })?;
        }
        Ok(Values { stored, places })
    }
}
