//! Rows distributed to numbered buckets without sorting: one block of each bucket in memory, the full blocks
//! in one scratch file, linked from the last to the first.
//!
//! Only the place of a bucket's last block is kept, so memory does not grow with the number of rows. Rows
//! are read in another order than they were written.

use outcrop_disk::error::Result;
use outcrop_disk::spill::Row;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Files, Workspace};
use std::sync::Arc;

/// A block in the file, by its segment, offset and checksum. It is stored in front of the rows of the block
/// after it.
type Link = [u64; 3];

/// The link for "no block".
const NONE: Link = [u64::MAX; 3];

/// Buckets of rows.
#[derive(Debug)]
pub(super) struct Buckets<R: Row> {
    file: Arc<ScratchFile>,
    files: Files,
    open: Vec<Vec<R>>,
    last: Vec<Link>,
    /// Rows of a full block.
    block: usize,
}

/// The read position in a bucket, and the block that was read.
#[derive(Debug)]
pub(super) struct Cursor<R> {
    bucket: usize,
    next: Option<Link>,
    block: Vec<R>,
    /// A block as it is in the file.
    bytes: Vec<u8>,
}

impl<R: Row> Buckets<R> {
    /// `count` buckets with blocks of `bytes` bytes; full blocks go to the scratch file `name`.
    pub(super) fn new(workspace: &Workspace, name: &str, count: usize, bytes: u64) -> Result<Self> {
        Ok(Self {
            file: workspace.files.open(name, false)?,
            files: workspace.files.clone(),
            open: vec![Vec::new(); count],
            last: vec![NONE; count],
            block: (bytes as usize / size_of::<R>()).max(1),
        })
    }

    /// Adds a row to a bucket.
    pub(super) fn push(&mut self, bucket: usize, row: R) -> Result<()> {
        let (open, last) = (&mut self.open[bucket], &mut self.last[bucket]);
        if open.len() == open.capacity() {
            // Doubles the buffer, up to one block.
            let target = (2 * open.len()).clamp(1, self.block);
            open.reserve_exact(target - open.len());
        }
        open.push(row);
        if open.len() == self.block {
            let bytes = [bytemuck::bytes_of(last), bytemuck::cast_slice(open)].concat();
            let place = self.file.append(0, &bytes, open.len())?;
            *last = [place.segment.into(), place.offset, place.crc.into()];
            open.clear();
        }
        Ok(())
    }

    /// A cursor at the start of a bucket.
    pub(super) fn cursor(&self, bucket: usize) -> Cursor<R> {
        Cursor {
            bucket,
            next: None,
            block: Vec::new(),
            bytes: Vec::new(),
        }
    }

    /// Reads the next block of a bucket; none after the last. Rows added to that bucket meanwhile may be
    /// missed.
    pub(super) fn next<'a>(&self, cursor: &'a mut Cursor<R>) -> Result<Option<&'a [R]>> {
        cursor.block.clear();
        let link = cursor.next.unwrap_or(self.last[cursor.bucket]);
        if cursor.next.is_none() && !self.open[cursor.bucket].is_empty() {
            cursor.block.extend_from_slice(&self.open[cursor.bucket]);
            cursor.next = Some(link);
        } else if link == NONE {
            return Ok(None);
        } else {
            let bytes = &mut cursor.bytes;
            bytes.resize(size_of::<Link>() + self.block * size_of::<R>(), 0);
            let [segment, offset, crc] = link;
            let place = Place {
                segment: segment as u32,
                offset,
                bytes: bytes.len(),
                records: self.block,
                crc: crc as u32,
            };
            self.file.read_part(place, bytes)?;
            let (before, rows) = bytes.split_at(size_of::<Link>());
            cursor.next = Some(bytemuck::pod_read_unaligned(before));
            cursor.block.resize(self.block, R::zeroed());
            bytemuck::cast_slice_mut(&mut cursor.block).copy_from_slice(rows);
        }
        Ok(Some(&cursor.block))
    }

    /// Empties a bucket and frees its memory.
    pub(super) fn clear(&mut self, bucket: usize) {
        self.open[bucket] = Vec::new();
        self.last[bucket] = NONE;
    }
}

impl<R: Row> Drop for Buckets<R> {
    fn drop(&mut self) {
        // A file that cannot be deleted is deleted with its folder.
        let _ = self.files.release(&self.file.name);
    }
}
