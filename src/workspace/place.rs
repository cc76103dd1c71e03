//! Parts of files: where they are and what they must hold.

use std::sync::Arc;

/// Where a part of a file is, and what it must hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Place {
    /// First byte.
    pub offset: u64,
    /// Number of bytes.
    pub bytes: usize,
    /// Number of records in them.
    pub records: usize,
    /// CRC-32 of the bytes.
    pub crc: u32,
}

impl Place {
    /// Where it ends; none if no file can reach so far.
    #[must_use]
    pub fn end(&self) -> Option<u64> {
        let end = self.offset.checked_add(self.bytes as u64)?;
        i64::try_from(end).ok().map(i64::cast_unsigned)
    }
}

/// A part of a file that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Put {
    /// Name of the file.
    pub file: Arc<str>,
    /// Number of the part.
    pub section: u32,
    /// Where it is.
    pub place: Place,
}
