//! LZF, the compression of PCD files, as a stream: a copy reaches back 8 KiB at most.

use super::super::input::{Input, Range};
use outcrop_disk::error::{Error, Result};
use std::io::{BufReader, Read};

/// Most bytes of content for each compressed byte: the longest copy has 264 bytes and takes three.
pub(super) const MOST_PER_BYTE: u64 = 88;

/// Bytes that a copy can reach back.
const WINDOW: usize = 8 << 10;

/// Bytes of content that are unpacked at a time, besides one longest copy.
const CHUNK: usize = 64 << 10;

/// Bytes of the file that are read at a time.
const READ: usize = 32 << 10;

/// Bytes of memory of a [`Stream`].
pub(super) const MEMORY: u64 = (WINDOW + CHUNK + 1024 + READ) as u64;

/// The content of compressed data, read from its start.
pub(super) struct Stream<'a> {
    input: &'a Input,
    packed: BufReader<Range<'a>>,
    /// Offset of the end of the compressed data.
    end: u64,
    /// The content around the next byte.
    content: Vec<u8>,
    /// Place of the next byte in `content`.
    next: usize,
}

impl<'a> Stream<'a> {
    /// The content of the bytes `start..end` of a file.
    pub(super) fn new(input: &'a Input, start: u64, end: u64) -> Self {
        Self {
            input,
            packed: BufReader::with_capacity(READ, input.range(start, end)),
            end,
            content: Vec::with_capacity(WINDOW + CHUNK + 1024),
            next: 0,
        }
    }

    /// A second stream that goes on from here.
    pub(super) fn fork(&self) -> Self {
        let mut fork = Self::new(self.input, self.position(), self.end);
        fork.content.extend_from_slice(&self.content);
        fork.next = self.next;
        fork
    }

    /// Offset in the file of the next compressed byte.
    fn position(&self) -> u64 {
        self.packed.get_ref().at - self.packed.buffer().len() as u64
    }

    /// Passes over `count` bytes; `between` is called from time to time.
    ///
    /// # Errors
    /// As for [`Stream::read`]; errors of `between`.
    pub(super) fn skip(&mut self, mut count: u64, between: impl Fn() -> Result<()>) -> Result<()> {
        while count > 0 {
            between()?;
            let here = self
                .more()?
                .min(usize::try_from(count).unwrap_or(usize::MAX));
            self.next += here;
            count -= here as u64;
        }
        Ok(())
    }

    /// Fills a buffer.
    ///
    /// # Errors
    /// [`Error::Input`] if the content ends before, or its data are damaged; [`Error::Io`].
    pub(super) fn read(&mut self, mut buffer: &mut [u8]) -> Result<()> {
        while !buffer.is_empty() {
            let here = self.more()?.min(buffer.len());
            let (now, later) = buffer.split_at_mut(here);
            now.copy_from_slice(&self.content[self.next..self.next + here]);
            self.next += here;
            buffer = later;
        }
        Ok(())
    }

    /// The number of bytes that are unpacked, at least one.
    fn more(&mut self) -> Result<usize> {
        if self.next == self.content.len() {
            let old = self.content.len().saturating_sub(WINDOW);
            self.content.drain(..old);
            self.next -= old;
            let until = self.next + CHUNK;
            while self.content.len() < until && self.position() < self.end {
                self.unpack()?;
            }
            if self.next == self.content.len() {
                return Err(self.damaged("the end of the compressed data", "more of it"));
            }
        }
        Ok(self.content.len() - self.next)
    }

    /// Unpacks one sequence: bytes as they are, or a copy of earlier ones.
    fn unpack(&mut self) -> Result<()> {
        let control = usize::from(self.byte()?);
        let at = self.content.len();
        if control < 32 {
            self.content.resize(at + control + 1, 0);
            let read = self.packed.read_exact(&mut self.content[at..]);
            return read.map_err(|e| self.failed(e));
        }
        let mut count = control >> 5;
        if count == 7 {
            count += usize::from(self.byte()?);
        }
        let back = ((control & 31) << 8 | usize::from(self.byte()?)) + 1;
        let Some(from) = at.checked_sub(back) else {
            let found = format!("a copy from {back} bytes back");
            return Err(self.damaged(&found, &format!("at most {at}, the bytes before it")));
        };
        // Source and target may overlap, so bytes are copied one by one.
        for source in from..from + count + 2 {
            self.content.push(self.content[source]);
        }
        Ok(())
    }

