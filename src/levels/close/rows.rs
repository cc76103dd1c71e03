//! Rows of the scratch files.

use outcrop_disk::spill::row;

row! {
    /// An edge whose triangles run along it more often one way than the other.
    pub struct NetEdge {
        /// Its ends, the lower first.
        ends: [u32; 2],
        /// How much more often from the lower end to the higher: an `i32`.
        net: u32,
    }
    packed Above Left Above
}

row! {
    /// An edge of the boundary, the way its triangle runs.
    pub struct RimEdge {
        /// Its start.
        from: u32,
        /// Its end.
        to: u32,
    }
    packed Above Left
}

row! {
    /// A vertex of a boundary loop, in the order of the triangles that close it.
    pub struct LoopVertex {
        /// The loop.
        number: u32,
        /// The vertex.
        vertex: u32,
        /// 1 if several loops meet there.
        pinched: u32,
    }
    packed Above Above Above
}

row! {
    /// A triangle of the mesh that touches loops, sent to their batch.
    pub struct NearTriangle {
        /// The batch.
        batch: u32,
        /// Its corners.
        corners: [u32; 3],
        /// Their positions.
        positions: [[f64; 3]; 3],
    }
    unpacked
}

row! {
    /// A vertex of a patch.
    pub struct NewVertex {
        /// Bit k is set if parent k is a new vertex.
        mask: u32,
        /// The vertices whose values it has the mean of; of new ones the number in the batch.
        parents: [u32; 3],
        /// Its position.
        position: [f64; 3],
    }
    unpacked
}

row! {
    /// A triangle of a patch.
    pub struct PatchTriangle {
        /// The loop.
        number: u32,
        /// Bit k is set if corner k is a new vertex.
        mask: u32,
        /// Its corners; of new ones the number in the batch.
        corners: [u32; 3],
    }
    packed Above Above Above Above Above
}

row! {
    /// A triangle of a patch with the positions of its corners.
    pub struct PlacedPatch {
        /// The loop.
        number: u32,
        /// Zero.
        unused: u32,
        /// The positions.
        positions: [[f64; 3]; 3],
    }
    unpacked
}
