//! The lines that start in a slab of a file.

use super::input::Input;
use outcrop_disk::error::Result;

/// Bytes of a slab.
pub(super) const SLAB: u64 = 2 << 20;
/// Longest accepted line, in bytes.
pub(super) const LONGEST_LINE: u64 = 1 << 20;
/// Bytes read at a time to find the end of a slab's last line.
const STEP: usize = 4 << 10;

/// True for the bytes that end a line.
pub(super) fn is_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The bytes of the lines that start in one slab.
pub(super) struct Lines {
    bytes: Vec<u8>,
    /// Offset of `bytes` in the file.
    at: u64,
}

impl Lines {
    /// Reads the lines that start in the slab at `start`; `first` is the offset of the file's first line.
    pub(super) fn read(input: &Input, first: u64, start: u64) -> Result<Self> {
        // The preceding byte shows if a line starts exactly here.
        let before = u64::from(start > first);
        let mut bytes = vec![0u8; (SLAB + before) as usize];
        let got = input.read_at(start - before, &mut bytes)?;
        bytes.truncate(got);
        let full = got as u64 == SLAB + before;
        let skip = match bytes.iter().position(|b| is_end(*b)) {
            _ if before == 0 => 0,
            Some(end) => end + 1,
            None if full => return Err(too_long(input, start, LONGEST_LINE)),
            None => got,
        };
        // A line that starts exactly at the end of the slab belongs to the next one.
        if full && bytes.len() > skip && !bytes.last().is_some_and(|b| is_end(*b)) {
            Self::complete(input, start - before, &mut bytes)?;
        }
        bytes.drain(..skip);
        Ok(Self {
            bytes,
            at: start - before + skip as u64,
        })
    }

    /// Appends the rest of the last line.
    fn complete(input: &Input, at: u64, bytes: &mut Vec<u8>) -> Result<()> {
        let begun = bytes.len();
        loop {
            let from = bytes.len();
            bytes.resize(from + STEP, 0);
            let got = input.read_at(at + from as u64, &mut bytes[from..])?;
            bytes.truncate(from + got);
            if let Some(end) = bytes[from..].iter().position(|b| is_end(*b)) {
                bytes.truncate(from + end);
                return Ok(());
            }
            if got < STEP {
                return Ok(());
            }
            if (bytes.len() - begun) as u64 > LONGEST_LINE {
                return Err(too_long(input, at + begun as u64, LONGEST_LINE));
            }
        }
    }

    /// The lines, each with its offset in the file.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u64, &[u8])> {
        let mut at = self.at;
        self.bytes.split(|b| is_end(*b)).map(move |line| {
            let start = at;
            at += line.len() as u64 + 1;
            (start, line)
        })
    }
}

/// The error of a line that does not end.
pub(super) fn too_long(input: &Input, at: u64, most: u64) -> outcrop_disk::error::Error {
    input.error(
        format!("line around byte {at}"),
        "no line end",
        format!("lines of at most {most} bytes"),
    )
}

/// Number, from 1, of the line that starts at `at`.
pub(super) fn number_of(input: &Input, at: u64) -> Result<u64> {
    let mut number = 1;
    let mut buffer = vec![0u8; 64 << 10];
    let mut done = 0;
    let mut last = 0;
    while done < at {
        let wanted = buffer.len().min((at - done) as usize);
        let got = input.read_at(done, &mut buffer[..wanted])?;
        if got == 0 {
            break;
        }
        for &byte in &buffer[..got] {
            // CR LF is one line end.
            if byte == b'\r' || (byte == b'\n' && last != b'\r') {
                number += 1;
            }
            last = byte;
        }
        done += got as u64;
    }
    Ok(number)
}
