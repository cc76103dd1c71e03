//! The points that may be neighbours of a query, in columns.

use super::{LEAVES, OwnPage, Tile};
use crate::ids::Id;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_paper::kernels::{
    BLOCK, CoveredBoxes, Level, Pick, SearchBox, first_bits, kernel, near_boxes, point_box_body,
    take_boxes,
};

/// Upper bound on the relative error of approximate squared distances, with a margin.
pub(super) const APPROXIMATE: f64 = 1.0 / (1 << 20) as f64;

/// An upper bound on the approximate squared distances of all points within `d2`.
pub(super) fn above(d2: u64) -> f32 {
    (d2 as f64 * (1.0 + 2.0 * APPROXIMATE)) as f32
}

/// Columns of x, y, z and a number for each point. The columns consist of whole blocks; entries after the
/// last point are undefined.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns([Vec<u32>; 4]);

impl Columns {
    /// Reserves room for `count` points, the rest of their last block, and one more block.
    pub fn reserve(&mut self, count: usize) {
        let room = count.next_multiple_of(BLOCK) + BLOCK;
        if self.0[0].len() < room {
            self.0.iter_mut().for_each(|column| column.resize(room, 0));
        }
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        self.0.iter().map(bytes_of).sum()
    }

    /// Coordinates of the first `count` points.
    #[inline(always)]
    pub fn coordinates(&self, count: usize) -> [&[i32]; 3] {
        let [x, y, z, _] = &self.0;
        [
            bytemuck::cast_slice(&x[..count]),
            bytemuck::cast_slice(&y[..count]),
            bytemuck::cast_slice(&z[..count]),
        ]
    }

    /// Appends a point and its number.
    #[inline(always)]
    pub fn get(&self, place: usize) -> (Point, u32) {
        let [x, y, z, numbers] = &self.0;
        let at = [x[place] as i32, y[place] as i32, z[place] as i32];
        (at, numbers[place])
    }

    /// Numbers of the first `count` points.
    #[inline(always)]
    pub fn numbers(&self, count: usize) -> &[u32] {
        &self.0[3][..count]
    }

    /// The first `count` entries, a multiple of a block, as whole blocks.
    #[inline(always)]
    pub fn blocks(&self, count: usize) -> [&[[u32; BLOCK]]; 4] {
        let [x, y, z, numbers] = &self.0;
        [
            x[..count].as_chunks().0,
            y[..count].as_chunks().0,
            z[..count].as_chunks().0,
            numbers[..count].as_chunks().0,
        ]
    }

    #[inline(always)]
    pub fn slices(&self) -> [&[u32]; 4] {
        let [x, y, z, numbers] = &self.0;
        [x, y, z, numbers]
    }

    /// The columns as slices of one length, so that the compiler checks bounds once.
    #[inline(always)]
    pub fn slices_mut(&mut self) -> [&mut [u32]; 4] {
        let [x, y, z, numbers] = &mut self.0;
        let room = x.len().min(y.len()).min(z.len()).min(numbers.len());
        [
            &mut x[..room],
            &mut y[..room],
            &mut z[..room],
            &mut numbers[..room],
        ]
    }
}

/// All points within a squared distance of a box, and possibly others, in order of id.
#[derive(Debug, Clone, Default)]
pub(super) struct Candidates {
    /// The points, numbered by id.
    pub columns: Columns,
    /// Number of points.
    pub len: usize,
    /// The squared distance within which all points are included.
    pub complete2: u64,
}

/// The leaves within the reach of a page, in order of id.
#[derive(Debug, Default)]
pub(super) struct PageLeaves {
    /// The boxes of the leaves, with their numbers in the tile.
    boxes: CoveredBoxes,
    /// The pages, each with its number of leaves.
    pages: Vec<(u32, u32)>,
    near: Vec<u32>,
}

