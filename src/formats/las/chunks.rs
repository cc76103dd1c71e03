//! Decoding of one chunk.

use super::super::contain::contain;
use super::super::input::Input;
use super::gps::GpsTimes;
use super::head::LayerHead;
use super::laszip::Laszip;
use super::table::Chunk;
use super::{Header, Record};
use laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use laz::{DecompressionSelection, LazItem, LazItemType};
use outcrop_disk::error::{Error, Result};
use outcrop_points::spool::Sink;
use std::io::Read;

/// Bytes decoded before they are passed to the sink.
const BATCH: usize = 64 << 10;

/// Decodes chunks of one file.
pub(super) struct Decoder<'a> {
    pub(super) input: &'a Input,
    pub(super) header: &'a Header,
    pub(super) laszip: &'a Laszip,
    pub(super) record: Record<'a>,
}

impl Decoder<'_> {
    /// Decodes a layered chunk.
    pub(super) fn layers(&self, chunk: Chunk, sink: &mut Sink<'_, i32>) -> Result<()> {
        let head = LayerHead::read(self.input, self.header, self.laszip, chunk.at)?;
        if head.points < chunk.points || head.bytes > chunk.bytes {
            return Err(self.input.error(
                format!("LAZ chunk at byte {}", chunk.at),
                format!("{} points in {} bytes", head.points, head.bytes),
                format!("{} points in {} bytes", chunk.points, chunk.bytes),
            ));
        }
        let end = chunk.at + head.bytes;
        let mut decoder = LayeredPointRecordDecompressor::new(self.input.range(chunk.at, end));
        for item in &self.laszip.items {
            self.add_item(&mut decoder, item)?;
        }
        let wanted = DecompressionSelection::base()
            .decompress_z()
            .decompress_flags();
        let wanted = match self.record.wanted {
            Some(_) => wanted.decompress_classification(),
            None => wanted,
        };
        decoder.set_selection(self.record.fields.layers(wanted));
        self.points(&mut decoder, chunk.at, chunk.points, sink)
    }

    /// Decodes a chunk, or a stream, of whole points from `source`. Returns the source, positioned after it.
    pub(super) fn stream<R: Read>(
        &self,
        source: R,
        at: u64,
        points: u64,
        sink: &mut Sink<'_, i32>,
    ) -> Result<R> {
        let mut decoder = SequentialPointRecordDecompressor::new(source);
        for item in &self.laszip.items {
            if item.item_type() == LazItemType::GpsTime && item.version() == 2 {
                decoder.add_field_decompressor(GpsTimes::default());
            } else {
                self.add_item(&mut decoder, item)?;
            }
        }
        self.points(&mut decoder, at, points, sink)?;
        Ok(decoder.into_inner())
    }

    fn add_item<R>(&self, decoder: &mut impl RecordDecompressor<R>, item: &LazItem) -> Result<()> {
        let done = contain(|| decoder.set_fields_from(&vec![*item]));
        let done = done.and_then(|r| r.map_err(|e| e.to_string()));
        done.map_err(|why| {
            self.input
                .error("laszip record", why, "items that can be decoded")
        })
    }

    fn points<R>(
        &self,
        decoder: &mut impl RecordDecompressor<R>,
        at: u64,
        points: u64,
        sink: &mut Sink<'_, i32>,
    ) -> Result<()> {
        let size = decoder.record_size();
        let record = self.record;
        let most = (BATCH / size).max(1);
        let mut batch = vec![0u8; size * most];
        let mut done = 0u64;
        while done < points {
            let now = (points - done).min(most as u64) as usize;
            let mut decoded = 0usize;
            let result = contain(|| {
                for bytes in batch[..now * size].chunks_exact_mut(size) {
                    decoder.decompress_next(bytes)?;
                    decoded += 1;
                }
                Ok::<(), std::io::Error>(())
            });
            let result = result.and_then(|r| r.map_err(|e| reason(&e)));
            result.map_err(|why| self.damaged(at, done + decoded as u64, points, why))?;
            for bytes in batch[..now * size].chunks_exact(size) {
                record.take(bytes, sink)?;
            }
            done += now as u64;
        }
        Ok(())
    }

    fn damaged(&self, at: u64, point: u64, points: u64, why: String) -> Error {
        self.input.error(
            format!("LAZ chunk at byte {at}, point {point} of {points}"),
            why,
            "compressed points",
        )
    }
}

fn reason(error: &std::io::Error) -> String {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        "the end of the compressed data".into()
    } else {
        error.to_string()
    }
}
