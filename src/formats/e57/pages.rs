//! The pages of an E57 file: 1020 bytes of content, and a checksum.

use super::super::input::Input;
use outcrop_disk::error::Result;
use std::io::Read;

/// Bytes of a page, and of its content.
pub(super) const PAGE: u64 = 1024;
const CONTENT: u64 = 1020;

/// Pages that are read at a time.
const TOGETHER: u64 = 64;

/// Bytes of memory of [`Pages`].
pub(super) const MEMORY: u64 = TOGETHER * PAGE;

/// The content of a file without the checksums, which are checked.
pub(super) struct Pages<'a> {
    input: &'a Input,
    /// Offset in the content.
    at: u64,
    /// Number of the first page in memory.
    first: u64,
    pages: Vec<u8>,
}

/// The offset in the content of an offset in the file.
pub(super) fn content_offset(at: u64) -> u64 {
    at / PAGE * CONTENT + (at % PAGE).min(CONTENT)
}

impl<'a> Pages<'a> {
    /// The content from an offset in the file on.
    pub(super) fn new(input: &'a Input, at: u64) -> Self {
        Self {
            input,
            at: content_offset(at),
            first: 0,
            pages: Vec::new(),
        }
    }

    /// Offset in the file of the next byte.
    pub(super) fn position(&self) -> u64 {
        self.at / CONTENT * PAGE + self.at % CONTENT
    }

    /// Goes on at an offset in the content.
    pub(super) fn seek(&mut self, at: u64) {
        self.at = at;
    }

    /// Fills a buffer; an error names `what`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] if the file ends before, or a page is damaged; [`outcrop_disk::error::Error::Io`].
    pub(super) fn fill(&mut self, mut buffer: &mut [u8], what: &str) -> Result<()> {
        while !buffer.is_empty() {
            let here = self.some(buffer.len())?;
            if here.is_empty() {
                let place = format!("{what} at byte {}", self.position());
                let expected = format!("{} more bytes", buffer.len());
                return Err(self.input.error(place, "the end of the file", expected));
            }
            let (now, later) = buffer.split_at_mut(here.len());
            now.copy_from_slice(here);
            self.at += now.len() as u64;
            buffer = later;
        }
        Ok(())
    }

    /// The next bytes, at most `most`; none at the end of the file.
    fn some(&mut self, most: usize) -> Result<&[u8]> {
        let page = self.at / CONTENT;
        let held = self.pages.len() as u64 / PAGE;
        if !(self.first..self.first + held).contains(&page) {
            self.load(page)?;
        }
        let from = (page - self.first) * PAGE + self.at % CONTENT;
        let left = (CONTENT - self.at % CONTENT).min(most as u64);
        let range = from as usize..(from + left) as usize;
        Ok(self.pages.get(range).unwrap_or_default())
    }

    /// Reads and checks pages from this one on.
    fn load(&mut self, page: u64) -> Result<()> {
        self.first = page;
        self.pages.resize(MEMORY as usize, 0);
        let start = page.saturating_mul(PAGE);
        let got = self.input.read_at(start, &mut self.pages)?;
        self.pages.truncate(got / PAGE as usize * PAGE as usize);
        let pages = self.pages.chunks_exact(PAGE as usize);
        for (number, page) in pages.enumerate() {
            let (content, stored) = page.split_at(CONTENT as usize);
            let found = crc32c::crc32c(content).to_be_bytes();
            if stored != found {
                let hex = |bytes: &[u8]| format!("checksum {:02x?}", bytes);
                return Err(self.input.error(
                    format!("page at byte {}", start + number as u64 * PAGE),
                    hex(&found),
                    hex(stored),
                ));
            }
        }
        Ok(())
    }
}

/// Passes the content of a part of a file on, and keeps the error. Between two calls of [`Part::allow`] only
/// some bytes may be read.
pub(super) struct Part<'a> {
    pages: Pages<'a>,
    left: u64,
    allowed: u64,
    /// The error that ended the reading.
    pub(super) failed: Option<outcrop_disk::error::Error>,
}

impl<'a> Part<'a> {
    pub(super) fn new(pages: Pages<'a>, bytes: u64) -> Self {
        Self {
            pages,
            left: bytes,
            allowed: 0,
            failed: None,
        }
    }

    /// Allows to read this many bytes.
    pub(super) fn allow(&mut self, bytes: u64) {
        self.allowed = bytes;
    }

    fn next(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let most = self.left.min(buffer.len() as u64);
        if most == 0 {
            return Ok(0);
        }
        if most > self.allowed {
            let place = format!("description at byte {}", self.pages.position());
            let expected = "shorter words and texts";
            return Err(self
                .pages
                .input
                .error(place, "one of more than 1 MiB", expected));
        }
        let part = &mut buffer[..most as usize];
        self.pages.fill(part, "description")?;
        self.left -= most;
        self.allowed -= most;
        Ok(most as usize)
    }
}

impl Read for Part<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.next(buffer).map_err(|error| {
            self.failed = Some(error);
            std::io::ErrorKind::Other.into()
        })
    }
}
