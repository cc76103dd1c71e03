//! The stage of cells.

use super::super::checks::not_a_line;
use super::Stages;
use super::values::Values;
use crate::params::Method;
use outcrop_disk::error::Result;
use outcrop_stages::cells::{CellOptions, CellTriples, DiskRadius, TileRanges, Widen, cells};
use outcrop_stages::levels::HeldLevels;
use outcrop_stages::located::Places;

impl Stages<'_> {
    /// Computes the restricted Voronoi cells.
    pub fn cells(
        &mut self,
        places: Places<'_>,
        radius: DiskRadius,
        values: &Values,
        tiles: TileRanges,
    ) -> Result<(CellTriples, Option<HeldLevels>)> {
        let (params, workspace) = (&self.job.params, self.workspace);
        let points = places.file.len() as u64;
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
        let (seen, coarse, counts) = self.clock.stage("cells", "points", points, || {
            cells(places.shape, tiles, options, workspace)
        })?;
        if let Some(normals) = &mut self.report.normals {
            normals.disks = counts.disks;
        }
        not_a_line(&counts.cells, points)?;
        self.report.cells = counts.cells;
        let coarse = coarse.map(|coarse| HeldLevels::open(coarse, "coarse points", workspace));
        Ok((seen, coarse.transpose()?))
    }
}
