//! Selection of the boxes near another box.

use super::kernel;
use super::pick::{BLOCK, Pick, first_bits};

/// Boxes in columns, each with a number. The columns are one block longer than there are boxes; the rest is
/// undefined.
#[derive(Debug, Clone, Default)]
pub struct Boxes {
    /// Lowest corners, highest corners, numbers.
    columns: [Vec<u32>; 7],
    len: usize,
}

impl Boxes {
    /// Removes all boxes.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Reserves room for `count` boxes in all.
    pub fn reserve(&mut self, count: usize) {
        let room = count.next_multiple_of(BLOCK) + BLOCK;
        if self.columns[0].len() < room {
            let grow = |column: &mut Vec<u32>| column.resize(room, 0);
            self.columns.iter_mut().for_each(grow);
        }
    }

    /// Appends the box from `min` to `max`, with coordinates in `0..2^30`.
    pub fn push(&mut self, min: [i32; 3], max: [i32; 3], number: u32) {
        if self.columns[0].len() <= self.len + BLOCK {
            self.reserve((self.len + 1).next_power_of_two());
        }
        let words = min.into_iter().chain(max).map(i32::cast_unsigned);
        for (column, word) in self.columns.iter_mut().zip(words.chain([number])) {
            column[self.len] = word;
        }
        self.len += 1;
    }

    /// Lowest and highest corner of the box at `index`.
    #[must_use]
    #[inline]
    pub fn get(&self, index: usize) -> ([i32; 3], [i32; 3]) {
        let [x0, y0, z0, x1, y1, z1, _] = &self.columns;
        let min = [x0[index] as i32, y0[index] as i32, z0[index] as i32];
        let max = [x1[index] as i32, y1[index] as i32, z1[index] as i32];
        (min, max)
    }

    /// Number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there is no box.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.columns.iter().map(|c| 4 * c.capacity() as u64).sum()
    }

    #[inline(always)]
    fn block(&self, start: usize) -> Option<[&[u32; BLOCK]; 7]> {
        let [a, b, c, d, e, f, numbers] = &self.columns;
        Some([
            a.get(start..)?.first_chunk()?,
            b.get(start..)?.first_chunk()?,
            c.get(start..)?.first_chunk()?,
            d.get(start..)?.first_chunk()?,
            e.get(start..)?.first_chunk()?,
            f.get(start..)?.first_chunk()?,
            numbers.get(start..)?.first_chunk()?,
        ])
    }
}

/// A box, and the largest squared distance to it. Squared distances between boxes are computed with a
/// relative error below 2^-21.
#[derive(Debug, Clone, Copy)]
pub struct SearchBox {
    /// Lowest corner.
    pub min: [i32; 3],
    /// Highest corner.
    pub max: [i32; 3],
    /// Squared distance.
    pub limit: f32,
}

/// Boxes with a box around each block of 16 of them, to be searched.
#[derive(Debug, Clone, Default)]
pub struct CoveredBoxes {
    boxes: Boxes,
    covers: Boxes,
}

impl CoveredBoxes {
    /// Replaces all boxes by those that `fill` appends.
    pub fn set(&mut self, fill: impl FnOnce(&mut Boxes)) {
        let Self { boxes, covers } = self;
        boxes.clear();
        fill(boxes);
        covers.clear();
        for start in (0..boxes.len).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(boxes.len);
            let column = |axis: usize| boxes.columns[axis][block.clone()].iter().map(|c| *c as i32);
            let min = [0, 1, 2].map(|axis| column(axis).min().unwrap_or(0));
            let max = [3, 4, 5].map(|axis| column(axis).max().unwrap_or(0));
            covers.push(min, max, (start / BLOCK) as u32);
        }
    }

    /// Number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.boxes.len
    }

    /// True if there is no box.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.boxes.bytes() + self.covers.bytes()
    }
}

/// Writes the numbers of the boxes of a block that are within the limit to place `at`; returns how many there
/// are.
#[inline(always)]
fn put_near<P: Pick>(
    boxes: &Boxes,
    start: usize,
    around: SearchBox,
    to: &mut [u32],
    at: usize,
) -> usize {
    let Some(block) = boxes.block(start) else {
        return 0;
    };
    let within = within_body::<P>(block, around) & first_bits(boxes.len - start);
    P::pack_at(block[6], within, to, at);
    within.count_ones() as usize
}

kernel! {
    /// Writes the numbers of the `boxes` within the limit, in their order, to the front of `to`, and returns
    /// how many there are. `to` must be one block longer than there are boxes.
    pub fn near_boxes(boxes: &CoveredBoxes, around: SearchBox, to: &mut [u32]) -> usize = near_body<Eight>
}

