//! Stages that move points: rounds of smoothing, and the smoothing of noisy points; and how far they moved.

use super::values::Values;
use super::{Divided, Stages};
use crate::params::{Method, Smooth};
use outcrop_disk::error::Result;
use outcrop_points::{Attribute, Column};
use outcrop_stages::attributes::{StoredColumns, displacement};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::TileRanges;
use outcrop_stages::order::StoredPoints;
use outcrop_stages::smooth::{Relaxed, Relaxing, relax, smooth};

impl Stages<'_> {
    /// Smooths the measured points, if requested or if they are noisy: returns the points of the mesh, and the
    /// positions that decide how they are connected. If the mesh tells how far points moved, `values` will.
    pub fn moved(
        &mut self,
        divided: Divided,
        values: &mut Values,
    ) -> Result<(StoredPoints, Option<Relaxed>)> {
        let Divided {
            points: measured,
            blocks,
            tiles,
        } = divided;
        let keeps = self.job.params.attributes.has_displacement();
        let before = keeps.then(|| measured.clone());
        let points = self.smooth(measured, tiles, keeps)?;
        let (points, relaxed) = self.relax(points, tiles, keeps)?;
        if let Some(before) = before {
            let columns = self.displacement(&before, &points, blocks)?;
            values.append(columns);
        }
        Ok((points, relaxed))
    }

    /// How far the points moved, as a column.
    fn displacement(
        &mut self,
        before: &StoredPoints,
        after: &StoredPoints,
        blocks: Blocks,
    ) -> Result<StoredColumns> {
        let workspace = self.workspace;
        let (points, step) = (after.len() as u64, self.report.lattice.step);
        let (columns, largest) = self.clock.stage("displacement", "points", points, || {
            let stores = [before.open(workspace)?, after.open(workspace)?];
            displacement([&stores[0], &stores[1]], step, blocks, workspace)
        })?;
        if before != after {
            before.release(workspace)?;
        }
        let Column { name, scalar } = Column::displacement();
        self.report.attributes.push(Attribute {
            name,
            scalar,
            range: [0.0, largest],
            files_without: 0,
        });
        Ok(columns)
    }

    /// Smooths the points, if requested. The files of the measured points stay if `keeps`.
    fn smooth(
        &mut self,
        mut store: StoredPoints,
        tiles: TileRanges,
        keeps: bool,
    ) -> Result<StoredPoints> {
        let (params, workspace) = (&self.job.params, self.workspace);
        workspace.trim();
        let points = store.len() as u64;
        for round in 1..=params.smooth.rounds() {
            let step = format!("smooth {round}");
            let next = self.clock.round("smooth", &step, "points", points, || {
                let (k, smoothing) = (params.neighbors, params.smoothing);
                let store = store.open(workspace)?;
                smooth(&store, tiles, k, smoothing, round, workspace)
            })?;
            if round > 1 || !keeps {
                store.release(workspace)?;
            }
            store = next;
        }
        Ok(store)
    }

    /// Smooths the noisy points: returns the points of the mesh, and the positions that decide how they are
    /// connected. The files of the measured points stay if `keeps`.
    fn relax(
        &mut self,
        points: StoredPoints,
        tiles: TileRanges,
        keeps: bool,
    ) -> Result<(StoredPoints, Option<Relaxed>)> {
        let (params, workspace) = (&self.job.params, self.workspace);
        let count = points.len() as u64;
        let options = Relaxing {
            neighbors: params.neighbors,
            rounds: params.relax,
            step: self.report.lattice.step,
        };
        let mut relaxed = None;
        if params.relax > 0 || params.method == Method::Robust {
            let items = count * u64::from(params.relax + 1);
            relaxed = Some(self.clock.stage("relax", "points", items, || {
                relax(&points.open(workspace)?, tiles, options, workspace)
            })?);
        }
        let moved = relaxed.as_mut().filter(|_| params.smooth == Smooth::Auto);
        let points = match moved.and_then(|relaxed| relaxed.store.take()) {
            Some(moved) => {
                if !keeps {
                    points.release(workspace)?;
                }
                moved
            }
            None => points,
        };
        self.report.relax = relaxed.as_ref().map(|r| r.stats);
        self.known.points = count;
        self.known.moved = relaxed.as_ref().map(|r| r.store.is_some());
        self.check_room()?;
        Ok((points, relaxed))
    }

    /// True if the points of the mesh are not where they were measured.
    pub(super) fn is_smoothed(&self) -> bool {
        let noisy = self.report.relax.is_some_and(|relax| relax.moved > 0);
        match self.job.params.smooth {
            Smooth::Auto => noisy,
            Smooth::Rounds(rounds) => rounds > 0,
        }
    }
}
