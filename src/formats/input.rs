//! An input file: positioned reads that are counted, with errors that give the position. Of a compressed file
//! the content is read, and positions are those in it.

pub(super) mod beside;
mod remote;

use super::remote::{Remote, is_remote};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::compressed::{Beginning, Content};
use outcrop_disk::workspace::mapped::Window;
use outcrop_disk::workspace::zip::Wanted;
use outcrop_disk::workspace::{IoCounters, Workspace};
use outcrop_platform::FileAt;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An open input file.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) path: PathBuf,
    /// Size in bytes of what is read.
    pub(super) bytes: u64,
    /// Size in bytes of the file when it was opened.
    pub(super) size: u64,
    source: Source,
    io: Arc<IoCounters>,
    /// True if parts of the file are mapped.
    maps: bool,
}

/// The bytes of an input.
#[derive(Debug)]
enum Source {
    File(File),
    /// Of a compressed file: its content.
    Content(
        File,
        #[expect(dead_code, reason = "dropping it deletes the file")] Content,
    ),
    /// Of a compressed file of which only the header is wanted.
    Memory(Vec<u8>),
    /// On a server.
    Remote(Remote),
}

impl Source {
    fn read_at(&self, buffer: &mut [u8], offset: u64) -> std::io::Result<usize> {
        match self {
            Self::File(file) | Self::Content(file, _) => file.read_at(buffer, offset),
            Self::Remote(remote) => remote.read_at(buffer, offset),
            Self::Memory(bytes) => {
                let start = bytes
                    .len()
                    .min(usize::try_from(offset).unwrap_or(usize::MAX));
                (&bytes[start..]).read(buffer)
            }
        }
    }
}

impl Input {
    /// Opens a file to read all of it; of an archive the member that is `wanted`.
    pub(super) fn open(path: &Path, wanted: Wanted<'_>, workspace: &Workspace) -> Result<Self> {
        if is_remote(path) {
            return Self::open_remote(path, wanted, workspace);
        }
        let maps = workspace.maps_inputs();
        let input = Self {
            maps,
            ..Self::of(path, workspace.io.clone())?
        };
        let Some(content) = Content::of(path, wanted, workspace)? else {
            return Ok(input);
        };
        let file = File::open(&content.path).map_err(|e| Error::io(&content.path, "open", e))?;
        Ok(Self {
            bytes: content.bytes,
            source: Source::Content(file, content),
            ..input
        })
    }

    /// Opens a file of which only the first `most` bytes are read. The size of a compressed one is an
    /// estimate.
    pub(super) fn open_head(path: &Path, wanted: Wanted<'_>, most: usize) -> Result<Self> {
        if is_remote(path) {
            return Self::open_remote_head(path, most);
        }
        let input = Self::of(path, Arc::default())?;
        let Some(beginning) = Beginning::of(path, wanted, most)? else {
            return Ok(input);
        };
        Ok(Self {
            bytes: beginning.likely,
            source: Source::Memory(beginning.bytes),
            ..input
        })
    }

    /// True if the file is compressed.
    pub(super) fn is_compressed(&self) -> bool {
        !matches!(self.source, Source::File(_))
    }

    /// True if any part of it can be read: more than the beginning of a compressed file, and of one on a server that
    /// sends parts.
    pub(super) fn is_at_hand(&self) -> bool {
        match &self.source {
            Source::File(_) | Source::Content(..) => true,
            Source::Memory(bytes) => bytes.len() as u64 == self.bytes,
            Source::Remote(remote) => remote.has_parts(),
        }
    }

    fn of(path: &Path, io: Arc<IoCounters>) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
        let meta = file
            .metadata()
            .map_err(|e| Error::io(path, "read the size of", e))?;
        if !meta.is_file() {
            return Err(Error::input(
                path,
                "file type",
                "something that is not a regular file",
                "a file that can be read at any position",
            ));
        }
        Ok(Self {
            path: path.to_path_buf(),
            bytes: meta.len(),
            size: meta.len(),
            source: Source::File(file),
            io,
            maps: false,
        })
    }

    /// An [`Error::Input`] of this file.
    pub(super) fn error(
        &self,
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Error {
        Error::input(&self.path, place, found, expected)
    }

    /// Fills `buffer` from `offset` as far as the file reaches; returns the bytes read.
    pub(super) fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<usize> {
        let mut done = 0;
        while done < buffer.len() {
            match self
                .source
                .read_at(&mut buffer[done..], offset + done as u64)
            {
                Ok(0) => break,
                Ok(n) => done += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => {
                    let action = format!("read {} bytes at byte {offset}", buffer.len());
                    return Err(Error::io(&self.path, action, e));
                }
            }
        }
        self.io.add_read(done as u64);
        Ok(done)
    }

    /// Fills `buffer` from `offset`; if the file ends before that, an error names `what`.
    pub(super) fn read_exact_at(&self, offset: u64, buffer: &mut [u8], what: &str) -> Result<()> {
        let got = self.read_at(offset, buffer)?;
        if got == buffer.len() {
            return Ok(());
        }
        Err(self.error(
            format!("{what} at byte {offset}"),
            format!("the end of the file after {} bytes", offset + got as u64),
            format!("{} more bytes", buffer.len() - got),
        ))
    }

    /// The part of `bytes` bytes from `offset`, mapped if the run maps inputs; if the file ends before that, an error names `what`.
    pub(super) fn window(&self, offset: u64, bytes: usize, what: &str) -> Result<Window> {
        if let (true, Source::File(file) | Source::Content(file, _)) = (self.maps, &self.source)
            && let Some(window) = Window::of(file, offset, bytes)
        {
            self.io.add_read(bytes as u64);
            return Ok(window);
        }
        let mut copy = vec![0; bytes];
        self.read_exact_at(offset, &mut copy, what)?;
        Ok(Window::Copied(copy))
    }

    /// The first bytes of the file, at most `most`.
    pub(super) fn head(&self, most: usize) -> Result<Vec<u8>> {
        let mut head = vec![0; most.min(usize::try_from(self.bytes).unwrap_or(most))];
        let got = self.read_at(0, &mut head)?;
        head.truncate(got);
        Ok(head)
    }

    /// A reader of the bytes `start..end`.
    pub(super) fn range(&self, start: u64, end: u64) -> Range<'_> {
        Range {
            input: self,
            at: start,
            end: end.min(self.bytes),
        }
    }

    /// A buffered reader of the bytes `start..end`.
    pub(super) fn stream(&self, start: u64, end: u64) -> std::io::BufReader<Range<'_>> {
        std::io::BufReader::with_capacity(STREAM_BUFFER, self.range(start, end))
    }
}

/// Bytes buffered by [`Input::stream`].
pub(super) const STREAM_BUFFER: usize = 256 << 10;

/// Sequential reader of a range of an input file.
#[derive(Debug)]
pub(super) struct Range<'a> {
    input: &'a Input,
    /// Offset of the next byte.
    pub(super) at: u64,
    end: u64,
}

impl Seek for Range<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let place = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.end.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = place.ok_or(std::io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

impl Read for Range<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let left = usize::try_from(self.end.saturating_sub(self.at)).unwrap_or(usize::MAX);
        let wanted = buffer.len().min(left);
        let got = self.input.source.read_at(&mut buffer[..wanted], self.at)?;
        self.at += got as u64;
        self.input.io.add_read(got as u64);
        Ok(got)
    }
}

/// Little-endian `u16` at `at`; the caller has checked the length.
pub(super) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// Little-endian `u32` at `at`; the caller has checked the length.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

/// Little-endian `u64` at `at`; the caller has checked the length.
pub(super) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}
