//! LAS 1.0 to 1.4 and LAZ.

mod chunks;
mod gps;
mod header;
mod laz;
mod plain;
mod table;
mod vlr;

pub(super) use header::Header;

/// Byte of a record that holds the withheld flag, in all point formats.
const FLAGS: usize = 15;

use super::input::Input;
use super::source::Native;
use super::spool::SourceWriter;
use crate::error::Result;

/// Reads a LAS or LAZ file into the spool; returns what the user should know.
pub(super) fn read(
    input: &Input,
    header: &Header,
    writer: &SourceWriter<'_>,
) -> Result<Vec<String>> {
    if header.compressed {
        laz::read(input, header, writer)
    } else {
        plain::read(input, header, writer)
    }
}

impl Header {
    /// How the spool holds the points.
    pub(super) fn native(&self) -> Native {
        Native::Las {
            scale: self.scale,
            offset: self.offset,
        }
    }
}

/// How a record says that it is withheld.
#[derive(Debug, Clone, Copy)]
struct Record {
    withheld: u8,
}

impl Record {
    fn of(header: &Header) -> Self {
        let withheld = match (header.point_format, header.version) {
            (6.., _) => 0x04,
            // In LAS 1.0 the whole byte is the class.
            (_, [1, 0]) => 0,
            _ => 0x80,
        };
        Self { withheld }
    }

    #[inline]
    fn is_withheld(self, record: &[u8]) -> bool {
        record[FLAGS] & self.withheld != 0
    }
}

#[inline]
fn position(record: &[u8]) -> [i32; 3] {
    let word = |at: usize| {
        i32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    [word(0), word(4), word(8)]
}
