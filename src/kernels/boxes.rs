//! Which of many boxes come near another box.

use super::kernel;

/// Boxes in columns.
#[derive(Debug, Clone, Default)]
pub struct Boxes {
    min: [Vec<i32>; 3],
    max: [Vec<i32>; 3],
}

impl Boxes {
    /// Bytes that they have room for.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let room = self.min.iter().chain(&self.max).map(Vec::capacity);
        (room.sum::<usize>() * size_of::<i32>()) as u64
    }

    /// Forgets all boxes.
    pub fn clear(&mut self) {
        self.min.iter_mut().for_each(Vec::clear);
        self.max.iter_mut().for_each(Vec::clear);
    }

    /// Puts in the box from `min` to `max`, not empty, of coordinates in `0..2^30`.
    pub fn push(&mut self, min: [i32; 3], max: [i32; 3]) {
        for axis in 0..3 {
            self.min[axis].push(min[axis]);
            self.max[axis].push(max[axis]);
        }
    }

    /// Box number `index`, from its lowest corner to its highest.
    #[must_use]
    #[inline]
    pub fn get(&self, index: usize) -> ([i32; 3], [i32; 3]) {
        let corner = |columns: &[Vec<i32>; 3]| std::array::from_fn(|axis| columns[axis][index]);
        (corner(&self.min), corner(&self.max))
    }

    /// Number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.min[0].len()
    }

    /// True if there is no box.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min[0].is_empty()
    }
}

kernel! {
    /// Squared distances of `boxes` to the box from `min` to `max`, to a relative error below 2^-21.
    /// `out` is as long as there are boxes.
    pub fn box_distances(boxes: &Boxes, min: [i32; 3], max: [i32; 3], out: &mut [f32]) = box_distances_body
}

#[inline(always)]
fn box_distances_body(boxes: &Boxes, min: [i32; 3], max: [i32; 3], out: &mut [f32]) {
    let n = out.len();
    let ([x0, y0, z0], [x1, y1, z1]) = (&boxes.min, &boxes.max);
    let (x0, y0, z0) = (&x0[..n], &y0[..n], &z0[..n]);
    let (x1, y1, z1) = (&x1[..n], &y1[..n], &z1[..n]);
    let gap =
        |low: i32, high: i32, axis: usize| (low - max[axis]).max(min[axis] - high).max(0) as f32;
    for i in 0..n {
        let dx = gap(x0[i], x1[i], 0);
        let dy = gap(y0[i], y1[i], 1);
        let dz = gap(z0[i], z1[i], 2);
        out[i] = dx * dx + dy * dy + dz * dz;
    }
}

/// Squared distances of points in columns to the box from `min` to `max`, to a relative error
/// below 2^-21. Coordinates are in `0..2^30`; all slices are of one length.
#[inline(always)]
pub(crate) fn point_box_body(
    [x, y, z]: [&[i32]; 3],
    min: [i32; 3],
    max: [i32; 3],
    out: &mut [f32],
) {
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
    use crate::geom::aabb::Aabb;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_gives_the_same_bits(
            corners in prop::collection::vec(prop::array::uniform6(0i32..1 << 30), 1..70),
        ) {
            let all: Vec<Aabb> = corners.iter()
                .map(|c| Aabb::of(&[[c[0], c[1], c[2]], [c[3], c[4], c[5]]])).collect();
            let mut boxes = Boxes::default();
            all.iter().for_each(|b| boxes.push(b.min, b.max));
            let Aabb { min, max } = all[0];
            let mut expected = vec![0.0; all.len()];
            box_distances_body(&boxes, min, max, &mut expected);
            for level in Level::all() {
                let mut got = vec![0.0; all.len()];
                box_distances(level, &boxes, min, max, &mut got);
                for ((got, expected), b) in got.iter().zip(&expected).zip(&all) {
                    prop_assert_eq!(got.to_bits(), expected.to_bits());
                    let exact = b.distance2_box(&all[0]) as f64;
                    prop_assert!((f64::from(*got) - exact).abs() <= exact / f64::from(1 << 21));
                }
            }
        }
    }
}
