//! The points of a surface in a box, and where a line meets its triangles, read from its pages.

use super::patch::{Axis, Patch, Point};
use super::surface::{Points, Surface, Vertex};
use crate::compare::pages::{Pages, Searcher};
use outcrop_disk::error::Result;
use outcrop_geom::vector::{Box3, V3};

/// Reads patches of a surface; keeps pages in memory for the next ones.
pub(super) enum Gatherer<'a> {
    Mesh {
        points: (&'a Pages<Vertex>, Searcher<Vertex>),
        triangles: (&'a Pages<[V3; 3]>, Searcher<[V3; 3]>),
    },
    Cloud(&'a Pages<V3>, Searcher<V3>),
}

impl<'a> Gatherer<'a> {
    /// Keeps at most `pages` pages of each kind.
    pub fn new(surface: &'a Surface<'a>, pages: usize) -> Self {
        match &surface.items {
            Points::Mesh(points, triangles) => Self::Mesh {
                points: (&**points, Searcher::new(pages)),
                triangles: (triangles, Searcher::new(pages)),
            },
            Points::Cloud(points) => Self::Cloud(points, Searcher::new(pages)),
        }
    }

    /// The distance of the nearest place of the surface; infinite if there is none.
    pub fn distance(&mut self, from: V3) -> Result<f64> {
        let found = match self {
            Self::Mesh { triangles, .. } => {
                let (pages, searcher) = triangles;
                pages.distances2(&[from], searcher)?
            }
            Self::Cloud(pages, searcher) => pages.distances2(&[from], searcher)?,
        };
        Ok(found.first().map_or(f64::INFINITY, |found| found.sqrt()))
    }

    /// Replaces `patch` by the points in the box, for cylinders of this radius.
    pub fn gather(&mut self, around: &Box3, radius: f64, patch: &mut Patch) -> Result<()> {
        patch.clear();
        match self {
            Self::Mesh { points, .. } => {
                let (pages, searcher) = points;
                pages.meeting(around, searcher, |vertex| {
                    let point = vertex.point();
                    if !vertex.is_copy() && point.weight > 0.0 {
                        patch.add(point);
                    }
                })?;
            }
            Self::Cloud(pages, searcher) => {
                pages.meeting(around, searcher, |position| {
                    patch.add(Point {
                        position: *position,
                        facing: [0.0; 3],
                        weight: 1.0,
                    });
                })?;
            }
        }
        patch.divide(radius);
        Ok(())
    }

    /// Where a line meets the triangles, nearest to its point and at most `far` from it; what is tilted more, by the
    /// cosine, does not count.
    pub fn hit(&mut self, axis: &Axis, far: f64, least: f64) -> Result<Option<f64>> {
        let Self::Mesh { triangles, .. } = self else {
            return Ok(None);
        };
        let (pages, searcher) = triangles;
        let mut nearest: Option<f64> = None;
        pages.meeting(&axis.around(0.0, far), searcher, |triangle| {
            let hit = axis.meeting(triangle, least);
            if let Some(t) = hit.filter(|t| t.abs() <= far) {
                let order = |n: &f64| t.abs().total_cmp(&n.abs()).then(t.total_cmp(n));
                if nearest.is_none_or(|n| order(&n).is_lt()) {
                    nearest = Some(t);
                }
            }
        })?;
        Ok(nearest)
    }
}
