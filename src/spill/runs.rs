//! Sorted runs on disk: written frame by frame, merged in whole or over a range.

use super::Record;
use crate::error::{Error, Result};
use crate::workspace::IoCounters;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::Arc;

/// Records per checksummed frame of a run.
pub(super) const FRAME: usize = 4096;

/// Bytes of a run that are read from its file at a time.
pub(super) const FILE_BUFFER: usize = 1 << 15;

/// One sorted file of frames: `u32` length in records, `u32` CRC-32, records.
#[derive(Debug)]
pub(super) struct Run<const N: usize> {
    path: PathBuf,
    bytes: u64,
    /// The first record of each frame; all frames but the last are full.
    pub(super) firsts: Vec<Record<N>>,
    io: Arc<IoCounters>,
}

impl<const N: usize> Drop for Run<N> {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.bytes);
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Calls `each` with the records of all runs from `from` on and below `to`, ascending.
pub(super) fn merge<const N: usize>(
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

/// Writes a run.
pub(super) struct RunWriter<const N: usize> {
    path: PathBuf,
    file: std::io::BufWriter<File>,
    bytes: u64,
    firsts: Vec<Record<N>>,
    io: Arc<IoCounters>,
}

impl<const N: usize> RunWriter<N> {
    pub(super) fn create(path: PathBuf, io: Arc<IoCounters>) -> Result<Self> {
        let file = File::create_new(&path).map_err(|e| Error::io(&path, "create", e))?;
        Ok(Self {
            path,
            file: std::io::BufWriter::with_capacity(1 << 16, file),
            bytes: 0,
            firsts: Vec::new(),
            io,
        })
    }

    pub(super) fn frame(&mut self, records: &[Record<N>]) -> Result<()> {
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

    pub(super) fn finish(self) -> Result<Run<N>> {
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
