//! Stages that move points: rounds of smoothing, and the smoothing of noisy points.

use super::Stages;
use crate::error::Result;
use crate::params::{Method, Smooth};
use crate::stages::order::StoredPoints;
use crate::stages::smooth::{Relaxed, Relaxing, relax, smooth};

impl Stages<'_> {
    /// Smooths the points, if requested.
    pub fn smooth(&mut self, mut store: StoredPoints) -> Result<StoredPoints> {
        let (params, workspace, tiles) = (&self.job.params, self.workspace, self.tiles());
        workspace.trim();
        let points = self.report.points;
        for round in 1..=params.smooth.rounds() {
            let step = format!("smooth {round}");
            let next = self.clock.round("smooth", &step, "points", points, || {
                let (k, smoothing) = (params.neighbors, params.smoothing);
                let store = store.open(workspace)?;
                smooth(&store, tiles, k, smoothing, round, workspace)
            })?;
            store.release(workspace)?;
            store = next;
        }
        Ok(store)
    }

    /// Smooths the noisy points: returns the points of the mesh, and the positions that decide how they are
    /// connected.
    pub fn relax(&mut self, points: StoredPoints) -> Result<(StoredPoints, Option<Relaxed>)> {
        let (params, workspace, tiles) = (&self.job.params, self.workspace, self.tiles());
        let options = Relaxing {
            neighbors: params.neighbors,
            rounds: params.relax,
            step: self.report.lattice.step,
        };
        let mut relaxed = None;
        if params.relax > 0 || params.method == Method::Robust {
            let items = self.report.points * u64::from(params.relax + 1);
            relaxed = Some(self.clock.stage("relax", "points", items, || {
                relax(&points.open(workspace)?, tiles, options, workspace)
            })?);
        }
        let moved = relaxed.as_mut().filter(|_| params.smooth == Smooth::Auto);
        let points = match moved.and_then(|relaxed| relaxed.store.take()) {
            Some(moved) => {
                points.release(workspace)?;
                moved
            }
            None => points,
        };
        self.report.relax = relaxed.as_ref().map(|r| r.stats);
        self.known.points = self.report.points;
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
