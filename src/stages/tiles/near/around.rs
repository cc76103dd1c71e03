//! The nearest neighbours of many points together with each point itself, in order of id. Nothing is sorted.

use super::sums::{Unknown, divide_body, divided_body, padded};
use super::{OwnPage, Search, above};
use crate::ids::Id;
use crate::tiles::neighbors::Neighbors;
use crate::tiles::{Near, Tile};
use outcrop_geom::{Point, distance2};
use outcrop_paper::kernels::{BLOCK, Level, Pick, distances_body, kernel};

/// A point and its nearest neighbours, in order of id, in columns that end with zeros to whole groups of
/// eight.
#[derive(Debug, Clone, Default)]
pub struct Around {
    count: usize,
    /// Differences to the point.
    columns: [Vec<u32>; 3],
    ids: Vec<u32>,
    last2: u64,
}

/// Buffers of [`Around::keep_nearest`], reused from one point to the next.
#[derive(Debug, Default)]
pub struct Nearer {
    level: Level,
    /// Approximate squared distances of the neighbours, in steps.
    distances: Vec<f32>,
    /// Squared distance, in steps, and place of each neighbour.
    keys: Vec<(u64, usize)>,
}

impl Nearer {
    /// With the kernels of `level`; levels differ only in speed.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self {
            level,
            ..Self::default()
        }
    }
}

impl Around {
    /// Number of points, the one in the middle included.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Squared distance of the farthest.
    #[must_use]
    pub fn last2(&self) -> u64 {
        self.last2
    }

    /// The differences to the point in the middle, one axis after the other; whole groups of eight.
    #[must_use]
    pub fn columns(&self) -> [&[i32]; 3] {
        let whole = self.count.next_multiple_of(8);
        [0, 1, 2].map(|axis| bytemuck::cast_slice(&self.columns[axis][..whole]))
    }

    /// The ids, ascending.
    #[must_use]
    pub fn ids(&self) -> &[u32] {
        &self.ids[..self.count]
    }

    /// Takes the first `count` of `near`, or all if there are fewer, and the point itself with its id; without an
    /// id one more of them instead.
    pub fn set(&mut self, near: &Neighbors, count: usize, own: Option<Id>) {
        let count = count + usize::from(own.is_none());
        let mut all: Vec<_> = near.iter().take(count).collect();
        self.last2 = all.last().map_or(0, |near| near.distance2);
        all.extend(own.map(|id| Near {
            distance2: 0,
            id,
            difference: [0; 3],
        }));
        all.sort_unstable_by_key(|near| near.id);
        self.reserve(all.len());
        self.count = all.len();
        for (place, near) in all.into_iter().enumerate() {
            self.ids[place] = near.id.get();
            for (column, difference) in self.columns.iter_mut().zip(near.difference) {
                // Differences of coordinates in 0..2^30 fit 32 bits.
                column[place] = difference as i32 as u32;
            }
        }
        self.end();
    }

    /// Keeps the `count` that come first by distance, then by id, and the point itself, all without their ids.
    pub fn keep_nearest(&mut self, count: usize, memory: &mut Nearer) {
        if self.count <= count + 1 {
            return;
        }
        if !keep_divided(memory.level, self, count, &mut memory.distances) {
            self.keep_ranked(count, &mut memory.keys);
        }
        self.end();
    }

    /// Keeps them by exact distance, and by id where distances are equal.
    fn keep_ranked(&mut self, count: usize, keys: &mut Vec<(u64, usize)>) {
        keys.clear();
        keys.extend((0..self.count).map(|place| self.key(place)));
        // The point itself is one of them, or all are in its place.
        let (_, last, _) = keys.select_nth_unstable(count);
        let last = *last;
        let mut kept = 0;
        for place in 0..self.count {
            if self.key(place) <= last {
                for column in &mut self.columns {
                    column[kept] = column[place];
                }
                kept += 1;
            }
        }
        (self.count, self.last2) = (kept, last.0);
    }

    /// Squared distance and place of a point.
    fn key(&self, place: usize) -> (u64, usize) {
        let difference = self.columns.each_ref().map(|c| c[place] as i32);
        (distance2(difference, [0; 3]), place)
    }

    /// Makes room for `count` points and the rest of a block.
    fn reserve(&mut self, count: usize) {
        let room = count.next_multiple_of(8) + BLOCK;
        for column in self.columns.iter_mut().chain([&mut self.ids]) {
            column.resize(room.max(column.len()), 0);
        }
    }

    /// Fills the last group with zeros.
    fn end(&mut self) {
        let whole = self.count..self.count.next_multiple_of(8);
        for column in &mut self.columns {
            column[whole.clone()].fill(0);
        }
    }
}

