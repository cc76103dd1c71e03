//! A file read front to back in a buffer of fixed size.

use crate::error::{Error, FileError};
use crate::header::Header;
use crate::types::Encoding;
use std::fmt::Display;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes of the buffer; not less than the longest header, so that one entry always fits.
const BUFFER: usize = Header::LONGEST;

#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    file: File,
    /// Encoding of the elements, once the header is read.
    encoding: Encoding,
    /// Bytes in the file.
    length: u64,
    buffer: Vec<u8>,
    /// Bytes of the buffer that are consumed.
    at: usize,
    /// File offset of the end of the buffer.
    end: u64,
}

impl Source {
    pub(super) fn open(path: &Path) -> Result<Self, FileError> {
        let file = File::open(path).map_err(|e| FileError::io(path, "open", e))?;
        let data = file.metadata();
        let data = data.map_err(|e| FileError::io(path, "read the size of", e))?;
        Ok(Self {
            path: path.to_path_buf(),
            file,
            encoding: Encoding::Ascii,
            length: data.len(),
            buffer: Vec::with_capacity(BUFFER),
            at: 0,
            end: 0,
        })
    }

    /// Errors name the file `path`.
    pub(super) fn shown_as(self, path: &Path) -> Self {
        let path = path.to_path_buf();
        Self { path, ..self }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the header, at the begin of the file.
    pub(super) fn header(&mut self) -> Result<Header, FileError> {
        let header = Header::read(&mut self.peek(Header::LONGEST)?);
        let header = header.map_err(|e| self.wrong(e))?;
        self.consume(header.bytes as usize);
        self.encoding = header.encoding;
        Ok(header)
    }

    /// The byte order, true for the most significant byte first; none for text.
    pub(super) fn big(&self) -> Option<bool> {
        match self.encoding {
            Encoding::Ascii => None,
            encoding => Some(encoding == Encoding::Big),
        }
    }

    /// The error for wrong content.
    pub(super) fn wrong(&self, source: Error) -> FileError {
        let path = self.path.clone();
        FileError::Content { path, source }
    }

    /// The error for wrong content some bytes before the next one.
    pub(super) fn refuse(&self, back: usize, found: String, expected: impl Display) -> FileError {
        let place = format!("byte {}", self.position() - back as u64);
        self.wrong(Error::input(place, found, expected.to_string()))
    }

    pub(super) fn truncated(&self, left: u64, expected: impl Display) -> FileError {
        self.refuse(
            0,
            format!("the end of the file after {left} bytes"),
            expected,
        )
    }

    /// Offset in the file of the next byte.
    fn position(&self) -> u64 {
        self.end - (self.buffer.len() - self.at) as u64
    }

    /// Bytes in the file.
    pub(super) fn bytes(&self) -> u64 {
        self.length
    }

    /// The name of the file in errors, and the file once more.
    pub(super) fn again(&self) -> Result<(PathBuf, File), FileError> {
        let file = self.file.try_clone();
        let file = file.map_err(|e| FileError::io(&self.path, "open", e))?;
        Ok((self.path.clone(), file))
    }

    /// Bytes in the file from the next one on.
    pub(super) fn left(&self) -> u64 {
        self.length.saturating_sub(self.position())
    }

    /// The buffered bytes: at least `wanted`, fewer only at the end of the file.
    pub(super) fn peek(&mut self, wanted: usize) -> Result<&[u8], FileError> {
        if self.buffer.len() - self.at < wanted {
            self.buffer.drain(..self.at);
            self.at = 0;
            let room = BUFFER.saturating_sub(self.buffer.len()) as u64;
            let read = (&self.file).take(room).read_to_end(&mut self.buffer);
            self.end += read.map_err(|e| FileError::io(&self.path, "read", e))? as u64;
        }
        Ok(&self.buffer[self.at..])
    }

    /// Consumes and returns bytes that [`Source::peek`] has returned.
    pub(super) fn consume(&mut self, bytes: usize) -> &[u8] {
        self.at += bytes;
        &self.buffer[self.at - bytes..self.at]
    }

    /// Consumes and returns the next `wanted` bytes, at most those of the buffer.
    pub(super) fn take(&mut self, wanted: usize, what: &str) -> Result<&[u8], FileError> {
        let at_hand = self.peek(wanted)?.len();
        if at_hand < wanted {
            return Err(self.truncated(at_hand as u64, format_args!("{wanted} bytes of {what}")));
        }
        Ok(self.consume(wanted))
    }

    /// Skips `bytes`.
    pub(super) fn skip(&mut self, bytes: u64, what: impl Display) -> Result<(), FileError> {
        if bytes <= (self.buffer.len() - self.at) as u64 {
            self.at += bytes as usize;
            return Ok(());
        }
        if bytes > self.left() {
            return Err(self.truncated(self.left(), format_args!("{bytes} bytes of {what}")));
        }
        let target = SeekFrom::Start(self.position() + bytes);
        let end = self.file.seek(target);
        self.end = end.map_err(|e| FileError::io(&self.path, "seek in", e))?;
        self.buffer.clear();
        self.at = 0;
        Ok(())
    }
}
