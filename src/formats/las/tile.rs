//! LAZ files that are nodes of a larger whole: all with one header, each in memory.

use super::super::input::Input;
use super::chunks::Decoder;
use super::fields::{self, Fields};
use super::{Header, Record, laszip, laz};
use outcrop_disk::error::Result;
use outcrop_points::columns::Column;
use outcrop_points::native::Native;
use outcrop_points::spool::{Sink, SourceWriter};

/// The header that all nodes must agree with.
pub(in super::super) struct Laz(Header);

impl Laz {
    /// Memory of a decoder.
    pub(in super::super) const MEMORY: u64 = 4 << 20;

    /// Reads the header of one node.
    pub(in super::super) fn open(node: &Input) -> Result<Self> {
        Header::read(node).map(Self)
    }

    pub(in super::super) fn native(&self) -> Native {
        Native::Las {
            scale: self.0.scale,
            offset: self.0.offset,
        }
    }

    pub(in super::super) fn columns(&self) -> Vec<Column> {
        fields::columns(&self.0)
    }

    /// Points of that node, as its header claims them.
    pub(in super::super) fn points(&self) -> u64 {
        self.0.claimed
    }

    /// Reads all points of a node; returns their number.
    pub(in super::super) fn read_all(
        &self,
        node: &Input,
        writer: &SourceWriter<'_>,
        sink: &mut Sink<'_, i32>,
    ) -> Result<u64> {
        let header = Header::read(node)?;
        self.check(node, &header)?;
        let laszip = laszip::read(node, &header)?;
        laz::plausible(node, header.claimed)?;
        let fields = Fields::of(&header, writer.wanted);
        let decoder = Decoder {
            input: node,
            header: &header,
            laszip: &laszip,
            record: Record::of(&header, writer.classes, &fields),
        };
        let mut warnings = Vec::new();
        let table = laz::table_of(node, &header, &laszip, writer.workspace, &mut warnings)?;
        for chunk in &table.chunks {
            if header.format.is_extended {
                decoder.layers(*chunk, sink)?;
            } else {
                let source = node.stream(chunk.at, chunk.at + chunk.bytes);
                decoder.stream(source, chunk.at, chunk.points, sink)?;
            }
        }
        Ok(header.claimed)
    }

    fn check(&self, node: &Input, header: &Header) -> Result<()> {
        let of = |h: &Header| {
            (
                h.raw.point_data_record_format,
                h.record_bytes,
                h.scale,
                h.offset,
            )
        };
        let told = |h: &Header| {
            let (format, bytes, scale, offset) = of(h);
            format!("point format {format} of {bytes} bytes, scale {scale:?}, offset {offset:?}")
        };
        match of(header) == of(&self.0) && header.format.is_compressed {
            true => Ok(()),
            false => Err(node.error("LAS header", told(header), told(&self.0))),
        }
    }
}
