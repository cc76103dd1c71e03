//! The records of a scan: packets with a stream of bits for each part of a record.

use super::super::input::{Input, u16_at, u64_at};
use super::pages::{self, Pages, content_offset};
use super::scan::{Kind, Scan};
use outcrop_disk::error::Result;

/// Bytes of the head of a section.
const SECTION: usize = 32;

/// Most bytes of a packet.
const PACKET: usize = 1 << 16;

/// Most bytes that wait in all streams for their counterparts in other streams. Packets hold about as many
/// numbers of each.
const WAITING: usize = 4 << 20;

/// Records that are decoded at a time.
pub(super) const BLOCK: usize = 1024;

/// Bytes of memory for reading a scan, besides the numbers.
pub(super) fn memory(scan: &Scan) -> u64 {
    let streams = scan.fields.len() * size_of::<Stream>();
    // A buffer may have twice the size of its content.
    pages::MEMORY + (2 * (WAITING + PACKET) + PACKET + streams) as u64
}

/// The bits of one part of the records that are not decoded yet.
struct Stream {
    kind: Kind,
    bits: u32,
    bytes: Vec<u8>,
    /// Bits of `bytes` that are decoded.
    done: usize,
}

impl Stream {
    /// The number of numbers that are there.
    fn numbers(&self) -> usize {
        match self.bits {
            0 => usize::MAX,
            bits => (self.bytes.len() * 8 - self.done) / bits as usize,
        }
    }

    /// Removes whole bytes that are decoded, and adds others.
    fn append(&mut self, more: &[u8]) {
        self.bytes.drain(..self.done / 8);
        self.done %= 8;
        self.bytes.extend_from_slice(more);
    }

    /// The bits of the next number but `ahead`.
    #[inline]
    fn raw(&self, ahead: usize) -> u64 {
        let at = self.done + ahead * self.bits as usize;
        let from = &self.bytes[at / 8..];
        let mut word = [0; 16];
        match from.first_chunk() {
            Some(all) => word = *all,
            None => word[..from.len()].copy_from_slice(from),
        }
        let shifted = (u128::from_le_bytes(word) >> (at % 8)) as u64;
        match self.bits {
            64 => shifted,
            bits => shifted & ((1 << bits) - 1),
        }
    }

    /// Decodes numbers; whole numbers are scaled unless `unscaled`.
    fn numbers_into(&self, unscaled: bool, out: &mut [f64]) {
        match self.kind {
            Kind::Single => {
                for (ahead, to) in out.iter_mut().enumerate() {
                    *to = f32::from_bits(self.raw(ahead) as u32).into();
                }
            }
            Kind::Double => {
                for (ahead, to) in out.iter_mut().enumerate() {
                    *to = f64::from_bits(self.raw(ahead));
                }
            }
            Kind::Integer {
                lowest,
                scale,
                offset,
                ..
            } => {
                let (scale, offset) = match unscaled {
                    true => (1.0, 0.0),
                    false => (scale, offset),
                };
                for (ahead, to) in out.iter_mut().enumerate() {
                    let bits = match self.bits {
                        0 => 0,
                        _ => self.raw(ahead),
                    };
                    let whole = lowest.wrapping_add_unsigned(bits);
                    *to = whole as f64 * scale + offset;
                }
            }
        }
    }
}

/// A part of the records that is decoded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decoded {
    /// Number of the part.
    pub(super) field: usize,
    /// Whole numbers stay whole.
    pub(super) unscaled: bool,
}

/// The records of a scan, from the first to the last.
pub(super) struct Records<'a> {
    input: &'a Input,
    pages: Pages<'a>,
    /// Offset in the content of the next packet, and of the end of all.
    next: u64,
    end: u64,
    streams: Vec<Stream>,
    left: u64,
    packet: Vec<u8>,
}