impl PageLeaves {
    /// Finds the leaves within the reach of `own`.
    pub fn set(&mut self, level: Level, tile: &Tile, own: &OwnPage) {
        let page = |local: &u32| {
            let leaves = tile.range(*local as usize).len().div_ceil(tile.leaf);
            (*local, leaves as u32)
        };
        self.pages.clear();
        self.pages
            .extend(tile.near[own.near.clone()].iter().map(page));
        let around = within(&tile.page_boxes[own.local], own.reach2);
        let (from, pages) = (&tile.leaf_boxes, &self.pages);
        self.boxes
            .set(|boxes| take_boxes(level, from, pages, around, boxes));
        self.near
            .resize((self.boxes.len() + BLOCK).max(self.near.len()), 0);
    }

    /// Allocated bytes of its lists.
    pub fn bytes(&self) -> u64 {
        self.boxes.bytes() + bytes_of(&self.pages) + bytes_of(&self.near)
    }

    /// Collects the points of all leaves within `d2` of `around`, a box inside the page; `d2` is at most the
    /// page's squared reach. If `wanted` is given, only its points.
    pub fn gather(
        &mut self,
        level: Level,
        tile: &Tile,
        around: &Aabb,
        d2: u64,
        wanted: Option<&dyn Fn(&Aabb) -> bool>,
        out: &mut Candidates,
    ) {
        let limit = within(around, d2);
        let mut count = near_boxes(level, &self.boxes, limit, &mut self.near);
        if let Some(wanted) = wanted {
            count = keep(&mut self.near[..count], |leaf| {
                let (min, max) = tile.leaf_boxes.get(leaf as usize);
                wanted(&Aabb { min, max })
            });
        }
        out.columns.reserve(count * tile.leaf);
        let leaves = &self.near[..count];
        out.len = pick_leaves(level, tile, leaves, limit, &mut out.columns);
        out.complete2 = d2;
    }
}

/// Moves the `wanted` numbers to the front; returns how many there are.
fn keep(numbers: &mut [u32], wanted: impl Fn(u32) -> bool) -> usize {
    let mut kept = 0;
    for place in 0..numbers.len() {
        if wanted(numbers[place]) {
            numbers[kept] = numbers[place];
            kept += 1;
        }
    }
    kept
}

/// The box `bounds` with a squared distance that includes all points within `d2`, and possibly others.
pub(super) fn within(bounds: &Aabb, d2: u64) -> SearchBox {
    SearchBox {
        min: bounds.min,
        max: bounds.max,
        limit: above(d2),
    }
}

kernel! {
    /// Copies the points of `leaves` that are within `around`; returns how many there are.
    fn pick_leaves(tile: &Tile, leaves: &[u32], around: SearchBox, out: &mut Columns) -> usize = pick_leaves_body<Eight>
}

#[inline(always)]
fn pick_leaves_body<P: Pick>(
    tile: &Tile,
    leaves: &[u32],
    around: SearchBox,
    out: &mut Columns,
) -> usize {
    let [to_x, to_y, to_z, to_ids] = out.slices_mut();
    let mut count = 0;
    for &leaf in leaves {
        let Some(range) = tile.leaf(leaf as usize) else {
            continue;
        };
        let local = leaf as usize / LEAVES;
        let first = Id::at(tile.id(local, range.start - tile.range(local).start)).get();
        for start in range.clone().step_by(BLOCK) {
            let Some(columns) = tile.points.block(start) else {
                break;
            };
            let mut distances = [0.0; BLOCK];
            let [x, y, z] = columns;
            point_box_body([x, y, z], around.min, around.max, &mut distances);
            let some = tile
                .chosen
                .as_ref()
                .map_or(u32::MAX, |chosen| chosen.block(start));
            let some = some & first_bits(range.end - start);
            let within = P::within(&distances, around.limit) & some;
            let mut ids = [first + (start - range.start) as u32; BLOCK];
            (0..).zip(&mut ids).for_each(|(n, id)| *id += n);
            P::pack_at(bytemuck::cast_ref(x), within, to_x, count);
            P::pack_at(bytemuck::cast_ref(y), within, to_y, count);
            P::pack_at(bytemuck::cast_ref(z), within, to_z, count);
            P::pack_at(&ids, within, to_ids, count);
            count += within.count_ones() as usize;
        }
    }
    count
}
