//! The points that may be among the neighbours of a query, in columns.

use super::near::above;
use super::{LEAVES, OwnPage, Tile};
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::kernels::{
    BLOCK, Boxes, Level, Pick, box_distances, kernel, pick_body, pick_column, point_box_body,
};
use crate::workspace::memory::bytes_of;

/// x, y, z, and a number that goes with the point. The columns are whole blocks long, with
/// anything behind the last point.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns([Vec<u32>; 4]);

impl Columns {
    /// Makes room for `count` points, for what is behind them in the last block, and for a block.
    pub fn reserve(&mut self, count: usize) {
        let room = count.next_multiple_of(BLOCK) + BLOCK;
        if self.0[0].len() < room {
            self.0.iter_mut().for_each(|column| column.resize(room, 0));
        }
    }

    /// Bytes that they have room for.
    pub fn bytes(&self) -> u64 {
        self.0.iter().map(bytes_of).sum()
    }

    /// Coordinates of the first `count`.
    #[inline(always)]
    pub fn coordinates(&self, count: usize) -> [&[i32]; 3] {
        [0, 1, 2].map(|axis| bytemuck::cast_slice(&self.0[axis][..count]))
    }

    /// A point and its number.
    #[inline(always)]
    pub fn get(&self, place: usize) -> (Point, u32) {
        let at = [0, 1, 2].map(|axis| self.0[axis][place] as i32);
        (at, self.0[3][place])
    }

    /// The numbers of the first `count`.
    #[inline(always)]
    pub fn numbers(&self, count: usize) -> &[u32] {
        &self.0[3][..count]
    }

    #[inline(always)]
    pub fn slices(&self) -> [&[u32]; 4] {
        self.0.each_ref().map(Vec::as_slice)
    }

    #[inline(always)]
    pub fn slices_mut(&mut self) -> [&mut [u32]; 4] {
        self.0.each_mut().map(Vec::as_mut_slice)
    }

    /// Writes points from place `start` on, numbered from `first`.
    #[inline(always)]
    fn write(&mut self, start: usize, points: &[Point], first: u32) {
        let range = start..start + points.len();
        let [x, y, z, ids] = self.slices_mut().map(|column| &mut column[range.clone()]);
        for (n, point) in points.iter().enumerate() {
            // Coordinates are in 0..2^30.
            (x[n], y[n], z[n]) = (point[0] as u32, point[1] as u32, point[2] as u32);
            ids[n] = first + n as u32;
        }
    }
}

/// All points within a squared distance of some box, and maybe others, in order of id.
#[derive(Debug, Clone, Default)]
pub(super) struct Candidates {
    /// Numbered by id.
    pub columns: Columns,
    /// How many there are.
    pub len: usize,
    /// The squared distance.
    pub complete2: u64,
}

/// The leaves within reach of one page, in order of id.
#[derive(Debug, Default)]
pub(super) struct PageLeaves {
    boxes: Boxes,
    /// Of each its first point in the tile, how many there are, and the first id.
    leaves: Vec<(u32, u32, u32)>,
    /// 0, 1, 2 …
    places: Vec<u32>,
    near: Vec<u32>,
    distances: Vec<f32>,
    /// The points of the leaves that are near.
    points: Columns,
}

impl PageLeaves {
    /// Those within reach of `own`.
    pub fn set(&mut self, tile: &Tile, own: &OwnPage) {
        self.boxes.clear();
        self.leaves.clear();
        let around = &tile.page_boxes[own.local];
        for &local in &tile.near[own.near.clone()] {
            let local = local as usize;
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

    /// Bytes that its lists have room for.
    pub fn bytes(&self) -> u64 {
        let leaves = self.boxes.bytes() + bytes_of(&self.leaves) + bytes_of(&self.places);
        leaves + bytes_of(&self.near) + bytes_of(&self.distances) + self.points.bytes()
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
        let limit = above(d2);
        let near = self.near(level, around, limit);
        self.points.reserve(near * tile.leaf);
        let mut count = 0;
        for &leaf in &self.near[..near] {
            if !wanted(&self.bounds(leaf as usize)) {
                continue;
            }
            let (start, size, id) = self.leaves[leaf as usize];
            let points = &tile.points[start as usize..(start + size) as usize];
            self.points.write(count, points, id);
            count += size as usize;
        }
        out.columns.reserve(count);
        out.len = trim(
            level,
            &self.points,
            count,
            around,
            limit,
            &mut self.distances,
            out,
        );
        out.complete2 = d2;
    }

    /// Lists the leaves whose approximate squared distance to `around` is at most `limit`; how many.
    fn near(&mut self, level: Level, around: &Aabb, limit: f32) -> usize {
        let count = self.boxes.len();
        let room = count.next_multiple_of(BLOCK);
        self.places.extend(self.places.len() as u32..room as u32);
        self.near.resize((room + BLOCK).max(self.near.len()), 0);
        self.distances.resize(room.max(self.distances.len()), 0.0);
        let distances = &mut self.distances[..room];
        let Aabb { min, max } = *around;
        box_distances(level, &self.boxes, min, max, &mut distances[..count]);
        distances[count..].fill(f32::INFINITY);
        pick_column(level, distances, limit, &self.places, &mut self.near)
    }
}

kernel! {
    /// Takes over the first `count` points whose approximate squared distance to `around` is at most
    /// `limit`; how many.
    fn trim(
        points: &Columns,
        count: usize,
        around: &Aabb,
        limit: f32,
        distances: &mut Vec<f32>,
        out: &mut Candidates,
    ) -> usize = trim_body<Eight>
}

#[inline(always)]
fn trim_body<P: Pick>(
    points: &Columns,
    count: usize,
    around: &Aabb,
    limit: f32,
    distances: &mut Vec<f32>,
    out: &mut Candidates,
) -> usize {
    let room = count.next_multiple_of(BLOCK);
    distances.resize(room.max(distances.len()), 0.0);
    let distances = &mut distances[..room];
    point_box_body(points.coordinates(room), around.min, around.max, distances);
    distances[count..].fill(f32::INFINITY);
    pick_body::<P, 4>(distances, limit, points.slices(), out.columns.slices_mut())
}
