//! Sorted runs on disk: written frame by frame, merged completely or over a range.

use super::Row;
use crate::error::{Error, Result};
use crate::workspace::Workspace;
use crate::workspace::file::ScratchFile;
use crate::workspace::open::open_existing;
use crate::workspace::persist::{Persist, Saved};
use crate::workspace::place::Place;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;

/// Rows in a checksummed frame of a run.
pub(super) const FRAME: usize = 4096;

/// Bytes read at a time from the file of a run.
pub(super) const FILE_BUFFER: usize = 1 << 15;

/// A sorted file of frames: `u32` number of rows, `u32` CRC-32, rows.
#[derive(Debug)]
pub(super) struct Run<R: Row> {
    file: ScratchFile,
    bytes: u64,
    /// The first row of each frame; all frames but the last are full.
    pub(super) firsts: Vec<R>,
    /// The whole file.
    place: Place,
}

/// Bytes of a full frame.
const fn frame_bytes<R: Row>() -> u64 {
    (8 + FRAME * size_of::<R>()) as u64
}

impl<R: Row> Run<R> {
    /// Name of the file.
    pub(super) fn name(&self) -> String {
        self.file.name.to_string()
    }

    /// True if a resumed run can use the file.
    pub(super) fn is_kept(&self) -> bool {
        self.file.is_kept()
    }

    /// Notes the file in the journal.
    pub(super) fn put(&self) -> Result<()> {
        self.file.put(0, self.place)
    }

    /// The run `name` of an earlier attempt. It has no frames if it was deleted since.
    pub(super) fn reopen(workspace: &Workspace, name: &str) -> Result<Self> {
        let (mut file, places) = workspace.keep_file(name)?;
        let place = places.first().map_or(Place::default(), |(_, place)| *place);
        let bytes = place.bytes as u64;
        let mut firsts = Vec::new();
        if !file.is_gone() {
            let io = |e| Error::io(&file.path, "read", e);
            let handle = open_existing(&file.path).map_err(io)?;
            let mut first = R::zeroed();
            for frame in 0..bytes.div_ceil(frame_bytes::<R>()) {
                let at = frame * frame_bytes::<R>() + 8;
                let first_bytes = bytemuck::bytes_of_mut(&mut first);
                handle.read_exact_at(first_bytes, at).map_err(io)?;
                firsts.push(first);
            }
            file.close();
        }
        Ok(Self {
            file,
            bytes,
            firsts,
            place,
        })
    }
}

impl<R: Row> Persist for Run<R> {
    fn save(&self, out: &mut Vec<u8>) {
        self.file.name.to_string().save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let name = String::load(from)?;
        Self::reopen(from.workspace, &name)
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
pub(super) struct RunWriter<R: Row> {
    file: ScratchFile,
    bytes: u64,
    firsts: Vec<R>,
    /// CRC-32 of the whole file, if a resumed run may need it.
    crc: Option<crc32fast::Hasher>,
    frame: Vec<u8>,
}

impl<R: Row> RunWriter<R> {
    pub(super) fn new(file: ScratchFile, kept: bool) -> Self {
        Self {
            file,
            bytes: 0,
            firsts: Vec::new(),
            crc: kept.then(crc32fast::Hasher::new),
            frame: Vec::new(),
        }
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
        if let Some(crc) = &mut self.crc {
            crc.update(&self.frame);
        }
        self.file.append(&self.frame)?;
        self.bytes += self.frame.len() as u64;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Run<R> {
        self.file.close();
        Run {
            place: Place {
                offset: 0,
                bytes: self.bytes as usize,
                records: 0,
                crc: self.crc.map_or(0, crc32fast::Hasher::finalize),
            },
            file: self.file,
            bytes: self.bytes,
            firsts: self.firsts,
        }
    }
}

struct RunReader<'a, R: Row> {
    run: &'a Run<R>,
    to: Option<R>,
    source: std::io::BufReader<File>,
    offset: u64,
    frame: Vec<R>,
    at: usize,
}

impl<'a, R: Row> RunReader<'a, R> {
    /// Positioned before the first row that is not below `from`.
    fn open(run: &'a Run<R>, from: Option<R>, to: Option<R>) -> Result<Self> {
        let io = |action: &'static str| move |e| Error::io(&run.file.path, action, e);
        let mut file = open_existing(&run.file.path).map_err(io("open"))?;
        // The frame before the first that begins at or above `from` may end above `from`.
        let is_below = |from: R| move |row: &R| row.compare(&from) == Ordering::Less;
        let below = from.map_or(0, |from| run.firsts.partition_point(is_below(from)));
        let offset = below.saturating_sub(1) as u64 * frame_bytes::<R>();
        if offset > 0 {
            file.seek(SeekFrom::Start(offset)).map_err(io("seek in"))?;
        }
        let mut reader = Self {
            run,
            to,
            source: std::io::BufReader::with_capacity(FILE_BUFFER, file),
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
            if self.offset == self.run.bytes {
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
        self.run.file.damaged(self.offset, found, expected)
    }

    fn failed(&self, error: std::io::Error) -> Error {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            return self.corrupt("the end of the file".into(), "a frame of records".into());
        }
        Error::io(&self.run.file.path, "read", error)
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
        self.run.file.count_read(all);
        self.offset += all;
        self.at = 0;
        Ok(())
    }
}
