//! Bytes on their way to a scratch file.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Files, Workspace};
use std::path::PathBuf;
use std::sync::Arc;

/// Bytes that are written or read at a time.
pub(super) const CHUNK: usize = 1 << 20;

/// Bytes that are appended to a scratch file chunk by chunk, from one thread.
pub(super) struct Stream {
    file: Arc<ScratchFile>,
    name: String,
    files: Files,
    buffer: Vec<u8>,
    begin: Option<Place>,
    bytes: u64,
}

impl Stream {
    pub fn new(name: String, workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            file: workspace.files.open(&name, false)?,
            name,
            files: workspace.files.clone(),
            buffer: Vec::with_capacity(CHUNK),
            begin: None,
            bytes: 0,
        })
    }

    pub fn push(&mut self, bytes: &[u8]) -> Result<()> {
        if self.buffer.len() + bytes.len() > CHUNK {
            self.flush()?;
        }
        self.buffer.extend_from_slice(bytes);
        Ok(())
    }

    pub fn flush(&mut self) -> Result<()> {
        let place = self.file.append(self.files.worker(), &self.buffer, 0)?;
        if !self.buffer.is_empty() {
            self.begin.get_or_insert(place);
        }
        self.bytes += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }

    /// Fills `bytes` with what was written from `at` on; with fewer if that is the end.
    pub fn read_at(&self, at: u64, bytes: &mut Vec<u8>, most: usize) -> Result<()> {
        let left = self.bytes.saturating_sub(at);
        bytes.resize(left.min(most as u64) as usize, 0);
        match self.begin {
            Some(begin) if left > 0 => self.file.read(begin.segment, begin.offset + at, bytes),
            _ => Ok(()),
        }
    }

    /// Passes on what was written, in chunks of whole records of `record` bytes.
    pub fn read(
        &self,
        record: usize,
        workspace: &Workspace,
        mut take: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let mut bytes = Vec::new();
        let mut at = 0;
        while at < self.bytes {
            workspace.check_cancel()?;
            self.read_at(at, &mut bytes, CHUNK / record * record)?;
            take(&bytes)?;
            at += bytes.len() as u64;
        }
        Ok(())
    }

    /// Deletes the file.
    pub fn release(self) -> Result<()> {
        self.files.release(&self.name)
    }

    /// The file that has all of it.
    pub fn finish(mut self) -> Result<PathBuf> {
        self.flush()?;
        self.file.close();
        Ok(self.file.path(self.begin.map_or(0, |place| place.segment)))
    }
}