impl Tile {
    /// Calls `each` with every point whose id is `wanted`, in order of id, and its `count` nearest neighbours, at most
    /// `most`; with `None` if the halo cannot certify these neighbours. A point that cannot be a neighbour has one more
    /// neighbour and is not among them. `each` may swap the neighbours for others.
    pub fn for_some_around(
        &self,
        (most, count): (usize, impl Fn(usize) -> usize),
        search: &mut Search,
        wanted: impl Fn(usize) -> bool,
        grown: impl FnMut(u64),
        mut each: impl FnMut(Id, Point, Option<&mut Around>),
    ) {
        let mut around = Around::default();
        self.for_groups(most, search, wanted, grown, |own, index, id, search| {
            let k = count(id.index());
            let known = search.with_last(k, |search| {
                self.around(own, index, id, k, search, &mut around)
            });
            let last2 = if known { around.last2() } else { 0 };
            each(id, self.points.get(index), known.then_some(&mut around));
            last2
        });
    }

    /// The `k` nearest neighbours of point `index`, and the point; false if the halo cannot certify them.
    fn around(
        &self,
        own: &OwnPage,
        index: usize,
        id: Id,
        k: usize,
        search: &mut Search,
        around: &mut Around,
    ) -> bool {
        let point = self.points.get(index);
        let mut found = take_nearest(search.level, search, point, k, around);
        if found == Err(Unknown::Few) && self.gather_for_one(own, index, k, search) {
            found = take_nearest(search.level, search, point, k, around);
        }
        match found {
            Ok(()) => true,
            Err(Unknown::Few) => false,
            Err(Unknown::Close) => {
                let among = self.is_chosen(index);
                let count = if among { k } else { k + 1 };
                let known = self.nearest(own, index, id, count, search).is_some();
                if known {
                    around.set(&search.near, k, among.then_some(id));
                }
                known
            }
        }
    }
}

kernel! {
    /// Measures the candidates from `point` and takes it and the `k` nearest.
    fn take_nearest(search: &mut Search, point: Point, k: usize, around: &mut Around) -> Result<(), Unknown> = take_body<Eight>
}

#[inline(always)]
fn take_body<P: Pick>(
    search: &mut Search,
    point: Point,
    k: usize,
    around: &mut Around,
) -> Result<(), Unknown> {
    let (room, limit) = divided_body::<P, true>(search, point, k)?;
    around.reserve(k + 1);
    let [from_x, from_y, from_z, from_ids] = search.picked.blocks(room);
    let distances = search.distances[..room].as_chunks::<BLOCK>().0;
    let [to_x, to_y, to_z] = &mut around.columns;
    let mut count = 0;
    let columns = from_x.iter().zip(from_y).zip(from_z).zip(from_ids);
    for ((((x, y), z), ids), distances) in columns.zip(distances) {
        let within = P::within(distances, limit);
        P::pack_at(ids, within, &mut around.ids, count);
        P::pack_at(x, within, to_x, count);
        P::pack_at(y, within, to_y, count);
        P::pack_at(z, within, to_z, count);
        count += within.count_ones() as usize;
    }
    around.count = count;
    let mut last2 = 0;
    let (to_x, to_y, to_z) = (&mut to_x[..count], &mut to_y[..count], &mut to_z[..count]);
    for ((x, y), z) in to_x.iter_mut().zip(to_y).zip(to_z) {
        *x = x.wrapping_sub(point[0] as u32);
        *y = y.wrapping_sub(point[1] as u32);
        *z = z.wrapping_sub(point[2] as u32);
        let difference = [*x, *y, *z].map(|c| c as i32);
        last2 = distance2(difference, [0; 3]).max(last2);
    }
    around.last2 = last2;
    around.end();
    Ok(())
}

kernel! {
    /// Keeps the point and its `count` nearest neighbours; false if ties or rounding do not let them be divided from
    /// the others.
    fn keep_divided(around: &mut Around, count: usize, distances: &mut Vec<f32>) -> bool = keep_body<Eight>
}

#[inline(always)]
fn keep_body<P: Pick>(around: &mut Around, count: usize, distances: &mut Vec<f32>) -> bool {
    let (all, most) = (around.count, above(around.last2));
    let room = all.next_multiple_of(BLOCK);
    let padded = padded(room);
    distances.resize(padded.max(distances.len()), 0.0);
    let distances = &mut distances[..padded];
    let columns = around.columns.each_ref();
    let [x, y, z] = columns.map(|column| bytemuck::cast_slice(&column[..all]));
    distances_body(x, y, z, [0; 3], &mut distances[..all]);
    distances[all..].fill(f32::INFINITY);
    let Some(limit) = divide_body::<P>(distances, all, count + 1, most) else {
        return false;
    };
    let mut kept = 0;
    let blocks = distances[..room].as_chunks::<BLOCK>().0;
    for (block, distances) in blocks.iter().enumerate() {
        let within = P::within(distances, limit);
        for column in &mut around.columns {
            // Packed values never overtake those that are read.
            if let Some(values) = column[block * BLOCK..].first_chunk().copied() {
                P::pack_at(&values, within, column, kept);
            }
        }
        kept += within.count_ones() as usize;
    }
    let farthest = (0..kept).map(|place| around.key(place).0).max();
    (around.count, around.last2) = (kept, farthest.unwrap_or(0));
    true
}
