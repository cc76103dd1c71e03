//! Parts of files: their place, length and checksum.

use std::sync::Arc;

/// Place, length and checksum of a part of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Place {
    /// Offset of the first byte.
    pub offset: u64,
    /// Number of bytes.
    pub bytes: usize,
    /// Number of rows in them.
    pub records: usize,
    /// CRC-32 of the bytes.
    pub crc: u32,
}

impl Place {
    /// Offset of its end; none if it exceeds 64 bits.
    #[must_use]
    pub fn end(&self) -> Option<u64> {
        let end = self.offset.checked_add(self.bytes as u64)?;
        i64::try_from(end).ok().map(i64::cast_unsigned)
    }
}

/// A part of a file that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Put {
    /// Name of the file.
    pub file: Arc<str>,
    /// Number of the part.
    pub section: u32,
    /// Its place.
    pub place: Place,
}
