//! The points that may be among the neighbours of a query, in columns.

use super::near::above;
use super::{LEAVES, OwnPage, Tile};
use crate::geom::aabb::Aabb;
use crate::kernels::{Boxes, Level, box_distances};

/// All points within a squared distance of some box, and others, in order of id.
#[derive(Debug, Clone, Default)]
pub(super) struct Candidates {
    pub x: Vec<i32>,
    pub y: Vec<i32>,
    pub z: Vec<i32>,
    pub ids: Vec<u32>,
    /// The squared distance.
    pub complete2: u64,
}

impl Candidates {
    /// The columns, x, y, z and ids, of one length for all.
    #[inline(always)]
    pub fn columns(&self) -> (&[i32], &[i32], &[i32], &[u32]) {
        let count = self.ids.len();
        (
            &self.x[..count],
            &self.y[..count],
            &self.z[..count],
            &self.ids,
        )
    }
}

/// The leaves within reach of one page, in order of id.
#[derive(Debug, Default)]
pub(super) struct PageLeaves {
    boxes: Boxes,
    /// Of each its first point in the tile, how many there are, and the first id.
    leaves: Vec<(u32, u32, u32)>,
    distances: Vec<f32>,
}

impl PageLeaves {
    /// Those within reach of `own`.
    pub fn set(&mut self, tile: &Tile, own: &OwnPage) {
        self.boxes.clear();
        self.leaves.clear();
        let around = &tile.page_boxes[own.local];
        for &local in &tile.near[own.near.clone()] {
            let range = tile.range(local);
            let boxes = &tile.leaf_boxes[local * LEAVES..];
            for (leaf, start) in range.clone().step_by(tile.leaf).enumerate() {
                if boxes[leaf].distance2_box(around) > own.reach2 {
                    continue;
                }
                self.boxes.push(boxes[leaf].min, boxes[leaf].max);
                let count = tile.leaf.min(range.end - start);
                let id = tile.id(local, start - range.start);
                self.leaves.push((start as u32, count as u32, id as u32));
            }
        }
    }

    #[inline]
    fn bounds(&self, leaf: usize) -> Aabb {
        let (min, max) = self.boxes.get(leaf);
        Aabb { min, max }
    }

    /// Collects the points of all `wanted` leaves within `d2` of `around`, a box inside the page, for
    /// `d2` up to the page's squared reach.
    pub fn gather(
        &mut self,
        level: Level,
        tile: &Tile,
        around: &Aabb,
        d2: u64,
        wanted: impl Fn(&Aabb) -> bool,
        out: &mut Candidates,
    ) {
        out.complete2 = d2;
        for column in [&mut out.x, &mut out.y, &mut out.z] {
            column.clear();
        }
        out.ids.clear();
        self.distances.resize(self.boxes.len(), 0.0);
        let Aabb { min, max } = *around;
        box_distances(level, &self.boxes, min, max, &mut self.distances);
        let limit = above(d2);
        let leaves = self.leaves.iter().zip(&self.distances);
        for (leaf, (&(start, count, id), distance2)) in leaves.enumerate() {
            if *distance2 > limit || !wanted(&self.bounds(leaf)) {
                continue;
            }
            let points = &tile.points[start as usize..(start + count) as usize];
            out.x.extend(points.iter().map(|p| p[0]));
            out.y.extend(points.iter().map(|p| p[1]));
            out.z.extend(points.iter().map(|p| p[2]));
            out.ids.extend(id..id + count);
        }
    }
}
