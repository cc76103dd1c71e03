//! What all files of binary glTF (GLB) share: the header, numbers that glTF gives to types and uses, and the
//! JSON of a compressed part of the buffer.

use serde_json::{Value, json};

/// The number of 16-bit unsigned integers in glTF.
pub const SHORT: u32 = 5123;
/// The number of 32-bit unsigned integers.
pub const INDEX: u32 = 5125;
/// The number of 32-bit floats.
pub const FLOAT: u32 = 5126;

/// The number of a part of the buffer for vertices.
pub const FOR_VERTICES: u32 = 34962;
/// The number of one for indices.
pub const FOR_INDICES: u32 = 34963;

/// The name of the extension for compressed buffers.
pub const COMPRESSION: &str = "EXT_meshopt_compression";

/// A compressed part of the buffer.
pub struct View<'a> {
    /// Bytes of an element.
    pub stride: usize,
    /// Number of elements.
    pub count: usize,
    /// The mode of compression, and the filter.
    pub mode: (&'a str, Option<&'a str>),
    /// Compressed bytes.
    pub bytes: usize,
}

impl View<'_> {
    /// Bytes after reading.
    #[must_use]
    pub const fn plain(&self) -> usize {
        self.stride * self.count
    }

    /// Its JSON: it begins at byte `packed` of the compressed buffer, and at byte `plain` of the other one.
    #[must_use]
    pub fn json(&self, packed: u64, plain: u64) -> Value {
        let (mode, filter) = self.mode;
        let mut extension = json!({
            "buffer": 0, "byteOffset": packed, "byteLength": self.bytes, "byteStride": self.stride,
            "count": self.count, "mode": mode,
        });
        if let Some(filter) = filter {
            extension["filter"] = filter.into();
        }
        let target = match mode == "ATTRIBUTES" {
            true => FOR_VERTICES,
            false => FOR_INDICES,
        };
        let mut view = json!({
            "buffer": 1, "byteOffset": plain, "byteLength": self.plain(), "target": target,
            "extensions": { COMPRESSION: extension },
        });
        if target == FOR_VERTICES {
            view["byteStride"] = self.stride.into();
        }
        view
    }
}

/// All before the binary content, which has `binary` bytes.
#[must_use]
pub fn header(mut json: Vec<u8>, binary: u64) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |count: u64| u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes();
    let length = json.len() as u64;
    let all = 12 + 8 + length + 8 + binary;
    let parts: [&[u8]; 8] = [
        b"glTF",
        &2u32.to_le_bytes(),
        &word(all),
        &word(length),
        b"JSON",
        &json,
        &word(binary),
        b"BIN\0",
    ];
    parts.concat()
}
