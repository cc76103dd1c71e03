//! Rows exchanged between blocks to merge components.

use crate::surface::parity::Turned;
use crate::surface::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_stages::ids::{Block, Label};

row! {
    /// The label of a crossing triangle in one block, sent to the block of its smallest vertex.
    pub struct SeenTriangle {
        /// Block of the smallest vertex.
        to: Block,
        /// Ids, ascending.
        triangle: Triangle,
        /// The block of the label.
        block: Block,
        /// `label << 1 | flip`: its label in that block, and 1 if it is turned against its ascending ids
        /// there.
        label_flip: Turned<Label>,
    }
    packed Above Above Rising Rising Above Above
}

row! {
    /// A run of consecutive triangles with the same label.
    pub struct LabelRun {
        /// Number of triangles.
        count: u32,
        /// The label.
        label: Label,
    }
    unpacked
}

row! {
    /// One bit for each of 32 vertices of a block, set if the vertex has a boundary edge.
    pub struct RimBits {
        /// The lowest bit is that of the first vertex.
        bits: u32,
    }
    unpacked
}
