//! The head of a layered chunk of LAZ.

use super::super::input::{Input, u32_at};
use super::Header;
use super::laszip::{Laszip, layers};
use outcrop_disk::error::Result;

/// The head of a layered chunk: first record, number of points, sizes of the layers.
pub(super) struct LayerHead {
    /// Number of points in the chunk.
    pub(super) points: u64,
    /// Size of the whole chunk.
    pub(super) bytes: u64,
}

impl LayerHead {
    /// Reads the head of the chunk at `at`, and checks that the whole chunk is inside the file.
    pub(super) fn read(input: &Input, header: &Header, laszip: &Laszip, at: u64) -> Result<Self> {
        let record = usize::from(header.record_bytes);
        let count: usize = laszip.items.iter().map(layers).sum();
        let mut head = vec![0u8; record + 4 + 4 * count];
        input.read_exact_at(at, &mut head, "head of a LAZ chunk")?;
        let size = |layer: usize| u64::from(u32_at(&head, record + 4 + 4 * layer));
        let layers: u64 = (0..count).map(size).sum();
        let bytes = head.len() as u64 + layers;
        if bytes > input.bytes - at {
            return Err(input.error(
                format!("LAZ chunk at byte {at}"),
                format!("layers of {layers} bytes"),
                format!("at most {}, up to the end of the file", input.bytes - at),
            ));
        }
        Ok(Self {
            points: u64::from(u32_at(&head, record)),
            bytes,
        })
    }
}
