//! Points in curve order: an external sort, duplicates folded; the rank is the id (paper: none;
//! this is what makes everything after it independent of memory and threads).

mod store;

pub use store::{PAGE, PointStore, StoreWriter};

use crate::error::{Error, Result};
use crate::geom::{Point, hilbert};
use crate::spill::Sorter;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Keys decoded and written at a time.
const BATCH: usize = 1 << 16;

/// Takes in positions in any order and gives back the ordered store.
#[derive(Debug)]
pub struct Orderer {
    sorter: Sorter<3>,
    keys: Vec<hilbert::Key>,
    taken: u64,
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
            keys: Vec::new(),
            taken: 0,
            held,
        })
    }

    /// Takes in positions, each coordinate in `0..2^30`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
    pub fn push(&mut self, workspace: &Workspace, points: &[Point]) -> Result<()> {
        workspace.check_cancel()?;
        workspace.install(|| {
            points
                .par_iter()
                .with_min_len(1024)
                .map(|&p| hilbert::encode(p))
                .collect_into_vec(&mut self.keys);
        });
        self.taken += points.len() as u64;
        self.sorter.push(&self.keys)
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
            ..
        } = self;
        let mut writer = StoreWriter::create(workspace, "points", page)?;
        let mut batch: Vec<hilbert::Key> = Vec::with_capacity(BATCH);
        let mut points: Vec<Point> = Vec::new();
        let mut last = None;
        let mut flush = |batch: &mut Vec<hilbert::Key>| -> Result<()> {
            workspace.check_cancel()?;
            workspace.install(|| {
                batch
                    .par_iter()
                    .with_min_len(1024)
                    .map(|&k| hilbert::decode(k))
                    .collect_into_vec(&mut points);
            });
            workspace.observer.advance(batch.len() as u64);
            batch.clear();
            writer.push(&points)
        };
        sorter.finish(workspace)?.for_each(|key| {
            if last != Some(key) {
                last = Some(key);
                batch.push(key);
                if batch.len() == BATCH {
                    flush(&mut batch)?;
                }
            }
            Ok(())
        })?;
        flush(&mut batch)?;
        drop(held);
        let store = writer.finish(workspace)?;
        let limit = u64::from(u32::MAX) - 1;
        if store.len() as u64 > limit {
            return Err(Error::TooManyPoints {
                found: store.len() as u64,
                limit,
            });
        }
        let folded = taken - store.len() as u64;
        Ok((store, folded))
    }
}
