//! The laszip record, which describes the compression of the points.

use super::super::input::{Input, u16_at};
use super::Header;
use super::vlr::Records;
use laz::{LazItem, LazItemRecordBuilder, LazItemType, LazVlr};
use outcrop_disk::error::Result;

/// The laszip record.
#[derive(Debug, Clone)]
pub(super) struct Laszip {
    /// True if all points are one stream; else they are in chunks.
    pub(super) stream: bool,
    /// Points in each chunk except the last; `None` if every chunk has its own number.
    pub(super) chunk_points: Option<u64>,
    pub(super) items: Vec<LazItem>,
}

/// Finds and checks the record.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] if there is none, or if it describes an unsupported compression.
pub(super) fn read(input: &Input, header: &Header) -> Result<Laszip> {
    for record in Records::plain(input, header.records()) {
        let (at, record) = record?;
        if record.user_id == LazVlr::USER_ID && record.record_id == LazVlr::RECORD_ID {
            return parse(input, header, at, &record.data);
        }
    }
    Err(input.error(
        "variable-length records",
        "no laszip record",
        "one, for the point format says that points are compressed",
    ))
}

fn parse(input: &Input, header: &Header, at: u64, record: &[u8]) -> Result<Laszip> {
    let wrong = |found: String, expected: String| {
        Err(input.error(format!("laszip record at byte {at}"), found, expected))
    };
    let vlr = match LazVlr::from_buffer(record) {
        Ok(vlr) => vlr,
        Err(e) => return wrong(e.to_string(), "a record that can be decoded".into()),
    };
    let coder = u16_at(record, 2);
    if coder != 0 {
        return wrong(format!("coder {coder}"), "coder 0, arithmetic".into());
    }
    let items = vlr.items();
    let sum: u64 = items.iter().map(|i| u64::from(i.size())).sum();
    let layered = header.format.is_extended;
    let (versions, first) = match layered {
        true => (3..=4, LazItemType::Point14),
        false => (1..=2, LazItemType::Point10),
    };
    let fits = items.first().is_some_and(|i| i.item_type() == first)
        && items.iter().all(|i| {
            let standard = LazItemRecordBuilder::new().add_item(i.item_type()).build();
            i.size() > 0 && versions.contains(&i.version()) && i.size() == standard[0].size()
        });
    let format = header.raw.point_data_record_format;
    if !fits || sum != u64::from(header.record_bytes) {
        return wrong(
            format!("items of {sum} bytes: {}", names(items)),
            format!(
                "items of point format {format} that make up a record of {} bytes",
                header.record_bytes
            ),
        );
    }
    let compressor = u16_at(record, 0);
    if !matches!((compressor, layered), (1 | 2, false) | (3, true)) {
        return wrong(
            format!("compressor {compressor} for point format {format}"),
            "1 or 2 for point formats 0 to 5, 3 for 6 to 10".into(),
        );
    }
    let counted = vlr.uses_variable_size_chunks();
    Ok(Laszip {
        stream: compressor == 1,
        chunk_points: (!counted).then(|| vlr.chunk_size().into()),
        items: items.clone(),
    })
}

fn names(items: &[LazItem]) -> String {
    let names: Vec<String> = items
        .iter()
        .map(|i| format!("{:?} version {}", i.item_type(), i.version()))
        .collect();
    names.join(", ")
}

/// Number of layers of an item in a chunk of point formats 6 to 10.
pub(super) fn layers(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(bytes) => usize::from(bytes),
        _ => 1,
    }
}
