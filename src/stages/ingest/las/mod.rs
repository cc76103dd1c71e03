//! LAS 1.0 to 1.4 and LAZ.

mod chunks;
pub(super) mod crs;
mod gps;
mod header;
mod laz;
mod plain;
mod table;
mod vlr;

pub(super) use crs::Crs;
pub(super) use header::Header;

/// Byte of a record that holds the withheld flag, in all point formats.
const FLAGS: usize = 15;

/// Byte that holds the class in point formats 6 to 10; before, it shares that of the flags.
const CLASS: usize = 16;

use super::Classes;
use super::input::Input;
use super::source::Native;
use super::spool::{Sink, SourceWriter};
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

/// Where a record says that it is withheld and of which class it is, and which classes are wanted.
#[derive(Debug, Clone, Copy)]
struct Record<'a> {
    withheld: u8,
    /// Byte and bits of the class.
    class: (usize, u8),
    /// None if all are.
    wanted: Option<&'a Classes>,
}

impl<'a> Record<'a> {
    fn of(header: &Header, classes: &'a Classes) -> Self {
        let (withheld, class) = match (header.point_format, header.version) {
            (6.., _) => (0x04, (CLASS, 0xff)),
            // In LAS 1.0 the whole byte is the class.
            (_, [1, 0]) => (0, (FLAGS, 0xff)),
            _ => (0x80, (FLAGS, 0x1f)),
        };
        let wanted = (*classes != Classes::All).then_some(classes);
        Self {
            withheld,
            class,
            wanted,
        }
    }

    /// Hands a point on, or counts why not.
    #[inline]
    fn take(self, record: &[u8], sink: &mut Sink<'_, i32>) -> Result<()> {
        if record[FLAGS] & self.withheld != 0 {
            sink.withhold();
            return Ok(());
        }
        let (byte, bits) = self.class;
        if self.wanted.is_some_and(|c| !c.wants(record[byte] & bits)) {
            sink.leave_out();
            return Ok(());
        }
        sink.push(position(record))
    }
}

#[inline]
fn position(record: &[u8]) -> [i32; 3] {
    let word = |at: usize| {
        i32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    [word(0), word(4), word(8)]
}
