//! The external sorter: sorted runs on disk, merged with a bounded fan-in.

use super::runs::{FILE_BUFFER, FRAME, Run, RunWriter, merge};
use super::{Record, sort};
use crate::error::Result;
use crate::workspace::{IoCounters, Workspace};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// Sorts any number of records in a bounded buffer.
#[derive(Debug)]
pub struct Sorter<const N: usize> {
    state: Mutex<State<N>>,
    capacity: usize,
    folder_name: PathBuf,
    io: Arc<IoCounters>,
    pool: Arc<rayon::ThreadPool>,
}

#[derive(Debug)]
struct State<const N: usize> {
    buffer: Vec<Record<N>>,
    runs: Vec<Run<N>>,
    made: usize,
}

impl<const N: usize> Sorter<N> {
    /// A sorter whose buffers take at most `buffer` bytes, already reserved by the caller.
    #[must_use]
    pub fn new(workspace: &Workspace, name: &str, buffer: u64) -> Self {
        let capacity = (buffer as usize / size_of::<Record<N>>()).max(2);
        Self {
            state: Mutex::new(State {
                buffer: Vec::new(),
                runs: Vec::new(),
                made: 0,
            }),
            capacity,
            folder_name: workspace.file(name),
            io: workspace.io.clone(),
            pool: workspace.pool(),
        }
    }

    /// Takes records in; safe to call from several threads.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn push(&self, mut records: &[Record<N>]) -> Result<()> {
        let mut state = self
            .state
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        while !records.is_empty() {
            let room = self.capacity - state.buffer.len();
            let (now, later) = records.split_at(room.min(records.len()));
            let wanted = state.buffer.len() + now.len();
            if wanted > state.buffer.capacity() {
                // Doubling, but never past what was reserved.
                let target = wanted.max(2 * state.buffer.len()).min(self.capacity);
                let more = target - state.buffer.len();
                state.buffer.reserve_exact(more);
            }
            state.buffer.extend_from_slice(now);
            records = later;
            if state.buffer.len() == self.capacity {
                self.spill(&mut state)?;
            }
        }
        Ok(())
    }

    fn spill(&self, state: &mut State<N>) -> Result<()> {
        self.pool.install(|| sort::sort(&mut state.buffer));
        let mut writer = self.run_writer(&mut state.made)?;
        for frame in state.buffer.chunks(FRAME) {
            writer.frame(frame)?;
        }
        state.runs.push(writer.finish()?);
        state.buffer.clear();
        Ok(())
    }

    fn run_writer(&self, made: &mut usize) -> Result<RunWriter<N>> {
        let mut name = self.folder_name.clone().into_os_string();
        name.push(format!(".run{made}"));
        *made += 1;
        RunWriter::create(name.into(), self.io.clone())
    }

    /// Ends input: the records in ascending order, equal ones adjacent.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn finish(self, workspace: &Workspace) -> Result<Sorted<N>> {
        let mut state = {
            let mut guard = self
                .state
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            std::mem::replace(
                &mut *guard,
                State {
                    buffer: Vec::new(),
                    runs: Vec::new(),
                    made: 0,
                },
            )
        };
        if state.runs.is_empty() {
            self.pool.install(|| sort::sort(&mut state.buffer));
            return Ok(Sorted {
                buffer: state.buffer,
                runs: Vec::new(),
            });
        }
        if !state.buffer.is_empty() {
            self.spill(&mut state)?;
        }
        state.buffer = Vec::new();
        // Each open run holds one frame of records and as many bytes of file buffer.
        let fan_in = (self.capacity / (2 * FRAME)).clamp(2, 512);
        while state.runs.len() > fan_in {
            workspace.check_cancel()?;
            let rest = state.runs.split_off(fan_in.min(state.runs.len()));
            let batch = std::mem::replace(&mut state.runs, rest);
            let mut writer = self.run_writer(&mut state.made)?;
            let mut frame = Vec::with_capacity(FRAME);
            merge(&batch, None, None, |record: Record<N>| {
                frame.push(record);
                if frame.len() == FRAME {
                    writer.frame(&frame)?;
                    frame.clear();
                }
                Ok(())
            })?;
            writer.frame(&frame)?;
            state.runs.push(writer.finish()?);
        }
        Ok(Sorted {
            buffer: Vec::new(),
            runs: state.runs,
        })
    }
}

/// The output of a [`Sorter`].
#[derive(Debug)]
pub struct Sorted<const N: usize> {
    buffer: Vec<Record<N>>,
    runs: Vec<Run<N>>,
}

impl<const N: usize> Sorted<N> {
    /// All records in ascending order if they are in memory.
    ///
    /// # Errors
    /// The records as they were, on disk.
    pub fn in_memory(self) -> std::result::Result<Vec<Record<N>>, Self> {
        if self.runs.is_empty() {
            Ok(self.buffer)
        } else {
            Err(self)
        }
    }

