//! The public header block, read leniently: fields without influence on positions are not checked.

use super::super::input::{Input, f64_at, u16_at, u32_at, u64_at};
use crate::error::Result;

/// Smallest header, that of LAS 1.0 to 1.2.
const SMALLEST: usize = 227;

/// Header of LAS 1.4.
const LARGEST: usize = 375;

/// Bytes of a record of each point format.
const RECORD_BYTES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Valid scales and offsets. Values outside indicate damage, and would overflow.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e9;
const LARGEST_OFFSET: f64 = 1e15;

/// The fields of the header that are used.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) version: [u8; 2],
    pub(super) compressed: bool,
    pub(super) point_format: u8,
    pub(super) record_bytes: u16,
    /// Number of points given in the header.
    pub(super) claimed: u64,
    /// Offset of the first point.
    pub(super) data: u64,
    /// Upper limit for the end of the points: the first extended record or waveform, or the end of the file.
    pub(super) data_end: u64,
    /// Offset of the variable-length records.
    pub(super) vlrs: u64,
    /// Offset and number of the extended records.
    pub(super) extended: Option<(u64, u32)>,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
    /// Smallest and largest coordinates given in the header; used for estimates only.
    pub(super) bounds: [[f64; 3]; 2],
    pub(super) warnings: Vec<String>,
}

impl Header {
    /// Reads and checks the header.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the field and its byte offset.
    pub(super) fn read(input: &Input) -> Result<Self> {
        let head = input.head(LARGEST)?;
        if head.len() < SMALLEST {
            return Err(input.error(
                "LAS header",
                format!("the end of the file after {} bytes", head.len()),
                format!("a header of at least {SMALLEST} bytes"),
            ));
        }
        let version = [head[24], head[25]];
        let mut warnings = Vec::new();
        if version[0] != 1 {
            return Err(input.error(
                "version at byte 24",
                format!("{}.{}", version[0], version[1]),
                "1.0 to 1.4",
            ));
        }
        if version[1] > 4 {
            warnings.push(format!("LAS version 1.{} is read as 1.4", version[1]));
        }
        let header_bytes = usize::from(u16_at(&head, 94));
        let full = version[1] >= 4 && header_bytes >= LARGEST && head.len() >= LARGEST;
        // Formats from 6 on leave the legacy count at zero; writers of lower formats fill in one of the two,
        // or both.
        let count = if full { u64_at(&head, 247) } else { 0 };
        let legacy_count = u64::from(u32_at(&head, 107));
        let mut header = Self {
            version,
            compressed: head[104] & 0x80 != 0,
            point_format: head[104] & 0x3f,
            record_bytes: u16_at(&head, 105),
            claimed: if count > 0 { count } else { legacy_count },
            data: u64::from(u32_at(&head, 96)),
            data_end: input.bytes,
            vlrs: header_bytes.max(SMALLEST) as u64,
            extended: full.then(|| (u64_at(&head, 235), u32_at(&head, 243))),
            scale: [131, 139, 147].map(|at| f64_at(&head, at)),
            offset: [155, 163, 171].map(|at| f64_at(&head, at)),
            bounds: [[187, 203, 219], [179, 195, 211]].map(|ends| ends.map(|at| f64_at(&head, at))),
            warnings,
        };
        header.check_layout(input, head[104])?;
        header.find_end(input, &head, header_bytes);
        if header.claimed > 0 || header.data < header.data_end {
            header.check_transform(input)?;
        }
        Ok(header)
    }

    fn check_layout(&self, input: &Input, format_byte: u8) -> Result<()> {
        let Some(&least) = RECORD_BYTES.get(usize::from(self.point_format)) else {
            return Err(input.error(
                "point format at byte 104",
                format!("{} (byte {format_byte:#04x})", self.point_format),
                "0 to 10",
            ));
        };
        if self.record_bytes < least {
            return Err(input.error(
                "record length at byte 105",
                self.record_bytes.to_string(),
                format!("at least {least} for point format {}", self.point_format),
            ));
        }
        if self.data < SMALLEST as u64 || self.data > input.bytes {
            return Err(input.error(
                "offset to point data at byte 96",
                self.data.to_string(),
                format!("{SMALLEST} to {}, the size of the file", input.bytes),
            ));
        }
        Ok(())
    }

    /// Ends the points where other data are known to start.
    fn find_end(&mut self, input: &Input, head: &[u8], header_bytes: usize) {
        let extended = self.extended.filter(|(_, count)| *count > 0);
        // Waveform packets in this file are an extended record too.
        let has_waveforms = self.version[1] >= 3 && header_bytes >= 235 && head.len() >= 235;
        let waveforms = has_waveforms.then(|| u64_at(head, 227));
        self.data_end = extended
            .map(|(start, _)| start)
            .into_iter()
            .chain(waveforms)
            .filter(|start| (self.data + 1..input.bytes).contains(start))
            .min()
            .unwrap_or(input.bytes);
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
