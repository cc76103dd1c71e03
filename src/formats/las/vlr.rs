//! Variable-length records, and the laszip record, which describes the compression of the points.

use super::super::input::{Input, u16_at};
use super::Header;
use las::raw;
use laz::{LazItem, LazItemRecordBuilder, LazItemType, LazVlr};
use outcrop_disk::error::Result;

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
    /// The records between the header and the points.
    pub(super) fn plain(input: &'a Input, header: &Header) -> Self {
        Self {
            input,
            at: header.raw.header_size.into(),
            end: header.data,
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
    for record in Records::plain(input, header) {
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
