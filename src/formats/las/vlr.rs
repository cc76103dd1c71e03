//! Variable-length records.

use super::super::input::Input;
use las::raw;
use outcrop_disk::error::Result;
use std::ops::Range;

/// Limit for the size of a record; larger ones are passed over.
const LARGEST: u64 = 64 << 10;

/// Consecutive variable-length records of a file, each with the offset of its data.
pub(super) struct Records<'a> {
    input: &'a Input,
    /// Offset of the next record.
    at: u64,
    end: u64,
    extended: bool,
}

impl<'a> Records<'a> {
    /// The records in these bytes of a file: between the header and the points.
    pub(super) fn plain(input: &'a Input, bytes: Range<u64>) -> Self {
        Self {
            input,
            at: bytes.start,
            end: bytes.end,
            extended: false,
        }
    }

    /// The extended records from `at` on.
    pub(super) fn extended(input: &'a Input, at: u64) -> Self {
        Self {
            input,
            at,
            end: input.bytes,
            extended: true,
        }
    }

    fn read(&mut self) -> Result<Option<(u64, las::Vlr)>> {
        let what = "variable-length record";
        let (head, field) = if self.extended { (60, 8) } else { (54, 2) };
        while let Some(data) = self.at.checked_add(head).filter(|data| *data <= self.end) {
            let mut length = [0u8; 8];
            let length_at = self.at + 20;
            self.input
                .read_exact_at(length_at, &mut length[..field], what)?;
            let length = u64::from_le_bytes(length);
            let at = std::mem::replace(&mut self.at, data.saturating_add(length));
            if length <= LARGEST {
                let mut record = vec![0u8; (head + length) as usize];
                self.input.read_exact_at(at, &mut record, what)?;
                let record = raw::Vlr::read_from(&record[..], self.extended).map_err(|e| {
                    self.input
                        .error(format!("{what} at byte {at}"), e.to_string(), "a record")
                })?;
                return Ok(Some((data, las::Vlr::new(record))));
            }
        }
        Ok(None)
    }
}

impl Iterator for Records<'_> {
    type Item = Result<(u64, las::Vlr)>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}
