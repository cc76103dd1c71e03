//! LAS 1.0 to 1.4 and LAZ.

mod chunks;
mod copc;
mod crs;
mod extra;
mod fields;
mod gps;
mod head;
mod header;
mod laszip;
mod laz;
mod plain;
mod skip;
mod table;
mod tile;
mod vlr;

use header::Header;
pub(super) use tile::Laz;

/// Byte of a record with the withheld flag, in all point formats.
const FLAGS: usize = 15;

/// Byte of the class in point formats 6 to 10; in lower formats the class is in the same byte as the flags.
const CLASS: usize = 16;

use super::input::Input;
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use super::reads::{Means, Reads};
use fields::Fields;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_points::Classes;
use outcrop_points::Crs;
use outcrop_points::Format;
use outcrop_points::columns::Column;
use outcrop_points::crop::Nearby;
use outcrop_points::native::Native;
use outcrop_points::spool::{Sink, SourceWriter};

/// Both formats; the header distinguishes them.
pub(super) struct Las;

impl PointFormat for Las {
    fn names(&self) -> &'static str {
        "LAS, LAZ"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["las", "laz"]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        let signed = head.bytes.starts_with(b"LASF");
        if !signed && head.is_named(self.extensions()) {
            let why = format!("{}, no signature \"LASF\"", head.shown());
            return Err(Refusal::Unknown(why));
        }
        Ok(signed)
    }

    fn open(&self, input: &Input, _: &Head) -> Result<Box<dyn PointFile>> {
        Ok(Box::new(Header::read(input)?))
    }
}

impl PointFile for Header {
    fn says_what_it_reads(&self) -> bool {
        self.format.is_compressed
    }

    fn claims(&self, input: &Input) -> Claims {
        let raw = &self.raw;
        let (format, least) = match self.format.is_compressed {
            true => (Format::LAZ, 1),
            false => (Format::LAS, self.record_bytes.into()),
        };
        let native = Native::Las {
            scale: self.scale,
            offset: self.offset,
        };
        Claims {
            classes: true,
            version: Some(raw.version.to_string()),
            point_format: Some(raw.point_data_record_format),
            bounds: Some([
                [raw.min_x, raw.min_y, raw.min_z],
                [raw.max_x, raw.max_y, raw.max_z],
            ]),
            ..Claims::new(input, format, native, self.claimed, least)
        }
    }

    fn lies_outside(
        &self,
        input: &Input,
        wanted: &Nearby<'_>,
        workspace: &Workspace,
    ) -> Option<[[f64; 3]; 2]> {
        // What is damaged is reported when the file is read.
        let outside = Header::lies_outside(self, input, wanted, workspace).unwrap_or(false);
        self.native_bounds().filter(|_| outside)
    }

    fn reads(&self, input: &Input, nearby: Option<&Nearby<'_>>, means: Means<'_>) -> Result<Reads> {
        match nearby {
            Some(nearby) => self.reads_near(input, nearby, means),
            None => Ok(Reads::whole(input, self.claimed)),
        }
    }

    fn crs(&self, input: &Input) -> Option<Crs> {
        crs::read(input, self)
    }

    fn columns(&self) -> Vec<Column> {
        fields::columns(self)
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let mut warnings = self.warnings.clone();
        warnings.extend(match self.format.is_compressed {
            true => laz::read(input, self, target)?,
            false => plain::read(input, self, target)?,
        });
        Ok(warnings)
    }
}

/// The position of the withheld flag and of the class in a record, and the wanted classes and fields.
#[derive(Debug, Clone, Copy)]
struct Record<'a> {
    withheld: u8,
    /// Byte and bits of the class.
    class: (usize, u8),
    /// `None` if all classes are wanted.
    wanted: Option<&'a Classes>,
    fields: &'a Fields,
}

impl<'a> Record<'a> {
    fn of(header: &Header, classes: &'a Classes, fields: &'a Fields) -> Self {
        let (withheld, class) = match (header.format.is_extended, header.raw.version.minor) {
            (true, _) => (0x04, (CLASS, 0xff)),
            // In LAS 1.0 the class is the whole byte.
            (_, 0) => (0, (FLAGS, 0xff)),
            _ => (0x80, (FLAGS, 0x1f)),
        };
        let wanted = (*classes != Classes::All).then_some(classes);
        Self {
            withheld,
            class,
            wanted,
            fields,
        }
    }

    /// Passes a point on, or counts why it is left out.
    #[inline]
    fn take(self, record: &[u8], sink: &mut Sink<'_, i32>) -> Result<()> {
        let (byte, bits) = self.class;
        if record[FLAGS] & self.withheld != 0 {
            sink.withhold();
        } else if self.wanted.is_some_and(|c| !c.wants(record[byte] & bits)) {
            sink.leave_out();
        } else {
            let values = |values: &mut Vec<u8>| self.fields.put(record, values);
            return sink.push_with(position(record), values);
        }
        Ok(())
    }
}

#[inline]
fn position(record: &[u8]) -> [i32; 3] {
    let word = |at: usize| {
        i32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]])
    };
    [word(0), word(4), word(8)]
}
