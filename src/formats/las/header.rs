//! The public header block, read leniently: fields without influence on positions are not checked.

use super::super::input::Input;
use super::extra::{self, Extra};
use super::vlr::Records;
use las::point::Format;
use las::raw;
use outcrop_disk::error::Result;
use std::io::Read;
use std::ops::Range;

/// Headers of LAS 1.0 to 1.2, of 1.3, which has the offset of waveforms, and of 1.4.
const SMALLEST: usize = 227;
const WITH_WAVEFORMS: usize = 235;
const LARGEST: usize = 375;

/// Byte of the minor version.
const MINOR: usize = 25;

/// Valid scales and offsets. Values outside indicate damage, and would overflow.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e9;
const LARGEST_OFFSET: f64 = 1e15;

/// The header, and what follows from it.
#[derive(Debug, Clone)]
pub(super) struct Header {
    /// Without the fields that the file has no room for, and without the compression in the point format.
    pub(super) raw: raw::Header,
    pub(super) format: Format,
    pub(super) record_bytes: u16,
    /// Number of points given in the header.
    pub(super) claimed: u64,
    /// Offset of the first point.
    pub(super) data: u64,
    /// Upper limit for the end of the points: the first extended record or waveform, or the end of the file.
    pub(super) data_end: u64,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
    /// Numbers in the extra bytes of a record.
    pub(super) extra: Vec<Extra>,
    pub(super) warnings: Vec<String>,
}

impl Header {
    /// The bytes of the file with its variable-length records: between the header and the points.
    pub(super) fn records(&self) -> Range<u64> {
        self.raw.header_size.into()..self.data
    }

    /// Reads and checks the header.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] naming the field and its byte offset.
    pub(super) fn read(input: &Input) -> Result<Self> {
        let mut raw = raw(input)?;
        let format = layout(input, &mut raw)?;
        let data = raw.offset_to_point_data.into();
        // The points end where other data are known to start. Waveforms in this file are an extended record
        // too.
        let extended = raw.evlr.map(|e| e.start_of_first_evlr).into_iter();
        let other = extended.chain(raw.start_of_waveform_data_packet_record);
        let data_end = other.filter(|start| (data + 1..input.bytes).contains(start));
        // Formats from 6 on leave the legacy count at zero; writers of lower formats fill in one of the two,
        // or both.
        let count = raw.large_file.map(|l| l.number_of_point_records);
        let count = count.filter(|count| *count > 0);
        let mut header = Self {
            format,
            record_bytes: raw.point_data_record_length,
            claimed: count.unwrap_or(raw.number_of_point_records.into()),
            data,
            data_end: data_end.min().unwrap_or(input.bytes),
            scale: [raw.x_scale_factor, raw.y_scale_factor, raw.z_scale_factor],
            offset: [raw.x_offset, raw.y_offset, raw.z_offset],
            extra: Vec::new(),
            warnings: Vec::new(),
            raw,
        };
        let end = usize::from(header.record_bytes);
        let extra = usize::from(header.format.len())..end;
        header.extra = extra::read(Records::plain(input, header.records()), extra);
        if header.raw.version.minor > 4 {
            let warning = format!("LAS version {} is read as 1.4", header.raw.version);
            header.warnings.push(warning);
        }
        if header.claimed > 0 || header.data < header.data_end {
            header.check_transform(input)?;
        }
        Ok(header)
    }

    fn check_transform(&mut self, input: &Input) -> Result<()> {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let scale = self.scale[axis];
            if !SCALES.contains(&scale.abs()) {
                return Err(input.error(
                    format!("{name} scale factor at byte {}", 131 + 8 * axis),
                    format!("{scale:e}"),
                    format!("a number of {:e} to {:e}", SCALES.start(), SCALES.end()),
                ));
            }
            if scale < 0.0 {
                self.warnings
                    .push(format!("the {name} scale factor {scale} is negative"));
            }
            let offset = self.offset[axis];
            if offset.is_nan() || offset.abs() > LARGEST_OFFSET {
                return Err(input.error(
                    format!("{name} offset at byte {}", 155 + 8 * axis),
                    format!("{offset:e}"),
                    format!("a number of at most {LARGEST_OFFSET:e}"),
                ));
            }
        }
        Ok(())
    }
}

/// The header as it stands in the file.
fn raw(input: &Input) -> Result<raw::Header> {
    let mut head = input.head(LARGEST)?;
    if head.len() < SMALLEST {
        return Err(input.error(
            "LAS header",
            format!("the end of the file after {} bytes", head.len()),
            format!("a header of at least {SMALLEST} bytes"),
        ));
    }
    let minor = head[MINOR];
    head[MINOR] = minor.min(4);
    // Padding may be missing.
    let mut raw = raw::Header::read_from((&head[..]).chain(std::io::repeat(0)))
        .map_err(|e| input.error("LAS header", e.to_string(), "a header that can be read"))?;
    raw.version.minor = minor;
    if raw.version.major != 1 {
        return Err(input.error("version at byte 24", raw.version.to_string(), "1.0 to 1.4"));
    }
    let room = head.len().min(raw.header_size.into());
    raw.large_file = raw.large_file.filter(|_| room >= LARGEST);
    raw.evlr = raw
        .evlr
        .filter(|e| room >= LARGEST && e.number_of_evlrs > 0);
    let waveforms = raw.start_of_waveform_data_packet_record;
    raw.start_of_waveform_data_packet_record = waveforms.filter(|_| room >= WITH_WAVEFORMS);
    raw.header_size = raw.header_size.max(SMALLEST as u16);
    Ok(raw)
}

/// Checks the layout of the points.
fn layout(input: &Input, raw: &mut raw::Header) -> Result<Format> {
    let byte = raw.point_data_record_format;
    raw.point_data_record_format &= 0x3f;
    let number = raw.point_data_record_format;
    let Ok(mut format) = Format::new(number) else {
        return Err(input.error(
            "point format at byte 104",
            format!("{number} (byte {byte:#04x})"),
            "0 to 10",
        ));
    };
    if raw.point_data_record_length < format.len() {
        return Err(input.error(
            "record length at byte 105",
            raw.point_data_record_length.to_string(),
            format!("at least {} for {format}", format.len()),
        ));
    }
    let data = u64::from(raw.offset_to_point_data);
    if data < SMALLEST as u64 || data > input.bytes {
        return Err(input.error(
            "offset to point data at byte 96",
            data.to_string(),
            format!("{SMALLEST} to {}, the size of the file", input.bytes),
        ));
    }
    format.is_compressed = byte & 0x80 != 0;
    Ok(format)
}
