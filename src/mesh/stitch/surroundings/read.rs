//! What a turn reads of a block.

use super::super::interior::{TriangleIn, VertexAt};
use super::Change;
use crate::surface::rows::LabelledTo;
use outcrop_geom::Point;
use outcrop_stages::ids::{Id, Ids};

/// The triangles of a block at the requested vertices.
pub(super) struct Found {
    pub(super) interior: Vec<TriangleIn>,
    pub(super) crossing: Vec<LabelledTo>,
    pub(super) changes: Vec<Change>,
}

impl Found {
    pub(super) fn count(&self) -> usize {
        self.interior.len() + self.crossing.len() + self.changes.len()
    }
}

/// The positions that a block wrote.
pub(super) struct Positions {
    ids: Ids,
    /// Vertices, ascending.
    vertices: Vec<VertexAt>,
    /// Indices in `vertices` of the block's own vertices, which are the great majority.
    pub(super) places: Vec<u32>,
}

impl Positions {
    pub(super) fn new(ids: Ids, vertices: Vec<VertexAt>) -> Self {
        let mut places = vec![0u32; ids.len()];
        for (place, vertex) in (0..).zip(&vertices) {
            if ids.contains(&vertex.id) {
                places[ids.place(vertex.id)] = place;
            }
        }
        Self {
            ids,
            vertices,
            places,
        }
    }

    pub(super) fn at(&self, v: Id) -> Point {
        let place = if self.ids.contains(&v) {
            self.places[self.ids.place(v)] as usize
        } else {
            self.vertices.partition_point(|vertex| vertex.id < v)
        };
        self.vertices[place].position
    }
}
