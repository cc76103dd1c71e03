//! A mesh that is asked for its nearest place.

use crate::sample::V3;
use outcrop_cloudgen::Triangles;
use outcrop_ply::Mesh;
use rayon::prelude::*;

/// A mesh.
pub(crate) struct Shape(Triangles);

impl Shape {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        Shape(Triangles::new(&mesh.vertices, &mesh.triangles))
    }

    /// Distance of each place, and the normal of the nearest triangle; far and none if there is no triangle.
    pub(crate) fn nearest(
        &self,
        places: impl IndexedParallelIterator<Item = V3>,
    ) -> Vec<(f64, V3)> {
        let near = |place| match self.0.nearest(place) {
            Some(found) => (found.distance, found.normal),
            None => (f64::INFINITY, [0.0; 3]),
        };
        places.map(near).collect()
    }
}
