//! Points in curve order: an external sort, duplicates folded; the rank is the id (paper: none;
//! this is what makes everything after it independent of memory and threads).

mod rewrite;
mod store;

pub use rewrite::Rewriter;
pub use store::{PAGE, PointStore, StoreWriter};

use crate::error::{Error, Result};
use crate::geom::{Point, hilbert};
use crate::spill::{Sorted, Sorter};
use crate::workspace::Workspace;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Keys encoded at a time.
const CHUNK: usize = 1 << 12;

/// Keys of a merge that one thread takes at a time, or more if there are many runs.
const PART: usize = 1 << 18;

/// Takes in positions in any order and gives back the ordered store.
#[derive(Debug)]
pub struct Orderer {
    sorter: Sorter<3>,
    taken: AtomicU64,
    held: crate::workspace::memory::Reservation,
}

impl Orderer {
    /// Sorts in about a third of the memory that is free now.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(workspace: &Workspace) -> Result<Self> {
        let buffer = (workspace.memory.available() / 3).max(16 << 20);
        // Growing a buffer holds the old and the new one for a moment.
        let held = workspace.reserve("order: sort buffer", buffer + buffer / 2)?;
        Ok(Self {
            sorter: Sorter::new(workspace, "order", buffer),
            taken: AtomicU64::new(0),
            held,
        })
    }

    /// Takes in positions, each coordinate in `0..2^30`; safe to call from several threads.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
    pub fn push(&self, workspace: &Workspace, points: &[Point]) -> Result<()> {
        workspace.check_cancel()?;
        let mut keys = Vec::with_capacity(CHUNK.min(points.len()));
        for part in points.chunks(CHUNK) {
            keys.clear();
            keys.extend(part.iter().map(|&p| hilbert::encode(p)));
            self.sorter.push(&keys)?;
        }
        self.taken.fetch_add(points.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    /// The store of all distinct points in curve order, in pages of `page` points, and the number
    /// of duplicates folded.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Cancelled`].
    pub fn finish(self, workspace: &Workspace, page: usize) -> Result<(PointStore, u64)> {
        let Self {
            sorter,
            taken,
            held,
        } = self;
        let mut writer = StoreWriter::create(workspace, "points", page)?;
        match sorter.finish(workspace)?.in_memory() {
            Ok(mut keys) => {
                keys.dedup();
                writer.append(workspace, &keys, |key| hilbert::decode(*key))?;
            }
            Err(sorted) => merge(&sorted, held.bytes(), &mut writer, workspace)?,
        }
        drop(held);
        let store = writer.finish(workspace)?;
        let limit = u64::from(u32::MAX) - 1;
        if store.len() as u64 > limit {
            return Err(Error::TooManyPoints {
                found: store.len() as u64,
                limit,
            });
        }
        let folded = taken.into_inner() - store.len() as u64;
        Ok((store, folded))
    }
}

/// Where a part of the keys begins and ends.
type Part = (Option<hilbert::Key>, Option<hilbert::Key>);

/// Writes what is on disk in order, part by part, each merged by one thread, in `memory` bytes.
fn merge(
    sorted: &Sorted<3>,
    memory: u64,
    writer: &mut StoreWriter,
    workspace: &Workspace,
) -> Result<()> {
    let cuts = sorted.cuts(PART).into_iter().map(Some);
    let ends: Vec<_> = [None].into_iter().chain(cuts).chain([None]).collect();
    let parts: Vec<Part> = ends.windows(2).map(|w| (w[0], w[1])).collect();
    // A part has a frame more of each run at most, and its list grows by doubling.
    let part = 3 * (PART * size_of::<hilbert::Key>()) as u64 + 4 * sorted.merge_bytes();
    let threads = (memory / part).clamp(1, workspace.threads as u64) as usize;
    let one = |&(from, to): &Part| {
        workspace.check_cancel()?;
        let mut keys = Vec::with_capacity(PART);
        sorted.for_range(from, to, |key| {
            if keys.last() != Some(&key) {
                keys.push(key);
            }
            Ok(())
        })?;
        Ok(keys)
    };
    for wave in parts.chunks(threads) {
        let merged: Result<Vec<Vec<hilbert::Key>>> =
            workspace.install(|| wave.par_iter().with_max_len(1).map(one).collect());
        for keys in merged? {
            writer.append(workspace, &keys, |key| hilbert::decode(*key))?;
        }
    }
    Ok(())
}
