//! Thinning: in each cell of a cubic grid only the point nearest to the cell's centre is kept (not in the
//! paper).
//!
//! The side of the cells is arbitrary, so cells are not intervals of the curve that orders points. Therefore
//! all points are first sorted by cell, on disk if memory does not suffice, and then put in curve order. The
//! grid is fixed to the origin of the input's coordinates, so that adjacent clouds are thinned consistently.

mod grid;

pub use grid::Grid;
use grid::InCell;

use outcrop_disk::error::Result;
use outcrop_disk::spill::{SortedRuns, Sorter, release};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use outcrop_points::{READ_BUFFERS, Spool};
use serde::{Deserialize, Serialize};

/// Points passed on at a time.
const BATCH: usize = 1 << 14;

/// Rows encoded at a time.
const CHUNK: usize = 1 << 12;

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ThinStats {
    /// Distinct points left out because another point of their cell is kept.
    pub dropped: u64,
}

/// The points left out so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Counts of this stage.
    pub thin: ThinStats,
    /// Points that have the same position as another point.
    pub duplicates: u64,
}

/// All points, sorted by cell.
#[derive(Debug, Serialize, Deserialize)]
pub struct Thinned {
    sorted: SortedRuns<InCell>,
    grid: Grid,
}

release!(Thinned: sorted);

/// Sorts the points of a spool by the cells of `grid`. The spool comes back if its values are still to be read, or is
/// deleted.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn thin(
    spool: Spool,
    lattice: &Lattice,
    grid: Grid,
    workspace: &Workspace,
) -> Result<(Thinned, Option<Spool>)> {
    let most = workspace.memory.available() / (8 * READ_BUFFERS);
    let threads = workspace.threads.min(most as usize).max(1);
    let frames = workspace.reserve("thin: frames", threads as u64 * READ_BUFFERS)?;
    // A quarter, because the sorted points stay on disk and in memory while they are put in order.
    let buffer = (workspace.memory.available() / 4).max(16 << 20);
    // While a buffer grows, both the old and the new one are allocated.
    let held = workspace.promise("thin: sort buffer", buffer + buffer / 2)?;
    let sorter = Sorter::new(workspace, "thin", buffer).reporting(held);
    let take = |points: &[Point]| {
        workspace.check_cancel()?;
        let mut rows = Vec::with_capacity(CHUNK.min(points.len()));
        for part in points.chunks(CHUNK) {
            rows.clear();
            rows.extend(part.iter().map(|&p| grid.in_cell(p)));
            sorter.push(&rows)?;
        }
        workspace.observer.advance(points.len() as u64);
        Ok(())
    };
    sorter.take_parts(workspace, &spool.frames(), true, |frames| {
        spool.par_for_frames(workspace, threads, lattice, frames, take)
    })?;
    drop(frames);
    let again = spool.has_values();
    let spool = spool.kept_if(again, workspace)?;
    let sorted = sorter.finish_on_disk(workspace)?;
    Ok((Thinned { sorted, grid }, spool))
}

/// The first row of the cell at which to continue; `None` at the beginning.
pub type Mark = Option<[u32; 6]>;

/// Receives points that are kept, the mark of the next ones, and the counts up to there.
pub type Each<'a> = &'a mut dyn FnMut(&[Point], Mark, LeftOut) -> Result<()>;

impl Thinned {
    /// Calls `each` with batches of the points that are kept, with the mark of the next ones and the counts
    /// so far. Starts at `from` with the counts `stats`, as passed to `each` in an earlier call.
    ///
    /// # Errors
    /// Errors of `each`, [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn for_each(
        &self,
        workspace: &Workspace,
        from: Mark,
        mut stats: LeftOut,
        each: Each<'_>,
    ) -> Result<LeftOut> {
        let grid = &self.grid;
        let sorted = self.sorted.open(workspace, "thin: merge")?;
        let mut kept = Vec::with_capacity(BATCH);
        let mut best: Option<(InCell, f64)> = None;
        let mut last = None;
        sorted.for_each_from(from.map(bytemuck::cast), |row| {
            if last == Some(row) {
                stats.duplicates += 1;
                return Ok(());
            }
            last = Some(row);
            let distance2 = grid.distance2(row);
            match &mut best {
                Some((nearest, least)) if nearest.cell == row.cell => {
                    stats.thin.dropped += 1;
                    // Rows of a cell ascend by position, so the first of equally near points is kept.
                    if distance2 < *least {
                        (*nearest, *least) = (row, distance2);
                    }
                }
                _ => {
                    let done = best.replace((row, distance2));
                    kept.extend(done.map(|(row, _)| row.position()));
                    if kept.len() == BATCH {
                        each(&kept, Some(bytemuck::cast(row)), stats)?;
                        kept.clear();
                    }
                }
            }
            Ok(())
        })?;
        kept.extend(best.map(|(row, _)| row.position()));
        each(&kept, None, stats)?;
        Ok(stats)
    }
}

#[cfg(test)]
mod tests;