    fn byte(&mut self) -> Result<u8> {
        let mut byte = [0];
        let read = self.packed.read_exact(&mut byte);
        read.map_err(|e| self.failed(e))?;
        Ok(byte[0])
    }

    fn failed(&self, error: std::io::Error) -> Error {
        match error.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                self.damaged("the end of the compressed data", "more of it")
            }
            _ => Error::io(&self.input.path, "read", error),
        }
    }

    fn damaged(&self, found: &str, expected: &str) -> Error {
        let place = format!("LZF data before byte {}", self.position());
        self.input.error(place, found, expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Unpacks `length` bytes in parts of `part`.
    fn unpack(packed: &[u8], length: usize, part: usize) -> Result<Vec<u8>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), packed).unwrap();
        let input = Input::open_head(file.path(), &|_, _, _| false, 0).unwrap();
        let mut stream = Stream::new(&input, 0, packed.len() as u64);
        let mut out = vec![0; length];
        for (number, part) in out.chunks_mut(part).enumerate() {
            if number % 3 == 2 {
                stream = stream.fork();
            }
            let mut copy = stream.fork();
            copy.read(part)?;
            stream.skip(part.len() as u64, || Ok(()))?;
        }
        Ok(out)
    }

    #[test]
    fn literals_and_copies() {
        let read = |packed, length| unpack(packed, length, 4).ok();
        assert_eq!(read(&[2, b'a', b'b', b'c'], 3), Some(b"abc".to_vec()));
        // "ab", then 5 bytes from 2 back, then 9 + 3 from 1 back.
        let packed = [1, b'a', b'b', 3 << 5, 1, 7 << 5, 3, 0];
        assert_eq!(read(&packed, 19), Some(b"abababaaaaaaaaaaaaa".to_vec()));
        assert_eq!(read(&packed, 20), None);
        assert_eq!(read(&packed[..6], 19), None);
        // A reference to before the start.
        assert_eq!(read(&[0, b'a', 1 << 5, 1], 4), None);
    }

    /// A compressed form of any bytes that uses literals and copies of all distances.
    fn pack(bytes: &[u8]) -> Vec<u8> {
        let mut packed = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let same = |back: usize| {
                let limit = (bytes.len() - at).min(264);
                let equal = (0..limit).take_while(|i| bytes[at + i] == bytes[at + i - back]);
                (equal.count(), back)
            };
            let (count, back) = [1, 2, 777, 8192]
                .into_iter()
                .filter(|back| *back <= at)
                .map(same)
                .max()
                .unwrap_or((0, 1));
            if count >= 3 {
                let (more, low) = (count - 2, back - 1);
                packed.push((more.min(7) as u8) << 5 | (low >> 8) as u8);
                packed.extend((more >= 7).then(|| (more - 7) as u8));
                packed.push(low as u8);
                at += count;
            } else {
                packed.extend([0, bytes[at]]);
                at += 1;
            }
        }
        packed
    }

    #[test]
    fn content_of_many_windows() {
        let bytes: Vec<u8> = (0..300_000u32)
            .map(|i| match i % 8192 {
                0..6000 => (i % 8192 / 7) as u8,
                _ => (i.wrapping_mul(2_654_435_761) >> 24) as u8,
            })
            .collect();
        let packed = pack(&bytes);
        for part in [70_000, 8191, 123_456] {
            let found = unpack(&packed, bytes.len(), part).unwrap();
            assert!(found == bytes, "parts of {part}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(packed in prop::collection::vec(any::<u8>(), 0..300), length in 0usize..5000) {
            if let Ok(out) = unpack(&packed, length, 1000) {
                prop_assert_eq!(out.len(), length);
            }
        }
    }
}
