//! The external sorter: sorted runs on disk, merged with a bounded fan-in. If there is more than one run, one
//! half of the memory is written by a thread of its own while the other half is filled and sorted. Whoever
//! adds rows waits for that thread, which waits for the disk only.

mod sorted;
mod state;

pub use sorted::{Sorted, SortedRuns};

use super::runs::{FRAME, Run, RunWriter, merge};
use super::{Row, sort};
use crate::error::Result;
use crate::workspace::memory::Reservation;
use crate::workspace::steps::Step;
use crate::workspace::{Files, Workspace, lock};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sorted::merge_bytes;
use state::State;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard};

/// Largest number of rows of a run that can be resumed. It bounds the work that is lost with an attempt.
const MOST_IN_RUN: usize = 1 << 27;

/// Sorts any number of rows in a bounded buffer.
#[derive(Debug)]
pub struct Sorter<R: Row> {
    state: Mutex<State<R>>,
    capacity: usize,
    name: String,
    files: Files,
}

impl<R: Row> Sorter<R> {
    /// A sorter whose buffers take at most `buffer` bytes, which the caller has reserved.
    #[must_use]
    pub fn new(workspace: &Workspace, name: &str, buffer: u64) -> Self {
        let capacity = (buffer as usize / size_of::<R>()).max(2);
        Self {
            state: Mutex::new(State::new(capacity)),
            capacity,
            name: name.to_owned(),
            files: workspace.files.clone(),
        }
    }

    /// Reports the usage of the buffer to the reservation `held`.
    #[must_use]
    pub fn reporting(self, held: Reservation) -> Self {
        self.state().held = Some(held);
        self
    }

    /// Allocates the whole buffer at once, so that it never has to grow.
    #[must_use]
    pub fn whole(self) -> Self {
        self.state().buffer.reserve_exact(self.capacity);
        self
    }

