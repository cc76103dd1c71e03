//! Rows of the scratch files.

use outcrop_disk::spill::row;

row! {
    /// A word of the vertices, or of a node.
    pub struct LevelWord {
        /// The word.
        word: u32,
    }
    unpacked
}

row! {
    /// A triangle, sent to the block of its smallest vertex.
    pub struct BlockTriangle {
        /// The block.
        block: u32,
        /// Its corners, the smallest first.
        corners: [u32; 3],
    }
    packed Above Above Left Left
}

row! {
    /// A triangle with the key of its smallest vertex on the Z-order curve; rows sort by key.
    pub struct PlacedTriangle {
        /// The key.
        key: [u32; 2],
        /// Its corners, the smallest first.
        corners: [u32; 3],
    }
    unpacked
}

row! {
    /// A triangle of a cell.
    pub struct CellTriangle {
        /// Its corners, the smallest first.
        corners: [u32; 3],
    }
    packed Above Left Left
}

row! {
    /// A vertex of a cell, sent to its block.
    pub struct CellVertex {
        /// The block.
        block: u32,
        /// The vertex.
        vertex: u32,
        /// The cell.
        cell: u32,
    }
    packed Above Above Above
}

row! {
    /// A vertex that several cells have, sent to each of them.
    pub struct SharedVertex {
        /// The cell.
        cell: u32,
        /// The vertex.
        vertex: u32,
        /// Depth of the smallest node that has all of these cells; in the second byte the low bits of the position
        /// that are rounded away.
        depth: u32,
    }
    packed Above Above Above
}

row! {
    /// The part of a shared vertex's normal that comes from one cell, sent to the block of the vertex.
    pub struct PartNormal {
        /// The block.
        block: u32,
        /// The vertex.
        vertex: u32,
        /// The cell.
        cell: u32,
        /// The bits of three `f32`: the sum of the normals of its triangles, twice as long as their areas.
        sum: [u32; 3],
    }
    packed Above Above Above Above Above Above
}

row! {
    /// The normal of a shared vertex, sent to each of its cells.
    pub struct WholeNormal {
        /// The cell.
        cell: u32,
        /// The vertex.
        vertex: u32,
        /// The normal, octahedral, in two bytes.
        normal: u32,
    }
    packed Above Above Above
}

row! {
    /// An edge between shared vertices, sent to the block of its smaller end.
    pub struct CellEdge {
        /// The block.
        block: u32,
        /// The ends, the smaller first.
        ends: [u32; 2],
        /// The cell.
        cell: u32,
        /// Its triangles in the cell.
        triangles: u32,
    }
    packed Above Above Left Above Above
}

row! {
    /// An edge that several cells have, sent to each of them.
    pub struct SeamEdge {
        /// The cell.
        cell: u32,
        /// The ends, the smaller first.
        ends: [u32; 2],
    }
    packed Above Above Left
}

row! {
    /// A vertex that one cell keeps when its triangles are simplified, sent to the block of its old number.
    pub struct KeptVertex {
        /// The block.
        block: u32,
        /// Its old number.
        vertex: u32,
        /// The cell.
        cell: u32,
        /// Zero.
        unused: u32,
        /// Its position.
        position: [f64; 3],
        /// The part of its quadric that the cell knows (src/levels/single/quadric.rs).
        quadric: [f64; 11],
    }
    unpacked
}

row! {
    /// A value of such a vertex.
    pub struct KeptValue {
        /// The block.
        block: u32,
        /// The old number of the vertex.
        vertex: u32,
        /// The cell.
        cell: u32,
        /// The column.
        column: u32,
        /// The value.
        value: f64,
    }
    unpacked
}
