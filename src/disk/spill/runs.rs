//! Sorted runs on disk: written frame by frame, merged completely or over a range.

use super::Row;
use crate::error::{Error, Result};
use crate::workspace::file::ScratchFile;
use crate::workspace::place::Place;
use crate::workspace::{Files, Unit};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::io::Read;
use std::sync::Arc;

/// Rows in a checksummed frame of a run.
pub(super) const FRAME: usize = 4096;

/// Bytes read at a time from the file of a run.
pub(super) const FILE_BUFFER: usize = 1 << 15;

/// A sorted file of frames: `u32` number of rows, `u32` CRC-32, rows.
#[derive(Debug)]
pub(super) struct Run<R: Row> {
    file: Arc<ScratchFile>,
    /// The first row of each frame; all frames but the last are full.
    pub(super) firsts: Vec<R>,
    /// The whole file, which is one segment.
    place: Place,
}

/// Bytes of a full frame.
const fn frame_bytes<R: Row>() -> u64 {
    (8 + FRAME * size_of::<R>()) as u64
}

impl<R: Row> Run<R> {
    /// Name of the file.
    pub(super) fn name(&self) -> String {
        self.file.name.clone()
    }

    /// True if a resumed run can use the file.
    pub(super) fn is_kept(&self) -> bool {
        self.file.is_kept()
    }

    /// Notes that a unit wrote the file.
    pub(super) fn put(&self, unit: &Unit<'_>) -> Result<()> {
        self.file.put(unit, 0, self.place)
    }

    /// The run `name`, written before. It has no frames if an earlier attempt deleted it.
    pub(super) fn reopen(files: &Files, name: &str) -> Result<Self> {
        let file = files.open(name, true)?;
        let place = file.section(0);
        let mut firsts = Vec::new();
        if !file.is_gone() {
            let mut first = R::zeroed();
            for frame in 0..(place.bytes as u64).div_ceil(frame_bytes::<R>()) {
                let at = frame * frame_bytes::<R>() + 8;
                file.read(place.segment, at, bytemuck::bytes_of_mut(&mut first))?;
                firsts.push(first);
            }
            file.close();
        }
        Ok(Self {
            file,
            firsts,
            place,
        })
    }
}

/// The next row of a run, with the number of the run: equal rows come in the order of runs.
struct Next<R>(R, usize);

impl<R: Row> Ord for Next<R> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.compare(&other.0).then(self.1.cmp(&other.1))
    }
}

impl<R: Row> PartialOrd for Next<R> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<R: Row> PartialEq for Next<R> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<R: Row> Eq for Next<R> {}

/// Calls `each` with the rows of all runs from `from` (inclusive) to `to` (exclusive), ascending.
pub(super) fn merge<R: Row>(
    runs: &[Run<R>],
    from: Option<R>,
    to: Option<R>,
    mut each: impl FnMut(R) -> Result<()>,
) -> Result<()> {
    let mut readers = runs
        .iter()
        .filter(|run| run.place.bytes > 0)
        .map(|run| RunReader::open(run, from, to))
        .collect::<Result<Vec<_>>>()?;
    let mut heap = BinaryHeap::with_capacity(readers.len());
    for (index, reader) in readers.iter_mut().enumerate() {
        if let Some(record) = reader.next()? {
            heap.push(Reverse(Next(record, index)));
        }
    }
    while let Some(mut top) = heap.peek_mut() {
        let Reverse(Next(record, index)) = *top;
        each(record)?;
        match readers[index].next()? {
            Some(next) => *top = Reverse(Next(next, index)),
            None => {
                std::collections::binary_heap::PeekMut::pop(top);
            }
        }
    }
    Ok(())
}

/// Writes a run.
#[derive(Debug)]
pub(super) struct RunWriter<R: Row> {
    file: Arc<ScratchFile>,
    worker: usize,
    firsts: Vec<R>,
    place: Place,
    crc: crc32fast::Hasher,
    frame: Vec<u8>,
}

impl<R: Row> RunWriter<R> {
    /// A writer of the new file `name`, for a later attempt at the run if `kept`.
    pub(super) fn new(files: &Files, name: &str, kept: bool) -> Result<Self> {
        Ok(Self {
            file: files.open(name, kept)?,
            worker: files.worker(),
            firsts: Vec::new(),
            place: Place::default(),
            crc: crc32fast::Hasher::new(),
            frame: Vec::new(),
        })
    }

