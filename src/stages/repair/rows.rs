//! Rows that blocks leave for each other when components are judged.

use crate::spill::row;
use crate::stages::surface::star::Triangle;

row! {
    /// How a block sees a crossing triangle, for the block of its smallest vertex.
    pub struct SeenTriangle {
        /// Block of the smallest vertex.
        to: u32,
        /// Ids, ascending.
        triangle: Triangle,
        /// The block that sees it.
        block: u32,
        /// `label << 1 | flip`: the label that it has there, and whether it runs against its ids.
        label_flip: u32,
    }
    packed Above Above Rising Rising Above Above
}

impl SeenTriangle {
    /// The label that the triangle has in the block.
    pub fn label(&self) -> u32 {
        self.label_flip >> 1
    }

    /// True if it runs against its ascending ids.
    pub fn flip(&self) -> bool {
        self.label_flip & 1 == 1
    }
}

row! {
    /// Triangles in a row that have one label.
    pub struct LabelRun {
        /// Number of triangles.
        count: u32,
        /// The label.
        label: u32,
    }
    unpacked
}

row! {
    /// A bit for each of 32 vertices of a block: does it have a boundary edge?
    pub struct RimBits {
        /// The first vertex has the lowest bit.
        bits: u32,
    }
    unpacked
}
