//! Parts of files: their place, length and checksum.

use serde::{Deserialize, Serialize};

/// Place, length and checksum of a part of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Number of the segment of the file.
    pub segment: u32,
    /// Offset of the first byte in the segment.
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

/// A part of a file that a unit of work wrote.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Put {
    /// Name of the file.
    pub file: String,
    /// Number of the part.
    pub section: u32,
    /// Its place.
    pub place: Place,
}
