//! Thinning: of each cell of a cubic grid at most one point stays, the one nearest to the cell's
//! centre (paper: none).
//!
//! The side of the cells is any length, so cells are not runs of the curve that orders points. All
//! points are sorted by cell instead, on disk as far as the memory does not suffice, before they
//! are put in order. The grid is fixed to the zero point of the input's coordinates, so that clouds
//! beside each other are thinned alike.

mod grid;

pub use grid::Grid;
use grid::InCell;

use crate::error::Result;
use crate::geom::Point;
use crate::geom::lattice::Lattice;
use crate::spill::{Sorted, Sorter};
use crate::stages::ingest::{READ_BUFFERS, Spool};
use crate::workspace::Workspace;
use crate::workspace::persist::{Persist, Saved, persist};
use serde::Serialize;

/// Points handed on at a time.
const BATCH: usize = 1 << 14;

/// Rows encoded at a time.
const CHUNK: usize = 1 << 12;

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct ThinStats {
    /// Distinct points left out, since another one of their cell stays.
    pub dropped: u64,
    /// Points that share their position with another one.
    #[serde(skip)]
    pub duplicates: u64,
}

/// All points, sorted by cell.
#[derive(Debug)]
pub struct Thinned {
    sorted: Sorted<InCell>,
    grid: Grid,
}

/// Sorts the points of a spool by the cells of `grid`; the spool is deleted.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn thin(spool: Spool, lattice: &Lattice, grid: Grid, workspace: &Workspace) -> Result<Thinned> {
    let most = workspace.memory.available() / (8 * READ_BUFFERS);
    let threads = workspace.threads.min(most as usize).max(1);
    let frames = workspace.reserve("thin: frames", threads as u64 * READ_BUFFERS)?;
    // A quarter, for the points are put in order while these are still there.
    let buffer = (workspace.memory.available() / 4).max(16 << 20);
    // Growing a buffer holds the old and the new one for a moment.
    let held = workspace.promise("thin: sort buffer", buffer + buffer / 2)?;
    let sorter = Sorter::new(workspace, "thin", buffer).telling(held);
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
        spool.par_for_frames(threads, lattice, frames, take)
    })?;
    drop(frames);
    drop(spool);
    Ok(Thinned {
        sorted: sorter.finish(workspace)?,
        grid,
    })
}

impl Persist for Thinned {
    fn save(&self, out: &mut Vec<u8>) {
        self.sorted.save(out);
        self.grid.save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let sorted = Sorted::load(from)?;
        let held = from
            .workspace
            .reserve("thin: merge", sorted.merge_bytes())?;
        Ok(Self {
            sorted: sorted.holding(held),
            grid: Grid::load(from)?,
        })
    }
}

persist!(ThinStats {
    dropped,
    duplicates
});

/// Where the points that stay are handed on from: the first row of a cell.
pub type Mark = Option<[u32; 6]>;

/// Takes points that stay, where the next ones begin, and the counts up to there.
pub type Each<'a> = &'a mut dyn FnMut(&[Point], Mark, ThinStats) -> Result<()>;

impl Thinned {
    /// Calls `each` with the points that stay, some at a time, with where the next ones begin and with
    /// the counts so far; from where an earlier call said, with the counts it said.
    ///
    /// # Errors
    /// What `each` returned; [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn for_each(self, from: Mark, mut stats: ThinStats, each: Each<'_>) -> Result<ThinStats> {
        let Self { sorted, grid } = self;
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
                    stats.dropped += 1;
                    // Rows of a cell ascend with the position: of equals the first stays.
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
