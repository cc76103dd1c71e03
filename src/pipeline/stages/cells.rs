//! The stage of cells.

use super::super::checks::not_a_line;
use super::Stages;
use super::values::Values;
use crate::error::Result;
use crate::params::Method;
use crate::stages::cells::{CellOptions, CellTriples, DiskRadius, DiskStats, Widen, cells};
use crate::stages::located::Places;

impl Stages<'_> {
    /// Computes the restricted Voronoi cells.
    pub fn cells(
        &mut self,
        places: Places<'_>,
        radius: DiskRadius,
        values: &Values,
    ) -> Result<CellTriples> {
        let (params, workspace, tiles) = (&self.job.params, self.workspace, self.tiles());
        let points = self.report.points;
        let options = CellOptions {
            neighbors: params.neighbors,
            radius,
            widen: match params.method {
                Method::Robust => Widen::OnBands,
                Method::Paper => Widen::OnLines,
            },
            density: places.density,
            directions: values.directions(params.input_normals),
        };
        workspace.trim();
        let (seen, stats, disks) = self.clock.stage("cells", "points", points, || {
            cells(places.shape, tiles, options, workspace)
        })?;
        self.note_disks(disks);
        not_a_line(&stats, points)?;
        self.report.cells = stats;
        Ok(seen)
    }

    /// Notes which disks have the direction of the normal of their point.
    fn note_disks(&mut self, disks: DiskStats) {
        if let Some(normals) = &mut self.report.normals {
            normals.disks = disks;
        }
    }
}
