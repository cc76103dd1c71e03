//! The neighbours of one point in columns, nearest first.

use super::Near;
use crate::ids::Id;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_paper::clip::Nearest;
use outcrop_paper::kernels::{Level, MOST_SUMMED, SUMMED_LIMIT2, second_moments};
use outcrop_paper::plane::Moments;

/// Sums over the nearest neighbours of a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sums {
    /// Exact sums over their differences to the point.
    pub moments: Moments,
    /// Squared distance of the last neighbour.
    pub last2: u64,
}

/// Neighbours by (squared distance, id).
#[derive(Debug, Clone, Default)]
pub struct Neighbors {
    len: usize,
    /// The columns have room for at least `len` neighbours.
    distances2: Vec<u64>,
    ids: Vec<u32>,
    x: Vec<i32>,
    y: Vec<i32>,
    z: Vec<i32>,
}

/// The columns of [`Neighbors`] for writing, each as long as there are neighbours.
pub(super) struct Columns<'a> {
    pub distances2: &'a mut [u64],
    pub ids: &'a mut [u32],
    pub x: &'a mut [i32],
    pub y: &'a mut [i32],
    pub z: &'a mut [i32],
}

impl Columns<'_> {
    /// Writes the neighbour at place `to`.
    #[inline(always)]
    pub fn put(&mut self, to: usize, distance2: u64, id: u32, [x, y, z]: [i32; 3]) {
        self.distances2[to] = distance2;
        self.ids[to] = id;
        (self.x[to], self.y[to], self.z[to]) = (x, y, z);
    }
}

impl Neighbors {
    /// Allocated bytes of its columns.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let words = bytes_of(&self.ids) + bytes_of(&self.x) + bytes_of(&self.y) + bytes_of(&self.z);
        words + bytes_of(&self.distances2)
    }

    /// Number of neighbours.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there is no neighbour.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The neighbour at `index`, counted from the nearest, if it is known.
    #[must_use]
    #[inline]
    pub fn get(&self, index: usize) -> Option<Near> {
        let distance2 = *self.distances2[..self.len].get(index)?;
        Some(Near {
            distance2,
            id: Id::new(self.ids[index]),
            difference: [self.x[index], self.y[index], self.z[index]].map(i64::from),
        })
    }

    /// The columns.
    #[must_use]
    pub fn columns(&self) -> Nearest<'_> {
        Nearest {
            distances2: &self.distances2[..self.len],
            ids: &self.ids[..self.len],
            x: &self.x[..self.len],
            y: &self.y[..self.len],
            z: &self.z[..self.len],
        }
    }

    /// All neighbours, nearest first.
    pub fn iter(&self) -> impl Iterator<Item = Near> + '_ {
        (0..self.len()).filter_map(|index| self.get(index))
    }

    /// Removes all neighbours.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a neighbour that is not nearer than those before.
    pub fn push(&mut self, near: Near) {
        let last = self.len;
        // Differences of coordinates in 0..2^30 fit 32 bits.
        let difference = near.difference.map(|c| c as i32);
        self.resize(last + 1)
            .put(last, near.distance2, near.id.get(), difference);
    }

    /// Sets the number of neighbours to `len`; the caller writes the columns.
    pub(super) fn resize(&mut self, len: usize) -> Columns<'_> {
        if len > self.ids.len() {
            let room = len.next_multiple_of(64);
            self.distances2.resize(room, 0);
            self.ids.resize(room, 0);
            self.x.resize(room, 0);
            self.y.resize(room, 0);
            self.z.resize(room, 0);
        }
        self.len = len;
        Columns {
            distances2: &mut self.distances2[..len],
            ids: &mut self.ids[..len],
            x: &mut self.x[..len],
            y: &mut self.y[..len],
            z: &mut self.z[..len],
        }
    }

    /// [`Neighbors::moments`] of the first `count`, and the squared distance of the last of them.
    #[must_use]
    pub fn sums(&self, count: usize, level: Level) -> Sums {
        let last = self.get(count.wrapping_sub(1));
        Sums {
            moments: self.moments(count, level),
            last2: last.map_or(0, |near| near.distance2),
        }
    }

    /// Exact sums over the first `count` neighbours.
    #[must_use]
    pub fn moments(&self, count: usize, level: Level) -> Moments {
        let small = count <= MOST_SUMMED && self.distances2[..count].last() < Some(&SUMMED_LIMIT2);
        if small {
            let (sum, products) =
                second_moments(level, &self.x[..count], &self.y[..count], &self.z[..count]);
            return Moments::from_sums(count, sum, products);
        }
        let mut moments = Moments::default();
        self.iter()
            .take(count)
            .for_each(|near| moments.add(near.difference));
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn moments_are_exact_for_near_and_far(
            points in prop::collection::vec(prop::array::uniform3(-(1i64 << 29)..1 << 29), 0..40),
            shift in 0u32..29,
        ) {
            let mut points: Vec<_> = points.iter().map(|p| p.map(|c| c >> shift)).collect();
            let length2 = |p: &[i64; 3]| p.iter().map(|c| c * c).sum::<i64>() as u64;
            points.sort_by_key(length2);
            let mut neighbors = Neighbors::default();
            let mut exact = Moments::default();
            for (id, p) in points.iter().enumerate() {
                neighbors.push(Near { distance2: length2(p), id: Id::at(id), difference: *p });
                exact.add(*p);
            }
            prop_assert_eq!(neighbors.moments(points.len(), Level::best()), exact);
            prop_assert!(neighbors.iter().map(|n| n.difference).eq(points));
        }
    }
}
