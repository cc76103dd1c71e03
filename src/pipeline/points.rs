//! From the spool to the ordered store: the stages that decide which points there are.

use super::{Clock, Reconstruction};
use crate::error::Result;
use crate::geom::lattice::Lattice;
use crate::stages::ingest::{READ_BUFFERS, Spool};
use crate::stages::order::{Orderer, PointStore};
use crate::stages::outliers::{OutlierOptions, OutlierStats, drop_outliers};
use crate::stages::thin::{Grid, ThinStats, thin};
use crate::workspace::Workspace;

impl Reconstruction {
    /// The points in order, thinned if asked for; duplicates folded.
    pub(super) fn in_order(
        &self,
        spool: Spool,
        lattice: &Lattice,
        clock: &mut Clock<'_>,
        workspace: &Workspace,
    ) -> Result<(PointStore, u64, ThinStats)> {
        let points = spool.points();
        let grid = self.params.thin.and_then(|side| Grid::new(lattice, side));
        let Some(grid) = grid else {
            let (store, folded) = clock.stage("order", "points", points, || {
                order(spool, lattice, self.page_points, workspace)
            })?;
            return Ok((store, folded, ThinStats::default()));
        };
        let thinned = clock.stage("thin", "points", points, || {
            thin(spool, lattice, grid, workspace)
        })?;
        let (store, stats) = clock.stage("order", "points", 0, || {
            let orderer = Orderer::for_points(workspace, points)?;
            let stats = orderer.take_stream(workspace, |from, stats, each| {
                thinned.for_each(from, stats, each)
            })?;
            let (store, _) = orderer.finish(workspace, self.page_points)?;
            Ok((store, stats))
        })?;
        Ok((store, stats.duplicates, stats))
    }

    /// The points that are no outliers, if these are to be dropped.
    pub(super) fn without_outliers(
        &self,
        store: PointStore,
        clock: &mut Clock<'_>,
        workspace: &Workspace,
    ) -> Result<(PointStore, OutlierStats)> {
        let Some(factor) = self.params.drop_outliers else {
            return Ok((store, OutlierStats::default()));
        };
        let options = OutlierOptions {
            factor,
            block: self.params.block,
            tile: self.tile_points,
        };
        clock.stage("outliers", "points", 0, || {
            drop_outliers(store, options, workspace)
        })
    }
}

/// Puts all points of a spool in order; the spool is deleted.
pub(crate) fn order(
    spool: Spool,
    lattice: &Lattice,
    page: usize,
    workspace: &Workspace,
) -> Result<(PointStore, u64)> {
    // Their buffers must not take much of what is there to sort in.
    let most = workspace.memory.available() / (8 * READ_BUFFERS);
    let threads = workspace.threads.min(most as usize).max(1);
    let held = workspace.reserve("order: frames", threads as u64 * READ_BUFFERS)?;
    let orderer = Orderer::for_points(workspace, spool.points())?;
    orderer.take_parts(workspace, &spool.frames(), |frames| {
        let push = |points: &[_]| orderer.push(workspace, points);
        spool.par_for_frames(threads, lattice, frames, push)
    })?;
    drop(held);
    // An attempt that dies has to read again what was only in memory.
    let read_again = workspace.is_resumable() && !orderer.is_sorted();
    let _spool = read_again.then_some(spool);
    orderer.finish(workspace, page)
}
