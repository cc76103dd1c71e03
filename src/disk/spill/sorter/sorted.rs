//! The rows of a sorter, sorted: in memory, or in runs that are merged while they are read.

use super::super::runs::{FILE_BUFFER, FRAME, Run, merge};
use super::super::{Row, sort};
use crate::error::Result;
use crate::workspace::memory::Reservation;
use crate::workspace::{Files, Workspace};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Sorted rows and their reservation.
pub type InMemory<R> = (Vec<R>, Option<Reservation>);

/// The rows of a [`Sorter`](super::Sorter) in ascending order.
#[derive(Debug)]
pub struct Sorted<R: Row> {
    pub(super) buffer: Vec<R>,
    pub(super) runs: Vec<Run<R>>,
    pub(super) held: Option<Reservation>,
    pub(super) files: Files,
}

/// Bytes of memory for merging the runs.
pub(super) fn merge_bytes<R: Row>(runs: &[Run<R>]) -> u64 {
    (runs.len() * (FRAME * size_of::<R>() + FILE_BUFFER)) as u64
}

/// Sorted rows on disk, by the names of their files.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct SortedRuns<R: Row> {
    runs: Vec<String>,
    #[serde(skip)]
    rows: PhantomData<fn() -> R>,
}

impl<R: Row> SortedRuns<R> {
    /// Opens the runs; the memory of a merge is reserved as `name`.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`], [`crate::error::Error::Memory`].
    pub fn open(&self, workspace: &Workspace, name: &'static str) -> Result<Sorted<R>> {
        let files = workspace.files.clone();
        let runs = self.runs.iter().map(|name| Run::reopen(&files, name));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        Ok(Sorted {
            buffer: Vec::new(),
            held: Some(workspace.reserve(name, merge_bytes(&runs))?),
            runs,
            files,
        })
    }

    /// Deletes the files.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        let mut runs = self.runs.iter();
        runs.try_for_each(|name| workspace.files.release(name))
    }
}

impl<R: Row> Sorted<R> {
    /// All rows in ascending order with their reservation, if they are in memory.
    ///
    /// # Errors
    /// `self`, if the rows are on disk.
    pub fn in_memory(self) -> std::result::Result<InMemory<R>, Self> {
        if self.runs.is_empty() {
            Ok((self.buffer, self.held))
        } else {
            Err(self)
        }
    }

    /// Reports usage to the reservation. The caller of [`Sorted::for_range`] reports the memory of that
    /// merge; all other usage is reported here.
    pub fn report_usage(&mut self, bytes: u64) {
        if let Some(held) = &mut self.held {
            held.set_held(bytes);
        }
    }

    /// Calls `each` with every row in ascending order; then the rows are deleted.
    ///
    /// # Errors
    /// Errors of `each`, [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`].
    pub fn for_each(self, mut each: impl FnMut(R) -> Result<()>) -> Result<()> {
        if self.runs.is_empty() {
            return self.buffer.into_iter().try_for_each(each);
        }
        merge(&self.runs, None, None, &mut each)?;
        self.release()
    }

    /// The rows on disk, to be released later.
    #[must_use]
    pub fn runs(&self) -> SortedRuns<R> {
        SortedRuns {
            runs: self.runs.iter().map(Run::name).collect(),
            rows: PhantomData,
        }
    }

    /// Deletes the rows on disk.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn release(self) -> Result<()> {
        let mut runs = self.runs.iter();
        runs.try_for_each(|run| self.files.release(&run.name()))
    }

    /// Calls `each` with every row from the first one that is not below `from`; the rows stay.
    ///
    /// # Errors
    /// See [`Sorted::for_each`].
    pub fn for_each_from(
        &self,
        from: Option<R>,
        mut each: impl FnMut(R) -> Result<()>,
    ) -> Result<()> {
        merge(&self.runs, from, None, &mut each)
    }

    /// Rows that divide the rows on disk into parts of about `records` rows, at most a frame of each run
    /// more; ascending.
    #[must_use]
    pub fn cuts(&self, records: usize) -> Vec<R> {
        let mut firsts: Vec<R> = self.runs.iter().flat_map(|r| &r.firsts).copied().collect();
        sort::sort(&mut firsts);
        let frames = (records / FRAME).max(1);
        let mut cuts: Vec<R> = firsts.into_iter().step_by(frames).skip(1).collect();
        cuts.dedup();
        cuts
    }

    /// Calls `each` with the rows on disk from `from` (inclusive) to `to` (exclusive), in ascending order.
    /// Several threads may do so at the same time, each in memory of [`Sorted::merge_bytes`].
    ///
    /// # Errors
    /// Errors of `each`, [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`].
    pub fn for_range(
        &self,
        from: Option<R>,
        to: Option<R>,
        each: impl FnMut(R) -> Result<()>,
    ) -> Result<()> {
        merge(&self.runs, from, to, each)
    }

    /// Bytes of memory for a merge.
    #[must_use]
    pub fn merge_bytes(&self) -> u64 {
        merge_bytes(&self.runs)
    }
}
