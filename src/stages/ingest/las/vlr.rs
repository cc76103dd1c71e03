//! The laszip record, which describes the compression of the points.

use super::super::input::{Input, u16_at, u32_at};
use super::Header;
use crate::error::Result;
use laz::{LazItem, LazItemType, LazVlr};

/// Bytes before the data of a variable-length record.
const HEAD: usize = 54;

/// Organisation of the compressed points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// One stream of all points.
    Stream,
    /// Chunks, each a stream of whole points.
    Chunks,
    /// Chunks with a separate layer for each field.
    Layers,
}

/// The laszip record.
#[derive(Debug, Clone)]
pub(super) struct Laszip {
    pub(super) layout: Layout,
    /// Points in each chunk except the last; `None` if every chunk has its own number.
    pub(super) chunk_points: Option<u64>,
    pub(super) items: Vec<LazItem>,
}

/// Finds and checks the record.
///
/// # Errors
/// [`crate::Error::Input`] if there is none, or if it describes an unsupported compression.
pub(super) fn read(input: &Input, header: &Header) -> Result<Laszip> {
    let mut at = header.vlrs;
    while at + HEAD as u64 <= header.data {
        let mut head = [0u8; HEAD];
        input.read_exact_at(at, &mut head, "variable-length record")?;
        let bytes = usize::from(u16_at(&head, 20));
        let data = at + HEAD as u64;
        let user = head[2..18].split(|b| *b == 0).next().unwrap_or(&[]);
        if user == LazVlr::USER_ID.as_bytes() && u16_at(&head, 18) == LazVlr::RECORD_ID {
            let mut record = vec![0u8; bytes];
            input.read_exact_at(data, &mut record, "laszip record")?;
            return parse(input, header, data, &record);
        }
        at = data + bytes as u64;
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
    let vlr = match LazVlr::read_from(record) {
        Ok(vlr) => vlr,
        Err(e) => return wrong(e.to_string(), "a record that can be decoded".into()),
    };
    let coder = u16_at(record, 2);
    if coder != 0 {
        return wrong(format!("coder {coder}"), "coder 0, arithmetic".into());
    }
    let items = vlr.items();
    let sum: u64 = items.iter().map(|i| u64::from(i.size())).sum();
    let layered = header.point_format >= 6;
    let (versions, first) = match layered {
        true => (3..=4, LazItemType::Point14),
        false => (1..=2, LazItemType::Point10),
    };
    let fits = items.first().is_some_and(|i| i.item_type() == first)
        && items.iter().all(|i| {
            i.size() > 0
                && versions.contains(&i.version())
                && fixed_size(i.item_type()).is_none_or(|s| s == i.size())
        });
    if !fits || sum != u64::from(header.record_bytes) {
        return wrong(
            format!("items of {sum} bytes: {}", names(items)),
            format!(
                "items of point format {} that make up a record of {} bytes",
                header.point_format, header.record_bytes
            ),
        );
    }
    let layout = match (u16_at(record, 0), layered) {
        (1, false) => Layout::Stream,
        (2, false) => Layout::Chunks,
        (3, true) => Layout::Layers,
        (other, _) => {
            let format = header.point_format;
            let found = format!("compressor {other} for point format {format}");
            return wrong(
                found,
                "1 or 2 for point formats 0 to 5, 3 for 6 to 10".into(),
            );
        }
    };
    let variable = vlr.uses_variable_size_chunks() || u32_at(record, 12) == 0;
    Ok(Laszip {
        layout,
        chunk_points: (!variable).then(|| u64::from(vlr.chunk_size())),
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

fn fixed_size(item: LazItemType) -> Option<u16> {
    Some(match item {
        LazItemType::Point10 => 20,
        LazItemType::GpsTime => 8,
        LazItemType::RGB12 | LazItemType::RGB14 => 6,
        LazItemType::WavePacket13 | LazItemType::WavePacket14 => 29,
        LazItemType::Point14 => 30,
        LazItemType::RGBNIR14 => 8,
        LazItemType::Byte(_) | LazItemType::Byte14(_) => return None,
    })
}

/// Number of layers of an item in a chunk of [`Layout::Layers`].
pub(super) fn layers(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(bytes) => usize::from(bytes),
        _ => 1,
    }
}
