//! How far points moved: counts by length.

use outcrop_geom::{Point, distance2};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parts into which the squares of lengths between two powers of two are divided.
const PARTS: u64 = 64;

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq)]
pub struct RelaxStats {
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Noisy points, which moved.
    pub moved: u64,
    /// Half of them moved at most this far (to within 1 %), in the cloud's unit.
    pub median: f64,
    /// 99 % of them moved at most this far (to within 1 %).
    pub most: f64,
    /// The largest distance by which one moved.
    pub largest: f64,
}

/// Points that moved.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Moves {
    moved: u64,
    /// Number of points that have ended, by a number that grows with the length of their way.
    ended: BTreeMap<u64, u64>,
    /// The largest squared length.
    largest2: u64,
}

/// Points that moved, while they are counted: a place for each class up to the highest one.
#[derive(Debug, Default)]
pub(super) struct Counts {
    moved: u64,
    ended: Vec<u64>,
    largest2: u64,
}

impl Counts {
    /// Notes a point that moved. If it moves for the `last` time, its way is that between two positions.
    pub fn note(&mut self, last: bool, from: Point, to: Point) {
        self.moved += 1;
        if last {
            let length2 = distance2(from, to);
            self.largest2 = self.largest2.max(length2);
            // At most 3 776, since a squared length has at most 63 bits.
            let class = class(length2) as usize;
            if class >= self.ended.len() {
                self.ended.resize(class + 1, 0);
            }
            self.ended[class] += 1;
        }
    }

    /// All that were noted.
    pub fn moves(&self) -> Moves {
        let counts = (0..).zip(self.ended.iter().copied());
        Moves {
            moved: self.moved,
            ended: counts.filter(|(_, count)| *count > 0).collect(),
            largest2: self.largest2,
        }
    }
}

impl Moves {
    /// Adds the points of another part.
    pub fn add(&mut self, other: &Self) {
        self.moved += other.moved;
        self.largest2 = self.largest2.max(other.largest2);
        for (class, count) in &other.ended {
            *self.ended.entry(*class).or_default() += count;
        }
    }

    /// Number of points that moved, counted in each round.
    pub fn moved(&self) -> u64 {
        self.moved
    }

    /// The counts after a number of `rounds`, with lengths in units of which a step has `step`.
    pub fn stats(&self, rounds: u32, step: f64) -> RelaxStats {
        let moved = self.ended.values().sum();
        let within = |share: f64| {
            let wanted = (share * moved as f64).ceil() as u64;
            let mut count = 0;
            let reached = self.ended.iter().find(|(_, more)| {
                count += **more;
                count >= wanted
            });
            reached.map_or(0.0, |(class, _)| (least(*class) as f64).sqrt() * step)
        };
        RelaxStats {
            rounds,
            moved,
            median: within(0.5),
            most: within(0.99),
            largest: (self.largest2 as f64).sqrt() * step,
        }
    }
}

/// A number that grows with the squared length, in parts of a 64th.
fn class(length2: u64) -> u64 {
    if length2 < PARTS {
        return length2;
    }
    let shift = u64::from(length2.ilog2() - PARTS.ilog2());
    PARTS * shift + (length2 >> shift)
}

/// The least squared length of a class.
fn least(class: u64) -> u64 {
    if class < 2 * PARTS {
        return class;
    }
    let shift = class / PARTS - 1;
    (class - PARTS * shift) << shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn classes_are_ordered_and_narrow(a in 0u64..1 << 62, shift in 0u32..62) {
            let length2 = a >> shift;
            let low = least(class(length2));
            prop_assert!(low <= length2 && length2 - low <= length2 / PARTS);
            prop_assert!(class(length2) <= class(length2 + 1));
        }
    }

    #[test]
    fn lengths_are_those_of_the_last_moves() {
        let mut counts = Counts::default();
        counts.note(false, [0; 3], [0, 0, 90]);
        for length in 1..=100 {
            counts.note(true, [0; 3], [0, length, 0]);
        }
        let moves = counts.moves();
        let stats = moves.stats(2, 0.5);
        assert!((stats.median - 25.0).abs() < 0.5 && (stats.most - 49.5).abs() < 0.5);
        assert_eq!((stats.largest, stats.rounds), (50.0, 2));
        assert_eq!((moves.moved(), stats.moved), (101, 100));
    }
}