    /// Number of rows that fit the buffer.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    fn state(&self) -> MutexGuard<'_, State<R>> {
        lock(&self.state)
    }

    /// Adds rows; may be called from several threads.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`].
    pub fn push(&self, mut records: &[R]) -> Result<()> {
        let mut state = self.state();
        while !records.is_empty() {
            records = state.add(records);
            if state.buffer.len() == state.capacity {
                self.spill(&mut state, false)?;
                state.divide();
            }
        }
        Ok(())
    }

    /// Sorts the rows in the buffer and writes them as a run.
    fn spill(&self, state: &mut State<R>, kept: bool) -> Result<()> {
        self.files
            .pool()
            .install(|| sort::sort_on_threads(&mut state.buffer));
        let writer = self.run_writer(&mut state.made, kept)?;
        state.write(writer)
    }

    fn run_name(&self, number: usize) -> String {
        format!("{}.run{number}", self.name)
    }

    fn run_writer(&self, made: &mut usize, kept: bool) -> Result<RunWriter<R>> {
        let name = self.run_name(*made);
        *made += 1;
        RunWriter::new(&self.files, &name, kept)
    }

    /// Adds the rows of parts of an input, given by their numbers and row counts; `push` adds the parts with
    /// the given numbers. In a run that can be resumed, the parts that fit the buffer form a sorted run,
    /// which a later attempt does not repeat. If all rows fit the buffer they stay in memory, unless they are
    /// to be `kept`. Returns the number of rows.
    ///
    /// # Errors
    /// Errors of `push`, [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn take_parts(
        &self,
        workspace: &Workspace,
        parts: &[(u32, u64)],
        kept: bool,
        push: impl Fn(&[u32]) -> Result<()>,
    ) -> Result<u64> {
        let all: u64 = parts.iter().map(|part| part.1).sum();
        if !workspace.is_resumable() {
            let numbers: Vec<u32> = parts.iter().map(|part| part.0).collect();
            push(&numbers)?;
            return Ok(all);
        }
        let step = workspace.step(&format!("runs {}", self.name))?;
        let mut left: BTreeMap<u32, u64> = parts.iter().copied().collect();
        for (number, (name, taken)) in step.finished::<(String, Vec<u32>)>()? {
            let mut state = self.state();
            state.made = state.made.max(number as usize + 1);
            if taken.iter().all(|part| left.contains_key(part)) {
                left.retain(|part, _| !taken.contains(part));
                state.runs.push(Run::reopen(&self.files, &name)?);
            }
        }
        // A full buffer would be written by [`Sorter::push`], as a run that does not survive the attempt.
        let most = |capacity: usize| (capacity - 1).min(MOST_IN_RUN) as u64;
        if left.values().sum::<u64>() > most(self.capacity) {
            self.state().divide();
        }
        let most = most(self.state().capacity);
        // The last run, which may not be written yet.
        let mut beside: Option<(usize, Vec<u32>)> = None;
        while !left.is_empty() {
            let (mut numbers, mut records) = (Vec::new(), 0);
            for (&number, &more) in &left {
                if !numbers.is_empty() && records + more > most {
                    break;
                }
                numbers.push(number);
                records += more;
            }
            let pushed = push(&numbers);
            left.retain(|part, _| !numbers.contains(part));
            let mut state = self.state();
            if left.is_empty() && state.runs.is_empty() && beside.is_none() && !kept {
                return pushed.map(|()| all);
            }
            let number = state.made;
            match pushed {
                Ok(()) => self.spill(&mut state, true)?,
                Err(_) => state.settle()?,
            }
            if let Some((number, numbers)) = beside.replace((number, numbers)) {
                self.record(&state, &step, number, &numbers)?;
            }
            pushed?;
        }
        let mut state = self.state();
        state.settle()?;
        beside.map_or(Ok(()), |(number, numbers)| {
            self.record(&state, &step, number, &numbers)
        })?;
        Ok(all)
    }

    /// Records the run with this number and `note`, if it is written, as a finished unit.
    fn record(
        &self,
        state: &State<R>,
        step: &Step<'_>,
        number: usize,
        note: &impl Serialize,
    ) -> Result<()> {
        let name = self.run_name(number);
        let written = state.runs.iter().rfind(|run| run.name() == name);
        written.map_or(Ok(()), |run| {
            step.finish(number as u64, &(name, note), |unit| run.put(unit))
        })
    }

    /// True if all rows are on disk.
    #[must_use]
    pub fn is_spilled(&self) -> bool {
        self.state().buffer.is_empty()
    }

    /// Reopens the sorted runs of a step that were written in sequence; returns the value noted with the last
    /// one. Runs after a gap are not used.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`].
    pub fn reopen_runs<T: DeserializeOwned>(&self, step: &Step<'_>) -> Result<Option<T>> {
        let mut state = self.state();
        let mut last = None;
        for (number, (name, note)) in step.finished::<(String, T)>()? {
            if number as usize == state.runs.len() {
                state.runs.push(Run::reopen(&self.files, &name)?);
                last = Some(note);
            }
        }
        state.made = state.runs.len();
        Ok(last)
    }

    /// Writes the rows in the buffer as the next run of such a step.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn close_run<T: Serialize>(&self, step: &Step<'_>, note: &T) -> Result<()> {
        let mut state = self.state();
        let number = state.made;
        self.spill(&mut state, true)?;
        state.settle()?;
        self.record(&state, step, number, note)
    }

    /// Number of rows in the buffer.
    pub fn buffered(&self) -> usize {
        self.state().buffer.len()
    }

    /// Ends input; returns the rows in ascending order, equal rows adjacent.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`], [`crate::error::Error::Corrupt`],
    /// [`crate::error::Error::Cancelled`].
    pub fn finish(self, workspace: &Workspace) -> Result<Sorted<R>> {
        let mut state = {
            let mut guard = self.state();
            std::mem::replace(&mut *guard, State::new(self.capacity))
        };
        state.settle()?;
        if state.runs.is_empty() {
            self.files
                .pool()
                .install(|| sort::sort_on_threads(&mut state.buffer));
            return Ok(Sorted {
                buffer: state.buffer,
                runs: Vec::new(),
                held: state.held,
                files: self.files,
            });
        }
        if !state.buffer.is_empty() {
            self.spill(&mut state, false)?;
            state.settle()?;
        }
        state.buffer = Vec::new();
        state.report_usage(0);
        let step = workspace.step(&format!("merges {}", self.name))?;
        for (number, (name, merged)) in step.finished::<(String, Vec<String>)>()? {
            state.made = state.made.max(number as usize + 1);
            state.runs.retain(|run| !merged.contains(&run.name()));
            state.runs.push(Run::reopen(&self.files, &name)?);
        }
        // Each open run has one frame of rows and a file buffer of the same size.
        let fan_in = (self.capacity / (2 * FRAME)).clamp(2, 512);
        while state.runs.len() > fan_in {
            let rest = state.runs.split_off(fan_in.min(state.runs.len()));
            let batch = std::mem::replace(&mut state.runs, rest);
            let number = state.made as u64;
            state.report_usage(merge_bytes(&batch));
            let run = self.merge_runs(workspace, &batch, &mut state.made)?;
            let merged: Vec<String> = batch.iter().map(Run::name).collect();
            if run.is_kept() {
                step.finish(number, &(run.name(), &merged), |unit| run.put(unit))?;
            }
            drop(batch);
            merged
                .iter()
                .try_for_each(|name| self.files.release(name))?;
            state.runs.push(run);
        }
        let mut sorted = Sorted {
            buffer: Vec::new(),
            runs: state.runs,
            held: state.held,
            files: self.files,
        };
        sorted.report_usage(sorted.merge_bytes());
        Ok(sorted)
    }

    /// As [`Sorter::finish`], with all rows on disk.
    ///
    /// # Errors
    /// See [`Sorter::finish`].
    pub fn finish_on_disk(self, workspace: &Workspace) -> Result<SortedRuns<R>> {
        let mut state = self.state();
        state.settle()?;
        if state.runs.is_empty() {
            self.spill(&mut state, false)?;
        }
        drop(state);
        Ok(self.finish(workspace)?.runs())
    }

    /// Merges several runs into one.
    fn merge_runs(
        &self,
        workspace: &Workspace,
        batch: &[Run<R>],
        made: &mut usize,
    ) -> Result<Run<R>> {
        let kept = batch.iter().all(Run::is_kept);
        let mut writer = self.run_writer(made, kept)?;
        let mut frame = Vec::with_capacity(FRAME);
        merge(batch, None, None, |record: R| {
            frame.push(record);
            if frame.len() == FRAME {
                workspace.check_cancel()?;
                writer.frame(&frame)?;
                frame.clear();
            }
            Ok(())
        })?;
        writer.frame(&frame)?;
        writer.finish()
    }
}

#[cfg(test)]
pub(super) mod tests;
