//! The points that may be among the neighbours of a query, in columns.

use super::near::above;
use super::points::Points;
use super::{LEAVES, OwnPage, Tile};
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::kernels::{
    BLOCK, Boxes, Level, Pick, box_distances, first_bits, kernel, pick_column, point_box_body,
};

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

    /// Whole blocks of the first `count`, a multiple of a block.
    #[inline(always)]
    pub fn blocks(&self, count: usize) -> [&[[u32; BLOCK]]; 4] {
        self.0
            .each_ref()
            .map(|column| column[..count].as_chunks().0)
    }

    #[inline(always)]
    pub fn slices(&self) -> [&[u32]; 4] {
        self.0.each_ref().map(Vec::as_slice)
    }

    #[inline(always)]
    pub fn slices_mut(&mut self) -> [&mut [u32]; 4] {
        self.0.each_mut().map(Vec::as_mut_slice)
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

/// Points that lie together.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    /// The first in the tile.
    start: u32,
    len: u32,
    /// The first id.
    id: u32,
}

/// The leaves within reach of one page, in order of id.
#[derive(Debug, Default)]
pub(super) struct PageLeaves {
    boxes: Boxes,
    leaves: Vec<Leaf>,
    /// 0, 1, 2 …
    places: Vec<u32>,
    near: Vec<u32>,
    distances: Vec<f32>,
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
                self.leaves.push(Leaf {
                    start: start as u32,
                    len: tile.leaf.min(range.end - start) as u32,
                    id: tile.id(local, start - range.start) as u32,
                });
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
        let limit = above(d2);
        let count = self.near(level, around, limit);
        let mut kept = 0;
        for place in 0..count {
            let leaf = self.near[place];
            if wanted(&self.bounds(leaf as usize)) {
                self.near[kept] = leaf;
                kept += 1;
            }
        }
        out.columns.reserve(kept * tile.leaf);
        let leaves = (&self.leaves[..], &self.near[..kept]);
        out.len = pick_leaves(level, &tile.points, leaves, around, limit, &mut out.columns);
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
    /// Takes over the points of leaves, of all those that are listed second, whose approximate squared
    /// distance to `around` is at most `limit`; how many.
    fn pick_leaves(
        points: &Points,
        leaves: (&[Leaf], &[u32]),
        around: &Aabb,
        limit: f32,
        out: &mut Columns,
    ) -> usize = pick_leaves_body<Eight>
}

#[inline(always)]
fn pick_leaves_body<P: Pick>(
    points: &Points,
    (leaves, near): (&[Leaf], &[u32]),
    around: &Aabb,
    limit: f32,
    out: &mut Columns,
) -> usize {
    let mut to = out.slices_mut();
    let mut count = 0;
    for &leaf in near {
        let leaf = leaves[leaf as usize];
        for first in (0..leaf.len).step_by(BLOCK) {
            let Some(columns) = points.block((leaf.start + first) as usize) else {
                break;
            };
            let mut distances = [0.0; BLOCK];
            let [x, y, z] = columns.map(<[i32; BLOCK]>::as_slice);
            point_box_body([x, y, z], around.min, around.max, &mut distances);
            let within = P::within(&distances, limit) & first_bits((leaf.len - first) as usize);
            let mut ids = [leaf.id + first; BLOCK];
            (0..).zip(&mut ids).for_each(|(n, id)| *id += n);
            let [x, y, z] = columns.map(bytemuck::cast_ref);
            for (from, to) in [x, y, z, &ids].into_iter().zip(&mut to) {
                if let Some(to) = to[count..].first_chunk_mut() {
                    P::pack(from, within, to);
                }
            }
            count += within.count_ones() as usize;
        }
    }
    count
}
