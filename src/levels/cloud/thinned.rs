//! An even part of the points of a cloud: of bounded size, in one pass over points in any order.
//!
//! The Hilbert curve halves space again and again, so the points whose keys have the same first bits are those in one
//! box, whose longest side is at most twice the shortest. Of each box one point stays. The boxes are as small as the
//! bound allows: there is the same number of bits for all, the largest with which at most so many boxes have points.
//! Therefore more than half of the bound is used, if the cloud has so many points. Which point of a box stays is decided
//! by its position alone, by a scrambled one, so that no pattern of the boxes is seen.

use outcrop_geom::Point;
use outcrop_geom::hilbert::{decode, encode};

/// Bits of the colour, below the 90 of the position.
const COLOR: u32 = 24;

/// Bits of a word of a key of the curve.
const WORD: u32 = 30;

/// A point: its key on the curve, then red, green and blue.
type Entry = u128;

/// The part of the points seen so far.
pub(super) struct Thinned {
    most: usize,
    /// Points are sorted when there are so many.
    room: usize,
    /// Low bits in which points of one box may differ.
    low: u32,
    kept: Vec<Entry>,
}

/// Bytes of memory for at most so many points of a cloud of `points`.
pub(super) fn bytes(most: u64, points: u64) -> u64 {
    room(most, points).saturating_mul(size_of::<Entry>() as u64)
}

fn room(most: u64, points: u64) -> u64 {
    most.saturating_mul(2).min(points).max(1)
}

/// The order in which points of a box stay: by scrambled position, then by colour.
fn rank(entry: Entry) -> (u64, Entry) {
    let key = entry >> COLOR;
    let mut x = key as u64 ^ ((key >> 64) as u64).rotate_left(32);
    // The last steps of SplitMix64.
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ x >> 31, entry)
}

impl Thinned {
    /// For at most `most` of `points` points; the memory is that of [`bytes`].
    pub fn new(most: u64, points: u64) -> Self {
        let room = room(most, points) as usize;
        Self {
            most: most.max(1) as usize,
            room,
            low: COLOR,
            kept: Vec::with_capacity(room),
        }
    }

    /// Takes a point with its colour.
    pub fn push(&mut self, point: Point, [red, green, blue]: [u8; 3]) {
        if self.kept.len() == self.room {
            self.shrink();
        }
        let key = encode(point);
        let key = key
            .iter()
            .fold(0, |key, word| key << WORD | Entry::from(*word));
        let color = u32::from_be_bytes([0, red, green, blue]);
        self.kept.push(key << COLOR | Entry::from(color));
    }

    /// Leaves at most `most` points.
    fn shrink(&mut self) {
        self.kept.sort_unstable();
        self.merge();
        while self.kept.len() > self.most {
            self.low += 1;
            self.merge();
        }
    }

    /// Leaves one point in each box.
    fn merge(&mut self) {
        let low = self.low;
        self.kept.dedup_by(|next, kept| {
            let together = *next >> low == *kept >> low;
            if together && rank(*next) < rank(*kept) {
                *kept = *next;
            }
            together
        });
    }

    /// Ends with the points that stay.
    pub fn finish(mut self) -> Even {
        self.shrink();
        Even {
            kept: self.kept,
            halvings: self.low - COLOR,
        }
    }
}

/// Points that stay, in the order of the curve.
pub(super) struct Even {
    kept: Vec<Entry>,
    /// A box has two to the power of this lattice positions.
    halvings: u32,
}

impl Even {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// The longest side of a box, in steps.
    pub fn side(&self) -> f64 {
        2f64.powi(self.halvings.div_ceil(3) as i32)
    }

    /// All points.
    pub fn points(&self) -> impl Iterator<Item = Point> {
        self.kept.iter().map(|entry| {
            let word = |n: u32| (entry >> (COLOR + n * WORD)) as u32 & ((1 << WORD) - 1);
            decode([word(2), word(1), word(0)])
        })
    }

    /// Their colours.
    pub fn colors(&self) -> impl Iterator<Item = [u8; 3]> {
        self.kept.iter().map(|entry| {
            let [_, red, green, blue] = (*entry as u32).to_be_bytes();
            [red, green, blue]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn thinned(most: u64, points: &[(Point, [u8; 3])]) -> Even {
        let mut thinned = Thinned::new(most, points.len() as u64);
        points
            .iter()
            .for_each(|(p, color)| thinned.push(*p, *color));
        thinned.finish()
    }

    /// A sheet of `side` times `side` points.
    fn sheet(side: i32) -> Vec<(Point, [u8; 3])> {
        let place = |n: i32| [1000 * (n % side), 1000 * (n / side), 77 * (n % 13)];
        let all = 0..side * side;
        all.map(|n| (place(n), [n as u8, (n >> 8) as u8, 3]))
            .collect()
    }

    #[test]
    fn all_stay_if_there_is_room() {
        let sheet = sheet(20);
        let even = thinned(400, &sheet);
        assert_eq!((even.len(), even.side()), (400, 1.0));
        let found: BTreeSet<_> = even.points().zip(even.colors()).collect();
        assert_eq!(found, sheet.into_iter().collect());
    }

    #[test]
    fn more_than_half_of_the_bound_is_used_and_spread_evenly() {
        let sheet = sheet(300);
        for most in [1, 2, 7, 100, 999, 5000] {
            let even = thinned(most, &sheet);
            let count = even.len() as u64;
            assert!(count <= most && 2 * count > most, "{count} of {most}");
        }
        // No gap is wider than the diagonals of two boxes.
        let even = thinned(1000, &sheet);
        let kept: Vec<Point> = even.points().collect();
        let reach = 2.0 * 3f64.sqrt() * even.side();
        for (p, _) in sheet.iter().step_by(97) {
            let square = |q: &Point| (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>();
            let nearest = kept.iter().map(square).fold(f64::INFINITY, f64::min);
            assert!(nearest.sqrt() <= reach, "{p:?}: {}", nearest.sqrt());
        }
    }

    #[test]
    fn of_points_at_one_place_the_smallest_colour_stays() {
        let place = [5, 6, 7];
        let even = thinned(
            9,
            &[(place, [9, 0, 0]), (place, [8, 1, 2]), (place, [8, 1, 3])],
        );
        assert_eq!(
            even.points().zip(even.colors()).collect::<Vec<_>>(),
            [(place, [8, 1, 2])]
        );
    }

    proptest! {
        #[test]
        fn the_order_does_not_matter(
            points in prop::collection::vec(((0..1 << 30, 0..1 << 12, 0..40), 0..3u8), 1..400),
            most in 1..90u64,
            seed in any::<u64>(),
        ) {
            let mut points: Vec<(Point, [u8; 3])> =
                points.into_iter().map(|((x, y, z), c)| ([x, y, z], [c, 0, c])).collect();
            let one = thinned(most, &points);
            let mixed = |p: Point| p.iter().fold(Entry::from(seed), |x, c| x << 30 ^ Entry::from(c.unsigned_abs()));
            points.sort_by_key(|(p, color)| (rank(mixed(*p)), *color));
            points.dedup();
            let other = thinned(most, &points);
            prop_assert_eq!(one.kept, other.kept);
            prop_assert_eq!(one.halvings, other.halvings);
        }
    }
}