    pub(super) fn frame(&mut self, records: &[R]) -> Result<()> {
        let Some(first) = records.first() else {
            return Ok(());
        };
        self.firsts.push(*first);
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let head = [records.len() as u32, crc32fast::hash(bytes)];
        self.frame.clear();
        self.frame.extend_from_slice(bytemuck::cast_slice(&head));
        self.frame.extend_from_slice(bytes);
        self.crc.update(&self.frame);
        let place = self.file.append(self.worker, &self.frame, records.len())?;
        self.place.segment = place.segment;
        self.place.bytes += place.bytes;
        self.place.records += place.records;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<Run<R>> {
        self.file.close();
        self.place.crc = self.crc.finalize();
        self.file.set(0, self.place)?;
        Ok(Run {
            file: self.file,
            firsts: self.firsts,
            place: self.place,
        })
    }
}

struct RunReader<'a, R: Row> {
    run: &'a Run<R>,
    to: Option<R>,
    source: std::io::BufReader<Bytes<'a, R>>,
    offset: u64,
    frame: Vec<R>,
    at: usize,
}

/// The bytes of a run from a place on.
struct Bytes<'a, R: Row> {
    run: &'a Run<R>,
    at: u64,
}

impl<R: Row> Read for Bytes<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let left = (self.run.place.bytes as u64).saturating_sub(self.at);
        let count = buffer
            .len()
            .min(usize::try_from(left).unwrap_or(usize::MAX));
        let (file, segment) = (&self.run.file, self.run.place.segment);
        let read = file.read(segment, self.at, &mut buffer[..count]);
        read.map_err(|error| match error {
            Error::Io { source, .. } => source,
            _ => std::io::ErrorKind::UnexpectedEof.into(),
        })?;
        self.at += count as u64;
        Ok(count)
    }
}

impl<'a, R: Row> RunReader<'a, R> {
    /// Positioned before the first row that is not below `from`.
    fn open(run: &'a Run<R>, from: Option<R>, to: Option<R>) -> Result<Self> {
        // The frame before the first that begins at or above `from` may end above `from`.
        let is_below = |from: R| move |row: &R| row.compare(&from) == Ordering::Less;
        let below = from.map_or(0, |from| run.firsts.partition_point(is_below(from)));
        let offset = below.saturating_sub(1) as u64 * frame_bytes::<R>();
        let mut reader = Self {
            run,
            to,
            source: std::io::BufReader::with_capacity(FILE_BUFFER, Bytes { run, at: offset }),
            offset,
            frame: Vec::new(),
            at: 0,
        };
        if let Some(from) = from.filter(|_| below > 0) {
            reader.read_frame()?;
            reader.at = reader.frame.partition_point(is_below(from));
        }
        Ok(reader)
    }

    fn next(&mut self) -> Result<Option<R>> {
        if self.at == self.frame.len() {
            if self.offset == self.run.place.bytes as u64 {
                return Ok(None);
            }
            self.read_frame()?;
        }
        let record = self.frame[self.at];
        if self
            .to
            .is_some_and(|to| record.compare(&to) != Ordering::Less)
        {
            return Ok(None);
        }
        self.at += 1;
        Ok(Some(record))
    }

    fn corrupt(&self, found: String, expected: String) -> Error {
        let segment = self.run.place.segment;
        self.run.file.damaged(segment, self.offset, found, expected)
    }

    fn failed(&self, error: std::io::Error) -> Error {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            return self.corrupt("the end of the file".into(), "a frame of records".into());
        }
        Error::io(self.run.file.path(self.run.place.segment), "read", error)
    }

    fn read_frame(&mut self) -> Result<()> {
        let mut head = [0u32; 2];
        let read = self.source.read_exact(bytemuck::cast_slice_mut(&mut head));
        read.map_err(|e| self.failed(e))?;
        if head[0] == 0 || head[0] as usize > FRAME {
            return Err(self.corrupt(
                format!("a frame of {} records", head[0]),
                format!("1 to {FRAME}"),
            ));
        }
        self.frame.resize(head[0] as usize, R::zeroed());
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut self.frame);
        let read = self.source.read_exact(bytes);
        let (all, crc) = (bytes.len() as u64 + 8, crc32fast::hash(bytes));
        read.map_err(|e| self.failed(e))?;
        if crc != head[1] {
            return Err(self.corrupt(format!("checksum {crc:08x}"), format!("{:08x}", head[1])));
        }
        self.offset += all;
        self.at = 0;
        Ok(())
    }
}
