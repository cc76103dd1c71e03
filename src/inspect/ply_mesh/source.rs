//! A file read front to back in a buffer of fixed size.

use crate::error::{Error, Result};
use outcrop_ply::Header;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes of the buffer; not less than the longest header, so that one entry always fits.
const BUFFER: usize = Header::LONGEST;

#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    file: File,
    length: u64,
    buffer: Vec<u8>,
    at: usize,
    filled: usize,
    /// True if the rest of the file is in the buffer.
    drained: bool,
    /// File offset of the end of the buffer.
    end: u64,
}

impl Source {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
        let length = file
            .metadata()
            .map_err(|e| Error::io(path, "read the size of", e))?
            .len();
        Ok(Self {
            path: path.to_path_buf(),
            file,
            length,
            buffer: vec![0; BUFFER],
            at: 0,
            filled: 0,
            drained: false,
            end: 0,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes in the file.
    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// Offset in the file of the next byte.
    pub(super) fn position(&self) -> u64 {
        self.end - (self.filled - self.at) as u64
    }

    /// The buffered bytes: at least `wanted`, fewer only at the end of the file.
    pub(super) fn peek(&mut self, wanted: usize) -> Result<&[u8]> {
        if self.filled - self.at < wanted.min(BUFFER) && !self.drained {
            self.buffer.copy_within(self.at..self.filled, 0);
            self.filled -= self.at;
            self.at = 0;
            while self.filled < BUFFER {
                match self.file.read(&mut self.buffer[self.filled..]) {
                    Ok(0) => {
                        self.drained = true;
                        break;
                    }
                    Ok(n) => {
                        self.filled += n;
                        self.end += n as u64;
                    }
                    Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                    Err(e) => return Err(Error::io(&self.path, "read", e)),
                }
            }
        }
        Ok(&self.buffer[self.at..self.filled])
    }

    /// Consumes bytes returned by [`Source::peek`].
    pub(super) fn consume(&mut self, bytes: usize) {
        self.at = (self.at + bytes).min(self.filled);
    }

    /// Consumes and returns the next `wanted` bytes, at most those of the buffer.
    pub(super) fn take(&mut self, wanted: usize, what: &str) -> Result<&[u8]> {
        let at_hand = self.peek(wanted)?.len();
        if at_hand < wanted {
            return Err(self.truncated(at_hand as u64, &format!("{wanted} bytes of {what}")));
        }
        self.at += wanted;
        Ok(&self.buffer[self.at - wanted..self.at])
    }

    /// Skips `bytes`.
    pub(super) fn skip(&mut self, bytes: u64, what: &str) -> Result<()> {
        let at_hand = (self.filled - self.at) as u64;
        if bytes <= at_hand {
            self.at += bytes as usize;
            return Ok(());
        }
        let left = self.length.saturating_sub(self.position());
        if bytes > left {
            return Err(self.truncated(left, &format!("{bytes} bytes of {what}")));
        }
        let target = self.position() + bytes;
        let sought = self.file.seek(SeekFrom::Start(target));
        self.end = sought.map_err(|e| Error::io(&self.path, "seek in", e))?;
        (self.at, self.filled) = (0, 0);
        Ok(())
    }

    fn truncated(&self, left: u64, expected: &str) -> Error {
        let found = format!("the end of the file after {left} bytes");
        self.refuse(self.position(), &found, expected)
    }

    /// The error for invalid content at a byte offset.
    pub(super) fn refuse(&self, offset: u64, found: &str, expected: &str) -> Error {
        Error::input(&self.path, format!("byte {offset}"), found, expected)
    }

    /// The next word of an ascii body.
    pub(super) fn word(&mut self, expected: &str) -> Result<&[u8]> {
        // Longer than any number that programs write.
        const WORD: usize = 400;
        loop {
            let bytes = self.peek(1)?;
            if bytes.is_empty() {
                return Err(self.truncated(0, expected));
            }
            let blank = bytes.iter().take_while(|b| b.is_ascii_whitespace()).count();
            let done = blank < bytes.len();
            self.consume(blank);
            if done {
                break;
            }
        }
        let bytes = self.peek(WORD)?;
        let length = bytes
            .iter()
            .take(WORD)
            .take_while(|b| !b.is_ascii_whitespace())
            .count();
        if length == WORD {
            let found = format!("a word of {WORD} characters or more");
            return Err(self.refuse(self.position(), &found, expected));
        }
        self.at += length;
        Ok(&self.buffer[self.at - length..self.at])
    }
}
