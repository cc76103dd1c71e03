//! Files of the scratch folder: private, never opened through a symbolic link; all bytes are counted.

use super::IoCounters;
use super::fault;
use super::open::{failed_write, options};
use super::place::{Place, Put};
use super::run::ResumableRun;
use crate::error::{Error, Result};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// State shared by the files of a workspace.
#[derive(Debug, Default)]
pub struct Shared {
    /// Bytes moved.
    pub io: Arc<IoCounters>,
    /// The run, if it can be resumed.
    pub run: Option<Arc<ResumableRun>>,
    /// Expected peak of scratch bytes.
    pub expected: AtomicU64,
}

impl Shared {
    /// Scratch bytes still to be written, as far as that is known.
    pub fn more(&self) -> u64 {
        let expected = self.expected.load(Ordering::Relaxed);
        expected.saturating_sub(self.io.scratch())
    }
}

#[derive(Debug)]
enum Handle {
    Open(Arc<File>),
    /// Closed after writing: a large number of files then needs no handles.
    Closed,
    /// Deleted already; it will not be read.
    Gone,
}

/// Creates scratch files.
#[derive(Debug, Clone)]
pub struct Maker {
    pub(super) folder: PathBuf,
    pub(super) shared: Arc<Shared>,
}

impl Maker {
    /// Creates the scratch file `name`; `kept` if a resumed run needs it.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn make(&self, name: &str, kept: bool) -> Result<ScratchFile> {
        let path = self.folder.join(name);
        if self.shared.run.is_some() {
            // A file of an earlier attempt that was killed before it noted the file.
            let _ = std::fs::remove_file(&path);
        }
        let file = options().create_new(true).open(&path);
        let file = file.map_err(|e| Error::io(&path, "create", e))?;
        let file = ScratchFile::new(name, path, Some(file), kept, self.shared.clone());
        if let (Some(run), true) = (&self.shared.run, kept) {
            run.keeper.made(&file.name);
        }
        Ok(file)
    }
}

/// A scratch file. It is deleted when it is dropped: at once, or, in a run that can be resumed, when the next
/// step has begun.
#[derive(Debug)]
pub struct ScratchFile {
    /// Name in the folder.
    pub name: Arc<str>,
    /// Path of the file.
    pub path: PathBuf,
    handle: Handle,
    /// Set by writing, reset by syncing.
    dirty: Arc<AtomicBool>,
    /// End of the bytes allocated so far.
    end: AtomicU64,
    /// True if a resumed run needs the file.
    kept: bool,
    shared: Arc<Shared>,
}

impl ScratchFile {
    pub(super) fn new(
        name: &str,
        path: PathBuf,
        file: Option<File>,
        kept: bool,
        shared: Arc<Shared>,
    ) -> Self {
        let handle = file.map_or(Handle::Gone, |file| Handle::Open(Arc::new(file)));
        let name: Arc<str> = name.into();
        if let (Some(run), true, Handle::Open(_)) = (&shared.run, kept, &handle) {
            run.hold(&name);
        }
        Self {
            name,
            path,
            handle,
            dirty: Arc::default(),
            end: AtomicU64::new(0),
            kept,
            shared,
        }
    }

    /// Notes the part `section` in the journal, if a resumed run may need it.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn put(&self, section: u32, place: Place) -> Result<()> {
        match &self.shared.run {
            Some(run) if self.kept => run.put(Put {
                file: self.name.clone(),
                section,
                place,
            }),
            _ => Ok(()),
        }
    }

    /// True if a resumed run needs the file.
    #[must_use]
    pub fn is_kept(&self) -> bool {
        self.kept
    }

    /// True if the file is deleted already.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        matches!(self.handle, Handle::Gone)
    }

    /// Closes the handle; later reads open the file by its path.
    pub fn close(&mut self) {
        if !self.is_gone() {
            self.handle = Handle::Closed;
        }
    }

    /// End of the bytes allocated so far.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.end.load(Ordering::Relaxed)
    }

    /// Reserves the bytes up to `end`, which an earlier attempt wrote.
    pub(crate) fn reach(&self, end: u64) {
        let before = self.end.fetch_max(end, Ordering::Relaxed);
        if !self.is_gone() {
            self.shared.io.grow_scratch(end.saturating_sub(before));
        }
    }

    /// Writes at the end; returns the offset.
    ///
    /// # Errors
    /// See [`ScratchFile::write_at`].
    pub fn append(&self, bytes: &[u8]) -> Result<u64> {
        let offset = self.end.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.shared.io.grow_scratch(bytes.len() as u64);
        self.write_counted(bytes, offset)?;
        Ok(offset)
    }

    /// Writes at `offset`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Disk`] if the disk is full.
    pub fn write_at(&self, bytes: &[u8], offset: u64) -> Result<()> {
        self.reach(offset + bytes.len() as u64);
        self.write_counted(bytes, offset)
    }

    fn write_counted(&self, bytes: &[u8], offset: u64) -> Result<()> {
        // A step whose result is in the journal writes no file.
        let Handle::Open(file) = &self.handle else {
            return Ok(());
        };
        if bytes.is_empty() {
            return Ok(());
        }
        fault::write()
            .and_then(|()| file.write_all_at(bytes, offset))
            .map_err(|e| failed_write(&self.path, bytes.len(), self.shared.more(), e))?;
        self.shared.io.add_written(bytes.len() as u64);
        if let Some(run) = &self.shared.run
            && self.kept
            && !self.dirty.swap(true, Ordering::Relaxed)
        {
            run.keeper.sync_later(&self.name, file, &self.dirty);
        }
        Ok(())
    }

    /// Fills `bytes` from `offset`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Corrupt`] if the file is too short.
    pub fn read_at(&self, bytes: &mut [u8], offset: u64) -> Result<()> {
        let wanted = bytes.len();
        let read = match &self.handle {
            Handle::Open(file) => file.read_exact_at(bytes, offset),
            Handle::Closed | Handle::Gone => Err(std::io::ErrorKind::UnexpectedEof.into()),
        };
        read.map_err(|e| {
            if e.kind() == std::io::ErrorKind::UnexpectedEof {
                let found = "the end of the file".to_owned();
                return self.damaged(offset, found, format!("{wanted} bytes"));
            }
            Error::io(&self.path, format!("read {wanted} bytes"), e)
        })?;
        self.shared.io.add_read(wanted as u64);
        Ok(())
    }

    /// Counts bytes that were read without [`ScratchFile::read_at`].
    pub fn count_read(&self, bytes: u64) {
        self.shared.io.add_read(bytes);
    }

    /// The error for content that differs from what was written.
    #[must_use]
    pub fn damaged(&self, offset: u64, found: String, expected: String) -> Error {
        Error::Corrupt {
            path: self.path.clone(),
            offset,
            found,
            expected,
        }
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        match (&self.shared.run, self.kept) {
            (Some(run), true) => {
                if !self.is_gone() && !run.drop_later(&self.name, self.end()) {
                    self.shared.io.shrink_scratch(self.end());
                }
            }
            _ => {
                self.shared.io.shrink_scratch(self.end());
                // A scratch file that cannot be deleted is deleted with its folder.
                let _ = std::fs::remove_file(&self.path);
            }
        }
    }
}
