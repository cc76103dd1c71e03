//! Rows distributed to numbered buckets without sorting: one block of each bucket in memory, the full blocks
//! in one scratch file, linked from the last to the first.
//!
//! Only the offset of a bucket's last block is kept, so memory does not grow with the number of rows. Rows
//! are read in another order than they were written.

use crate::error::{Error, Result};
use crate::spill::Row;
use crate::workspace::{IoCounters, Workspace};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::Arc;

/// The offset for "no block".
const NONE: u64 = u64::MAX;

/// Bytes before the rows of a block: offset of the block before (8), number of rows (4), CRC-32 of both and
/// the rows (4).
const HEAD: u64 = 16;

/// Buckets of rows.
#[derive(Debug)]
pub(super) struct Buckets<R: Row> {
    path: PathBuf,
    file: Option<File>,
    open: Vec<Vec<R>>,
    last: Vec<u64>,
    block: usize,
    end: u64,
    io: Arc<IoCounters>,
}

/// The read position in a bucket.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor {
    bucket: usize,
    next: Option<u64>,
}

impl<R: Row> Buckets<R> {
    /// `count` buckets with blocks of `bytes` bytes; full blocks go to the scratch file `name`.
    pub(super) fn new(workspace: &Workspace, name: &str, count: usize, bytes: u64) -> Self {
        Self {
            path: workspace.file(name),
            file: None,
            open: vec![Vec::new(); count],
            last: vec![NONE; count],
            block: (bytes as usize / size_of::<R>()).max(1),
            end: 0,
            io: workspace.io.clone(),
        }
    }

    /// Adds a row to a bucket.
    pub(super) fn push(&mut self, bucket: usize, row: R) -> Result<()> {
        let open = &mut self.open[bucket];
        if open.len() == open.capacity() {
            // Doubles the buffer, up to one block.
            let target = (2 * open.len()).clamp(1, self.block);
            open.reserve_exact(target - open.len());
        }
        open.push(row);
        if open.len() == self.block {
            self.flush(bucket)?;
        }
        Ok(())
    }

    fn flush(&mut self, bucket: usize) -> Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(
                File::options()
                    .read(true)
                    .write(true)
                    .create_new(true)
                    .open(&self.path)
                    .map_err(|e| Error::io(&self.path, "create", e))?,
            ),
        };
        let records: &[u8] = bytemuck::cast_slice(&self.open[bucket]);
        let head = Head::new(self.last[bucket], self.open[bucket].len() as u32, records);
        let bytes = HEAD + records.len() as u64;
        file.write_all_at(bytemuck::cast_slice(&head.0), self.end)
            .and_then(|()| file.write_all_at(records, self.end + HEAD))
            .map_err(|e| Error::io(&self.path, format!("write {bytes} bytes"), e))?;
        self.last[bucket] = self.end;
        self.end += bytes;
        self.io.add_written(bytes);
        self.io.grow_scratch(bytes);
        self.open[bucket].clear();
        Ok(())
    }

    /// A cursor at the start of a bucket.
    pub(super) fn cursor(&self, bucket: usize) -> Cursor {
        Cursor { bucket, next: None }
    }

    /// Reads the next block of a bucket into `block`; `false` after the last. Rows added to that bucket
    /// meanwhile may be missed.
    pub(super) fn next(&self, cursor: &mut Cursor, block: &mut Vec<R>) -> Result<bool> {
        block.clear();
        let offset = match cursor.next {
            None => {
                cursor.next = Some(self.last[cursor.bucket]);
                block.extend_from_slice(&self.open[cursor.bucket]);
                if !block.is_empty() {
                    return Ok(true);
                }
                self.last[cursor.bucket]
            }
            Some(offset) => offset,
        };
        let (Some(file), true) = (&self.file, offset != NONE) else {
            return Ok(false);
        };
        let io = |e| Error::io(&self.path, "read", e);
        let mut head = Head([0; 4]);
        file.read_exact_at(bytemuck::cast_slice_mut(&mut head.0), offset)
            .map_err(io)?;
        let found = head.0[2] as usize;
        if found == 0 || found > self.block {
            let found = format!("a block of {found} records");
            return Err(self.corrupt(offset, found, format!("1 to {}", self.block)));
        }
        block.resize(found, R::zeroed());
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(block);
        file.read_exact_at(bytes, offset + HEAD).map_err(io)?;
        let right = Head::new(head.before(), head.0[2], bytes);
        if right.0[3] != head.0[3] {
            let (found, expected) = (head.0[3], right.0[3]);
            let found = format!("checksum {found:08x}");
            return Err(self.corrupt(offset, found, format!("{expected:08x}")));
        }
        self.io.add_read(HEAD + bytes.len() as u64);
        cursor.next = Some(head.before());
        Ok(true)
    }

    fn corrupt(&self, offset: u64, found: String, expected: String) -> Error {
        Error::Corrupt {
            path: self.path.clone(),
            offset,
            found,
            expected,
        }
    }

    /// Empties a bucket and frees its memory.
    pub(super) fn clear(&mut self, bucket: usize) {
        self.open[bucket] = Vec::new();
        self.last[bucket] = NONE;
    }
}

impl<R: Row> Drop for Buckets<R> {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.end);
        if self.file.is_some() {
            // A scratch file that cannot be deleted is deleted with its folder.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The header of a block, as words.
struct Head([u32; 4]);

impl Head {
    fn new(before: u64, records: u32, bytes: &[u8]) -> Self {
        let mut words = [before as u32, (before >> 32) as u32, records, 0];
        let mut crc = crc32fast::Hasher::new();
        crc.update(bytemuck::cast_slice(&words[..3]));
        crc.update(bytes);
        words[3] = crc.finalize();
        Self(words)
    }

    fn before(&self) -> u64 {
        u64::from(self.0[0]) | (u64::from(self.0[1]) << 32)
    }
}
