//! Numbers in the buffer of a file.

use super::super::Mesh;
use super::document::{Compressed, Document, Primitive, View};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::Reservation;
use std::ops::Range;

/// Elements that are read at a time.
pub(super) const SLICE: usize = 1 << 14;

/// A list of numbers, or of groups of `parts` numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct List {
    view: usize,
    /// Byte of the first element in the view.
    offset: u64,
    /// Bytes from one element to the next.
    stride: u64,
    /// The number that glTF gives to the type.
    component: u32,
    normalized: bool,
    /// Numbers of an element.
    pub parts: usize,
    /// Number of elements.
    pub count: usize,
}

/// Reads elements.
pub(super) struct Reader<'a> {
    mesh: &'a Mesh<'a>,
    document: &'a Document,
    /// The buffer in the file.
    buffer: Range<u64>,
    /// The compressed view that was read last, with its number.
    plain: Option<(usize, Vec<u8>, Reservation)>,
}

/// Bytes of a number of a type.
fn bytes_of(component: u32) -> Option<u64> {
    match component {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

/// A number of a type. One of integers that stand for parts of 1 is divided by the largest.
fn number(component: u32, normalized: bool, b: &[u8]) -> f64 {
    let (value, most) = match component {
        5120 => (f64::from(b[0] as i8), 127.0),
        5121 => (f64::from(b[0]), 255.0),
        5122 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32_767.0),
        5123 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65_535.0),
        5125 => {
            let value = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            (f64::from(value), f64::from(u32::MAX))
        }
        _ => return f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
    };
    match normalized {
        true => (value / most).max(-1.0),
        false => value,
    }
}

impl<'a> Reader<'a> {
    pub fn new(mesh: &'a Mesh<'a>, document: &'a Document, buffer: Range<u64>) -> Self {
        Self {
            mesh,
            document,
            buffer,
            plain: None,
        }
    }

    fn wrong(&self, place: String, found: impl Into<String>, expected: &str) -> Error {
        self.mesh.error(place, found, expected)
    }

    pub fn no_number(&self, vertex: usize, place: [f64; 3]) -> Error {
        let found = format!("the position {place:?}");
        self.wrong(format!("vertex {vertex}"), found, "finite coordinates")
    }

    /// The positions of a primitive.
    pub fn positions(&self, primitive: &Primitive) -> Result<List> {
        let Some(number) = primitive.attributes.get("POSITION") else {
            return Err(self.wrong("primitive".into(), "no POSITION", "positions"));
        };
        self.list(*number, &["VEC3"])
    }

    /// The colours of a primitive of `count` vertices, if it has any.
    pub fn colours(&self, primitive: &Primitive, count: usize) -> Result<Option<List>> {
        let Some(number) = primitive.attributes.get("COLOR_0") else {
            return Ok(None);
        };
        let list = self.list(*number, &["VEC3", "VEC4"])?;
        if list.count != count {
            let found = format!("{} colours of {count} vertices", list.count);
            return Err(self.wrong(format!("accessor {number}"), found, "as many"));
        }
        Ok(Some(list))
    }

    /// The indices of a primitive, if it has any.
    pub fn indices(&self, primitive: &Primitive) -> Result<Option<List>> {
        let list = |number| self.list(number, &["SCALAR"]);
        primitive.indices.map(list).transpose()
    }