#[inline(always)]
fn near_body<P: Pick>(boxes: &CoveredBoxes, around: SearchBox, to: &mut [u32]) -> usize {
    let CoveredBoxes { boxes, covers } = boxes;
    let mut count = 0;
    for first in (0..covers.len).step_by(BLOCK) {
        let Some(block) = covers.block(first) else {
            break;
        };
        // Rounding keeps order, so a cover is never farther than a box in it.
        let mut near = within_body::<P>(block, around) & first_bits(covers.len - first);
        while near != 0 {
            let start = (first + near.trailing_zeros() as usize) * BLOCK;
            count += put_near::<P>(boxes, start, around, to, count);
            near &= near - 1;
        }
    }
    count
}

kernel! {
    /// Copies the boxes within the limit out of `blocks`: each a block of 16 boxes and the number of them to
    /// test.
    pub fn take_boxes(from: &Boxes, blocks: &[(u32, u32)], around: SearchBox, to: &mut Boxes) = take_body<Eight>
}

#[inline(always)]
fn take_body<P: Pick>(from: &Boxes, blocks: &[(u32, u32)], around: SearchBox, to: &mut Boxes) {
    to.reserve(to.len + blocks.len() * BLOCK);
    for &(number, meant) in blocks {
        let Some(block) = from.block(number as usize * BLOCK) else {
            break;
        };
        let within = within_body::<P>(block, around) & first_bits(meant as usize);
        if within == 0 {
            continue;
        }
        for (from, to_column) in block.iter().zip(&mut to.columns) {
            P::pack_at(from, within, to_column, to.len);
        }
        to.len += within.count_ones() as usize;
    }
}

#[inline(always)]
fn within_body<P: Pick>(block: [&[u32; BLOCK]; 7], around: SearchBox) -> u32 {
    let [x0, y0, z0, x1, y1, z1, _] = block;
    let gap = |low: u32, high: u32, axis: usize| {
        let below = (low as i32).wrapping_sub(around.max[axis]);
        let above = around.min[axis].wrapping_sub(high as i32);
        below.max(above).max(0) as f32
    };
    let mut distances = [0.0; BLOCK];
    for (i, out) in distances.iter_mut().enumerate() {
        let dx = gap(x0[i], x1[i], 0);
        let dy = gap(y0[i], y1[i], 1);
        let dz = gap(z0[i], z1[i], 2);
        *out = dx * dx + dy * dy + dz * dz;
    }
    P::within(&distances, around.limit)
}

/// Squared distances of points in columns to the box from `min` to `max`, with a relative error below 2^-21.
/// Coordinates are in `0..2^30`; all slices have the same length.
#[inline(always)]
pub fn point_box_body([x, y, z]: [&[i32]; 3], min: [i32; 3], max: [i32; 3], out: &mut [f32]) {
    let gap = |c: i32, axis: usize| (c - max[axis]).max(min[axis] - c).max(0) as f32;
    for (((x, y), z), out) in x.iter().zip(y).zip(z).zip(out) {
        let dx = gap(*x, 0);
        let dy = gap(*y, 1);
        let dz = gap(*z, 2);
        *out = dx * dx + dy * dy + dz * dz;
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use outcrop_geom::aabb::Aabb;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn those_near_are_found_at_every_level(
            corners in prop::collection::vec(prop::array::uniform6(0i32..1 << 30), 1..600),
            share in 0.0f64..1.1,
        ) {
            let all: Vec<Aabb> = corners.iter()
                .map(|c| Aabb::of(&[[c[0], c[1], c[2]], [c[3], c[4], c[5]]])).collect();
            let mut boxes = Boxes::default();
            (100..).zip(&all).for_each(|(number, b)| boxes.push(b.min, b.max, number));
            let Aabb { min, max } = all[0];
            let exact = |b: &Aabb| b.distance2_box(&all[0]) as f64;
            let limit = (share * all.iter().map(exact).fold(0.0, f64::max)) as f32;
            let around = SearchBox { min, max, limit };
            let blocks: Vec<(u32, u32)> = (0..all.len() as u32).step_by(BLOCK)
                .map(|start| (start / BLOCK as u32, all.len() as u32 - start)).collect();
            let error = f64::from(limit) / f64::from(1 << 21);
            for level in Level::all() {
                let mut covered = CoveredBoxes::default();
                covered.set(|to| to.clone_from(&boxes));
                let mut numbers = vec![0; all.len() + BLOCK];
                let count = near_boxes(level, &covered, around, &mut numbers);
                let numbers = &numbers[..count];
                prop_assert!(numbers.is_sorted());
                for (number, b) in (100..).zip(&all) {
                    let off = exact(b) - f64::from(limit);
                    let near = numbers.contains(&number);
                    prop_assert!(off.abs() <= error || near == (off < 0.0));
                }
                let mut taken = Boxes::default();
                take_boxes(level, &boxes, &blocks, around, &mut taken);
                let taken: Vec<_> = (0..taken.len())
                    .map(|i| (taken.get(i), taken.columns[6][i])).collect();
                let expected: Vec<_> = numbers.iter()
                    .map(|&n| (boxes.get(n as usize - 100), n)).collect();
                prop_assert_eq!(taken, expected);
            }
        }
    }
}