impl<'a> Records<'a> {
    /// The records of a scan whose section ends before the byte `end` of the file.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] if there is no section.
    pub(super) fn new(input: &'a Input, scan: &Scan, end: u64) -> Result<Self> {
        let mut pages = Pages::new(input, scan.section);
        let mut head = [0; SECTION];
        pages.fill(&mut head, "section of a scan")?;
        let (id, data) = (head[0], u64_at(&head, 16));
        let inside = scan.section..end;
        if id != 1 || !inside.contains(&data) {
            return Err(input.error(
                format!("section of a scan at byte {}", scan.section),
                format!("type {id}, points from byte {data} on"),
                format!(
                    "type 1, and points between bytes {} and {end}",
                    scan.section
                ),
            ));
        }
        let stream = |kind: Kind| Stream {
            kind,
            bits: kind.bits(),
            bytes: Vec::new(),
            done: 0,
        };
        Ok(Self {
            input,
            pages,
            next: content_offset(data),
            end: content_offset(end),
            streams: scan.fields.iter().map(|f| stream(f.kind)).collect(),
            left: scan.points,
            packet: vec![0; PACKET],
        })
    }

    /// Decodes some records, at most [`BLOCK`]: the numbers of each of `parts`. Returns how many, 0 at the end.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Input`] if the file is damaged; [`outcrop_disk::error::Error::Io`].
    pub(super) fn next(&mut self, parts: &[Decoded], out: &mut [Vec<f64>]) -> Result<usize> {
        let most = BLOCK.min(usize::try_from(self.left).unwrap_or(BLOCK));
        if most == 0 {
            return Ok(0);
        }
        let count = loop {
            let here = self.streams.iter().map(Stream::numbers).min();
            match here.unwrap_or(most).min(most) {
                0 => self.packet()?,
                count => break count,
            }
        };
        for (part, out) in parts.iter().zip(out) {
            out.resize(count, 0.0);
            self.streams[part.field].numbers_into(part.unscaled, out);
        }
        for stream in &mut self.streams {
            stream.done += count * stream.bits as usize;
        }
        self.left -= count as u64;
        Ok(count)
    }

    /// Reads the next packet.
    fn packet(&mut self) -> Result<()> {
        self.pages.seek(self.next);
        let place = format!("packet at byte {}", self.pages.position());
        let wrong = |found: String, expected: &str| Err(self.input.error(&place, found, expected));
        let waiting: usize = self
            .streams
            .iter()
            .map(|s| s.bytes.len() - s.done / 8)
            .sum();
        if waiting > WAITING {
            let found = format!("{waiting} bytes of parts of records without the others");
            return wrong(found, &format!("at most {WAITING}"));
        }
        if self.next + 4 > self.end {
            let found = "the end of the section".to_owned();
            return wrong(found, &format!("{} more records", self.left));
        }
        self.pages.fill(&mut self.packet[..4], "packet")?;
        let (kind, bytes) = (self.packet[0], usize::from(u16_at(&self.packet, 2)) + 1);
        if kind > 2 || bytes < 4 {
            let found = format!("a packet of type {kind} and {bytes} bytes");
            return wrong(found, "type 0, 1 or 2, and a multiple of 4 bytes");
        }
        self.next += bytes as u64;
        // Indices, and what is to be passed over.
        if kind != 1 {
            return Ok(());
        }
        self.pages.fill(&mut self.packet[4..bytes], "packet")?;
        let count = if bytes < 6 {
            0
        } else {
            usize::from(u16_at(&self.packet, 4))
        };
        if count != self.streams.len() {
            let found = format!("{count} streams");
            return wrong(found, &format!("{}, one for each part", self.streams.len()));
        }
        let mut at = 6 + 2 * count;
        for (number, stream) in self.streams.iter_mut().enumerate() {
            let length = self.packet[..bytes].get(6 + 2 * number..8 + 2 * number);
            let length = length.map_or(bytes, |length| usize::from(u16_at(length, 0)));
            let Some(more) = self.packet[..bytes].get(at..at + length) else {
                let found = format!("a stream of {length} bytes in a packet of {bytes}");
                return wrong(found, "streams that fit");
            };
            if stream.bits > 0 {
                stream.append(more);
            }
            at += length;
        }
        Ok(())
    }
}