    /// The accessor `number`, of one of these shapes.
    fn list(&self, number: usize, shapes: &[&str]) -> Result<List> {
        let place = || format!("accessor {number}");
        let Some(accessor) = self.document.accessors.get(number) else {
            return Err(self.wrong(place(), "none", "an accessor of the document"));
        };
        if !shapes.contains(&&*accessor.shape) {
            return Err(self.wrong(place(), accessor.shape.clone(), &shapes.join(" or ")));
        }
        if accessor.sparse.is_some() {
            return Err(self.wrong(place(), "a sparse one", "one that is not sparse"));
        }
        let parts = match &*accessor.shape {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let component = accessor.component_type;
        let Some(bytes) = bytes_of(component) else {
            return Err(self.wrong(place(), format!("type {component}"), "a type of glTF"));
        };
        let view = accessor.buffer_view;
        let found = view.and_then(|view| Some((view, self.document.buffer_views.get(view)?)));
        let Some((view, of)) = found else {
            return Err(self.wrong(place(), "no buffer view", "one of the document"));
        };
        let element = bytes * parts;
        let stride = of.byte_stride.unwrap_or(element).max(1);
        let count = accessor.count;
        let fits = || {
            let last = stride.checked_mul(count.checked_sub(1)?)?;
            let end = accessor.byte_offset.checked_add(last)?;
            end.checked_add(element)
                .filter(|end| *end <= of.byte_length)
        };
        if count > 0 && fits().is_none() {
            let found = format!("{count} elements every {stride} bytes");
            let expected = format!("at most the {} bytes of its view", of.byte_length);
            return Err(self.wrong(place(), found, &expected));
        }
        Ok(List {
            view,
            offset: accessor.byte_offset,
            stride,
            component,
            normalized: accessor.normalized,
            parts: parts as usize,
            count: count as usize,
        })
    }

    /// Reads a range of elements, at most [`SLICE`], number by number.
    pub fn read(&mut self, list: &List, range: Range<usize>, numbers: &mut Vec<f64>) -> Result<()> {
        numbers.clear();
        if range.is_empty() {
            return Ok(());
        }
        let one = bytes_of(list.component).unwrap_or(1);
        let element = one * list.parts as u64;
        let begin = list.offset + list.stride * range.start as u64;
        let mut take = |bytes: &[u8]| {
            let number = |part: &[u8]| number(list.component, list.normalized, part);
            numbers.extend(
                bytes[..element as usize]
                    .chunks_exact(one as usize)
                    .map(number),
            );
        };
        // Elements far apart are read one by one.
        if list.stride > 1 << 12 {
            let mut bytes = vec![0; element as usize];
            for index in 0..range.len() as u64 {
                self.bytes(list.view, begin + index * list.stride, &mut bytes)?;
                take(&bytes);
            }
            return Ok(());
        }
        let mut bytes = vec![0; (list.stride * (range.len() as u64 - 1) + element) as usize];
        self.bytes(list.view, begin, &mut bytes)?;
        bytes.chunks(list.stride as usize).for_each(take);
        Ok(())
    }

    /// Fills `bytes` from byte `offset` of a view.
    fn bytes(&mut self, view: usize, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let of = &self.document.buffer_views[view];
        if let Some(compressed) = &of.extensions.compressed {
            if self
                .plain
                .as_ref()
                .is_none_or(|(number, ..)| *number != view)
            {
                self.plain = None;
                self.plain = Some(self.decoded(view, of, compressed)?);
            }
            let plain = self.plain.as_ref().map_or(&[][..], |(_, plain, _)| plain);
            let part = plain.get(offset as usize..offset as usize + bytes.len());
            let Some(part) = part else {
                let found = format!("{} bytes", plain.len());
                return Err(self.wrong(format!("buffer view {view}"), found, "all elements"));
            };
            bytes.copy_from_slice(part);
            return Ok(());
        }
        let begin = self.range(view, (of.buffer, of.byte_offset), of.byte_length)?;
        self.mesh.read_at(begin + offset, bytes)
    }

    /// The byte of the file at which a part of the buffer begins.
    fn range(&self, view: usize, (buffer, offset): (usize, u64), length: u64) -> Result<u64> {
        let uri = |buffer: usize| self.document.buffers.get(buffer)?.uri.as_ref();
        if buffer != 0 || uri(buffer).is_some() {
            let found = "a buffer outside the file";
            return Err(self.wrong(format!("buffer view {view}"), found, "that of the file"));
        }
        let all = self.buffer.end - self.buffer.start;
        match offset.checked_add(length) {
            Some(end) if end <= all => Ok(self.buffer.start + offset),
            _ => {
                let found = format!("{length} bytes from byte {offset}");
                let expected = format!("a part of {all} bytes");
                Err(self.wrong(format!("buffer view {view}"), found, &expected))
            }
        }
    }

    fn decoded(
        &self,
        view: usize,
        of: &View,
        compressed: &Compressed,
    ) -> Result<(usize, Vec<u8>, Reservation)> {
        let at = (compressed.buffer, compressed.byte_offset);
        let begin = self.range(view, at, compressed.byte_length)?;
        let plain = compressed.count.checked_mul(compressed.byte_stride);
        let place = || format!("buffer view {view}");
        let Some(plain) = plain.filter(|plain| *plain == of.byte_length) else {
            let found = format!("{} bytes", of.byte_length);
            return Err(self.wrong(place(), found, "as many as are compressed"));
        };
        let held = plain.saturating_add(compressed.byte_length);
        let held = self.mesh.workspace.reserve("mesh: compressed part", held)?;
        let mut packed = vec![0; compressed.byte_length as usize];
        self.mesh.read_at(begin, &mut packed)?;
        let names = (&*compressed.mode, compressed.filter.as_deref());
        let size = (compressed.count as usize, compressed.byte_stride as usize);
        let plain = crate::meshopt::decode(names, size, &packed)
            .map_err(|found| self.wrong(place(), found, "EXT_meshopt_compression"))?;
        Ok((view, plain, held))
    }
}
