//! Nodes whose points are rows of numbers, as they are or compressed by Zstandard.

use super::super::input::Input;
use super::super::input::beside::Files;
use super::hierarchy::Node;
use super::info::{Data, Dimension, Info, Stored, agrees, damaged};
use outcrop_disk::error::Result;
use outcrop_points::columns::Column;
use outcrop_points::coordinate::Coordinate;
use outcrop_points::native::Native;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};
use std::borrow::Cow;
use std::io::Read;

/// The flag of points that are to be ignored.
const WITHHELD: &str = "Withheld";

/// Memory of the decoder of Zstandard, with a window of 8 MiB.
const DECODER: u64 = 10 << 20;

/// How rows are read.
pub(super) struct Rows {
    pub(super) native: Native,
    compressed: bool,
    /// Bytes of a row.
    bytes: usize,
    axes: [Dimension; 3],
    withheld: Option<Dimension>,
    /// The columns beside the coordinates.
    others: Vec<Dimension>,
}

impl Rows {
    pub(super) fn of(input: &Input, info: &Info) -> Result<Self> {
        let axes = info.axes(input)?.map(Clone::clone);
        let is_axis = |d: &&Dimension| !axes.iter().any(|axis| axis.name == d.name);
        let others = info.schema.iter().filter(is_axis);
        let others = others.filter(|d| d.name != WITHHELD);
        Ok(Self {
            native: native(&axes),
            compressed: info.data == Data::Zstandard,
            bytes: info.row(),
            withheld: info.dimension(WITHHELD).cloned(),
            others: others.cloned().collect(),
            axes,
        })
    }

    pub(super) fn columns(&self) -> Vec<Column> {
        let column = |d: &Dimension| Column::new(&d.name, d.stored.scalar());
        self.others.iter().map(column).collect()
    }

    /// Reads nodes on all threads; `convert` makes a coordinate of the spool's type.
    pub(super) fn read<T: Coordinate>(
        &self,
        input: &Input,
        nodes: &[Node],
        files: &Files,
        target: &SourceWriter<'_>,
        convert: fn(f64) -> T,
    ) -> Result<()> {
        let wanted = &target.wanted.numbers;
        let wanted: Vec<&Dimension> = wanted.iter().map(|n| &self.others[*n]).collect();
        let decoder = if self.compressed { DECODER } else { 0 };
        let memory =
            |unit: usize| 2 * nodes[unit].points * self.bytes as u64 + decoder + sink_bytes::<T>();
        let work = |unit: usize, sink: &mut Sink<'_, T>| {
            let name = files.name(unit);
            let file = files.take(unit)?;
            let rows = self.unpacked(input, &name, &file, nodes[unit].points)?;
            if rows.len() % self.bytes != 0 {
                let found = format!("{} bytes", rows.len());
                let expected = format!("rows of {} bytes", self.bytes);
                return Err(damaged(input, &name, found, &expected));
            }
            let points = (rows.len() / self.bytes) as u64;
            agrees(input, &name, points, nodes[unit].points)?;
            for row in rows.chunks_exact(self.bytes) {
                self.take(row, &wanted, convert, sink)?;
            }
            Ok(())
        };
        target.units("EPT nodes", nodes.len(), memory, work)
    }

    /// The number of rows of a compressed file.
    pub(super) fn count(&self, input: &Input, name: &str, file: &[u8]) -> Result<u64> {
        let bytes = zstd::stream::read::Decoder::with_buffer(file)
            .and_then(|mut decoder| std::io::copy(&mut decoder, &mut std::io::sink()));
        let bytes = bytes
            .map_err(|e| damaged(input, name, e.to_string(), "rows compressed by Zstandard"))?;
        Ok(bytes / self.bytes as u64)
    }

    /// The rows of a file, at most those of so many points and one byte more.
    fn unpacked<'a>(
        &self,
        input: &Input,
        name: &str,
        file: &'a [u8],
        points: u64,
    ) -> Result<Cow<'a, [u8]>> {
        if !self.compressed {
            return Ok(Cow::Borrowed(file));
        }
        let most = points * self.bytes as u64 + 1;
        let mut rows = Vec::new();
        let read = zstd::stream::read::Decoder::with_buffer(file)
            .and_then(|decoder| decoder.take(most).read_to_end(&mut rows));
        read.map_err(|e| damaged(input, name, e.to_string(), "rows compressed by Zstandard"))?;
        Ok(Cow::Owned(rows))
    }

    #[inline]
    fn take<T: Coordinate>(
        &self,
        row: &[u8],
        wanted: &[&Dimension],
        convert: fn(f64) -> T,
        sink: &mut Sink<'_, T>,
    ) -> Result<()> {
        if self.withheld.as_ref().is_some_and(|d| d.number(row) != 0.0) {
            sink.withhold();
            return Ok(());
        }
        let coordinate = |axis: &Dimension| match self.native {
            Native::Las { .. } => axis.number(row),
            _ => axis.value(row),
        };
        let point = [0, 1, 2].map(|n| convert(coordinate(&self.axes[n])));
        sink.push_with(point, |values| {
            for d in wanted {
                d.stored.scalar().put(d.value(row), values);
            }
        })
    }
}

/// The type of the coordinates in the spool: integers if all three are 32-bit integers with a scale.
fn native(axes: &[Dimension; 3]) -> Native {
    let on_grid = |d: &Dimension| d.stored == Stored::I32 && d.transform.is_some();
    if axes.iter().all(on_grid) {
        let of = |d: &Dimension| d.transform.unwrap_or((1.0, 0.0));
        let [x, y, z] = [0, 1, 2].map(|n| of(&axes[n]));
        return Native::Las {
            scale: [x.0, y.0, z.0],
            offset: [x.1, y.1, z.1],
        };
    }
    let single = |d: &Dimension| d.stored == Stored::F32 && d.transform.is_none();
    match axes.iter().all(single) {
        true => Native::F32,
        false => Native::F64,
    }
}
