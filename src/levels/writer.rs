//! What tiles of both kinds, with every bit and lossy ones, are written with.

use super::lattice::Lattice;
use outcrop_codecs::glb::{INDEX, SHORT, View};
use outcrop_codecs::meshopt;
use serde_json::{Value, json};

/// The grids of a tileset.
#[derive(Debug, Clone)]
pub(super) struct Grids<'a> {
    pub lattice: &'a Lattice,
    /// By depth: the number of low bits of positions that tiles at this depth or below cannot show, because one of
    /// them is too large; it never grows with depth.
    pub low_bits: &'a [u32],
    /// True if positions were rounded, and attributes may be.
    pub lossy: bool,
}

/// Positions in a file.
pub(super) struct Placed {
    /// `POSITION`, and `_LOW` if it is needed.
    pub attributes: Value,
    /// The place of the tile.
    pub place: [u32; 3],
    /// A unit of `POSITION` is two to the power of this steps.
    pub bits: u32,
    pub moved: f64,
}

impl Grids<'_> {
    /// The number of low bits that a vertex does not show in a tile at `depth`: as many as in the largest tile with
    /// which it is shown beside this one, so that they agree.
    pub fn hidden(&self, depth: u32, vertex_depth: u8) -> u32 {
        let most = (self.low_bits.len() - 1) as u32;
        let depth = depth
            .min(u32::from(vertex_depth).saturating_add(1))
            .min(most);
        self.low_bits[depth as usize]
    }
}

/// The buffers of a file.
#[derive(Default)]
pub(super) struct Writer {
    /// Compressed.
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
    /// Bytes of all views when they are decoded.
    pub decoded: usize,
}

impl Writer {
    /// Adds a buffer view of compressed data; returns its number.
    fn view(&mut self, compressed: &[u8], view: &View<'_>) -> usize {
        self.align();
        self.decoded = self.decoded.next_multiple_of(4);
        let element = view.json(self.bytes.len() as u64, self.decoded as u64);
        self.views.push(element);
        self.decoded += view.plain();
        self.bytes.extend_from_slice(compressed);
        self.views.len() - 1
    }

    pub fn align(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    /// Adds vertex data of `stride` bytes each; returns the number of the accessor.
    pub fn attribute(
        &mut self,
        data: &[u8],
        stride: usize,
        filter: Option<&str>,
        mut accessor: Value,
    ) -> usize {
        let count = data.len() / stride;
        let packed = meshopt::vertices(data, stride);
        let view = View {
            stride,
            count,
            mode: ("ATTRIBUTES", filter),
            bytes: packed.len(),
        };
        let view = self.view(&packed, &view);
        accessor["bufferView"] = view.into();
        accessor["count"] = count.into();
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds indices of corners or ends, encoded so.
    pub fn indices(
        &mut self,
        (packed, mode): (Vec<u8>, &str),
        count: usize,
        vertices: usize,
    ) -> usize {
        let (stride, component) = match vertices < 1 << 16 {
            true => (2, SHORT),
            false => (4, INDEX),
        };
        let view = View {
            stride,
            count,
            mode: (mode, None),
            bytes: packed.len(),
        };
        let view = self.view(&packed, &view);
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": count, "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }
}
