//! The external sorter: sorted runs on disk, merged with a bounded fan-in.

use super::{Record, sort};
use crate::error::{Error, Result};
use crate::workspace::{IoCounters, Workspace};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// Records per checksummed frame of a run.
const FRAME: usize = 4096;

/// Bytes of a run that are read from its file at a time.
const FILE_BUFFER: usize = 1 << 15;

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

/// One sorted file of frames: `u32` length in records, `u32` CRC-32, records.
#[derive(Debug)]
struct Run<const N: usize> {
    path: PathBuf,
    bytes: u64,
    /// The first record of each frame; all frames but the last are full.
    firsts: Vec<Record<N>>,
    io: Arc<IoCounters>,
}

impl<const N: usize> Drop for Run<N> {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.bytes);
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
    }
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
    /// [`Error::Io`].
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
    /// [`Error::Io`], [`Error::Corrupt`].
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
    /// What `each` returned, [`Error::Io`], [`Error::Corrupt`].
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
    /// What `each` returned, [`Error::Io`], [`Error::Corrupt`].
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

fn merge<const N: usize>(
    runs: &[Run<N>],
    from: Option<Record<N>>,
    to: Option<Record<N>>,
    mut each: impl FnMut(Record<N>) -> Result<()>,
) -> Result<()> {
    let mut readers = runs
        .iter()
        .map(|run| RunReader::open(run, from, to))
        .collect::<Result<Vec<_>>>()?;
    let mut heap = BinaryHeap::with_capacity(readers.len());
    for (index, reader) in readers.iter_mut().enumerate() {
        if let Some(record) = reader.next()? {
            heap.push(Reverse((record, index)));
        }
    }
    while let Some(mut top) = heap.peek_mut() {
        let Reverse((record, index)) = *top;
        each(record)?;
        match readers[index].next()? {
            Some(next) => *top = Reverse((next, index)),
            None => {
                std::collections::binary_heap::PeekMut::pop(top);
            }
        }
    }
    Ok(())
}

struct RunWriter<const N: usize> {
    path: PathBuf,
    file: std::io::BufWriter<File>,
    bytes: u64,
    firsts: Vec<Record<N>>,
    io: Arc<IoCounters>,
}

impl<const N: usize> RunWriter<N> {
    fn create(path: PathBuf, io: Arc<IoCounters>) -> Result<Self> {
        let file = File::create_new(&path).map_err(|e| Error::io(&path, "create", e))?;
        Ok(Self {
            path,
            file: std::io::BufWriter::with_capacity(1 << 16, file),
            bytes: 0,
            firsts: Vec::new(),
            io,
        })
    }

    fn frame(&mut self, records: &[Record<N>]) -> Result<()> {
        let Some(first) = records.first() else {
            return Ok(());
        };
        self.firsts.push(*first);
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let head = [records.len() as u32, crc32fast::hash(bytes)];
        self.file
            .write_all(bytemuck::cast_slice(&head))
            .and_then(|()| self.file.write_all(bytes))
            .map_err(|e| Error::io(&self.path, format!("write {} bytes", bytes.len()), e))?;
        let all = bytes.len() as u64 + 8;
        self.bytes += all;
        self.io.add_written(all);
        self.io.grow_scratch(all);
        Ok(())
    }

    fn finish(self) -> Result<Run<N>> {
        self.file
            .into_inner()
            .map_err(|e| Error::io(&self.path, "flush", e.into_error()))?;
        Ok(Run {
            path: self.path,
            bytes: self.bytes,
            firsts: self.firsts,
            io: self.io,
        })
    }
}

struct RunReader<'a, const N: usize> {
    run: &'a Run<N>,
    to: Option<Record<N>>,
    file: std::io::BufReader<File>,
    offset: u64,
    frame: Vec<Record<N>>,
    at: usize,
}

impl<'a, const N: usize> RunReader<'a, N> {
    /// Stands before the first record that is not below `from`.
    fn open(run: &'a Run<N>, from: Option<Record<N>>, to: Option<Record<N>>) -> Result<Self> {
        let io = |action: &'static str| move |e| Error::io(&run.path, action, e);
        let mut file = File::open(&run.path).map_err(io("open"))?;
        // The frame before the first that begins at or above `from` may end above it.
        let below = from.map_or(0, |from| run.firsts.partition_point(|f| *f < from));
        let offset = below.saturating_sub(1) as u64 * (8 + FRAME * size_of::<Record<N>>()) as u64;
        if offset > 0 {
            file.seek(SeekFrom::Start(offset)).map_err(io("seek in"))?;
        }
        let mut reader = Self {
            run,
            to,
            file: std::io::BufReader::with_capacity(FILE_BUFFER, file),
            offset,
            frame: Vec::new(),
            at: 0,
        };
        if let Some(from) = from.filter(|_| below > 0) {
            reader.read_frame()?;
            reader.at = reader.frame.partition_point(|record| *record < from);
        }
        Ok(reader)
    }

    fn next(&mut self) -> Result<Option<Record<N>>> {
        if self.at == self.frame.len() {
            if self.offset == self.run.bytes {
                return Ok(None);
            }
            self.read_frame()?;
        }
        let record = self.frame[self.at];
        if self.to.is_some_and(|to| record >= to) {
            return Ok(None);
        }
        self.at += 1;
        Ok(Some(record))
    }

    fn corrupt(&self, found: String, expected: String) -> Error {
        Error::Corrupt {
            path: self.run.path.clone(),
            offset: self.offset,
            found,
            expected,
        }
    }

    fn read_frame(&mut self) -> Result<()> {
        let mut head = [0u32; 2];
        let io = |e| Error::io(&self.run.path, "read", e);
        self.file
            .read_exact(bytemuck::cast_slice_mut(&mut head))
            .map_err(io)?;
        if head[0] == 0 || head[0] as usize > FRAME {
            return Err(self.corrupt(
                format!("a frame of {} records", head[0]),
                format!("1 to {FRAME}"),
            ));
        }
        self.frame.resize(head[0] as usize, [0; N]);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut self.frame);
        self.file.read_exact(bytes).map_err(io)?;
        let (all, crc) = (bytes.len() as u64 + 8, crc32fast::hash(bytes));
        if crc != head[1] {
            return Err(self.corrupt(format!("checksum {crc:08x}"), format!("{:08x}", head[1])));
        }
        self.run.io.add_read(all);
        self.offset += all;
        self.at = 0;
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
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