    /// Calls `each` with every record in ascending order.
    ///
    /// # Errors
    /// What `each` returned, [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn for_each(self, mut each: impl FnMut(Record<N>) -> Result<()>) -> Result<()> {
        if self.runs.is_empty() {
            return self.buffer.into_iter().try_for_each(each);
        }
        merge(&self.runs, None, None, &mut each)
    }

    /// Records that cut what is on disk into parts of about `records` records, more by no more than
    /// a frame of each run; ascending.
    #[must_use]
    pub fn cuts(&self, records: usize) -> Vec<Record<N>> {
        let mut firsts: Vec<Record<N>> =
            self.runs.iter().flat_map(|r| &r.firsts).copied().collect();
        firsts.sort_unstable();
        let frames = (records / FRAME).max(1);
        let mut cuts: Vec<Record<N>> = firsts.into_iter().step_by(frames).skip(1).collect();
        cuts.dedup();
        cuts
    }

    /// Calls `each` with every record on disk from `from` on and below `to`, in ascending order.
    /// Several threads may do so at the same time, each in memory of [`Sorted::merge_bytes`].
    ///
    /// # Errors
    /// What `each` returned, [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn for_range(
        &self,
        from: Option<Record<N>>,
        to: Option<Record<N>>,
        each: impl FnMut(Record<N>) -> Result<()>,
    ) -> Result<()> {
        merge(&self.runs, from, to, each)
    }

    /// Memory that merging takes, in bytes.
    #[must_use]
    pub fn merge_bytes(&self) -> u64 {
        (self.runs.len() * (FRAME * size_of::<Record<N>>() + FILE_BUFFER)) as u64
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::error::Error;
    use crate::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
    use crate::workspace::progress::{Cancel, Silent};
    use proptest::prelude::*;

    pub(in crate::spill) fn workspace() -> Workspace {
        let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        Workspace::new(
            &std::env::temp_dir(),
            memory,
            2,
            Arc::new(Silent),
            Cancel::new(),
        )
        .unwrap()
    }

    fn collect<const N: usize>(sorted: Sorted<N>) -> Vec<Record<N>> {
        let mut all = Vec::new();
        sorted
            .for_each(|r| {
                all.push(r);
                Ok(())
            })
            .unwrap();
        all
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn sorts_like_the_standard_library(
            mut records in prop::collection::vec([0u32..50, 0u32..9], 0..30_000),
            buffer in prop::sample::select(vec![16u64, 4096, 100_000, 10_000_000]),
        ) {
            // A tiny buffer makes a run of every few records, so it gets few records.
            if buffer == 16 { records.truncate(900); }
            let workspace = workspace();
            let sorter = Sorter::<2>::new(&workspace, "s", buffer);
            for chunk in records.chunks(1000) { sorter.push(chunk).unwrap(); }
            let got = collect(sorter.finish(&workspace).unwrap());
            records.sort_unstable();
            prop_assert_eq!(got, records);
        }

        #[test]
        fn parts_make_the_whole(
            mut records in prop::collection::vec([0u32..5000, 0u32..2], 1..40_000),
            part in prop::sample::select(vec![1usize, 9000, 100_000]),
        ) {
            let workspace = workspace();
            let sorter = Sorter::<2>::new(&workspace, "s", 80_000);
            for chunk in records.chunks(1000) { sorter.push(chunk).unwrap(); }
            let sorted = sorter.finish(&workspace).unwrap();
            if let Err(sorted) = sorted.in_memory() {
                let cuts = sorted.cuts(part);
                let ends = cuts.iter().copied().map(Some).chain([None]);
                let mut got = Vec::new();
                let mut from = None;
                for to in ends {
                    sorted.for_range(from, to, |r| { got.push(r); Ok(()) }).unwrap();
                    from = to;
                }
                records.sort_unstable();
                prop_assert_eq!(got, records);
            }
        }
    }

    #[test]
    fn damage_is_found_and_named() {
        let workspace = workspace();
        let sorter = Sorter::<2>::new(&workspace, "d", 800);
        for i in 0..1000u32 {
            sorter.push(&[[i * 7 % 1000, i]]).unwrap();
        }
        let path = workspace.file("d.run3");
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        std::fs::write(&path, bytes).unwrap();
        let outcome = sorter
            .finish(&workspace)
            .and_then(|sorted| sorted.for_each(|_| Ok(())));
        match outcome {
            Err(Error::Corrupt { path, .. }) => {
                assert!(
                    path.to_string_lossy().contains("d.run"),
                    "{}",
                    path.display()
                );
            }
            other => panic!("{other:?}"),
        }
    }
}
