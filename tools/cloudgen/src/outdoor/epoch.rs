//! What changes on the land between two surveys.

use super::OUTDOOR_SIDE;
use super::land::{House, between};
use crate::rng::Rng;
use std::f64::consts::PI;

/// Radius of the pit at the ground, and at its bottom: its sides fall by 45 degrees.
const PIT: [f64; 2] = [8.0, 6.0];

/// Depth of the pit.
const DEPTH: f64 = PIT[0] - PIT[1];

/// Volume of the pit, whatever the slope of the ground: heights are measured from there.
pub const PIT_VOLUME: f64 =
    PI * DEPTH / 3.0 * (PIT[0] * PIT[0] + PIT[0] * PIT[1] + PIT[1] * PIT[1]);

/// Radius of the heap, a paraboloid.
const HEAP: f64 = 7.0;

/// Height of the heap.
const HIGH: f64 = 3.0;

/// Volume of the heap.
pub const HEAP_VOLUME: f64 = PI * HEAP * HEAP * HIGH / 2.0;

/// Trees that are felled, the first ones.
pub(super) const FELLED: usize = 10;

/// Distance of changes from each other, from the border and from all that is there.
const APART: f64 = 4.0;

/// Places that are tried.
const TRIES: u64 = 10_000;

/// Where the land changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changes {
    /// Middle of the pit.
    pub pit: [f64; 2],
    /// Middle of the heap.
    pub heap: [f64; 2],
    /// Middle of the new house.
    pub house: [f64; 2],
}

impl Changes {
    /// Chooses places that are free: not in one of the discs (x, y, radius). `stream` gives the random numbers of a try.
    pub(super) fn new(discs: &[[f64; 3]], stream: impl Fn(u64) -> Rng) -> Self {
        let mut taken = discs.to_vec();
        let mut next = 0;
        let mut choose = |radius: f64| {
            let mut place = [0.0; 2];
            let margin = radius + APART;
            for _ in 0..TRIES {
                let mut rng = stream(next);
                next += 1;
                place = [0, 1].map(|_| between(&mut rng, margin, OUTDOOR_SIDE - margin));
                let is_free =
                    |[x, y, r]: &[f64; 3]| libm::hypot(x - place[0], y - place[1]) > r + margin;
                if taken.iter().all(is_free) {
                    break;
                }
            }
            taken.push([place[0], place[1], radius]);
            place
        };
        Self {
            pit: choose(PIT[0]),
            heap: choose(HEAP),
            house: choose(8.0),
        }
    }

    /// The new house.
    pub(super) fn new_house(&self) -> House {
        House {
            centre: self.house,
            width: 12.0,
            depth: 9.0,
            height: 6.0,
        }
    }

    /// What the ground rose at a place, and the slopes of that along x and y.
    pub(super) fn rise(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let [u, v] = [x - self.pit[0], y - self.pit[1]];
        let far = libm::hypot(u, v);
        if far < PIT[1] {
            return (-DEPTH, [0.0; 2]);
        }
        if far < PIT[0] {
            return (far - PIT[0], [u / far, v / far]);
        }
        let [u, v] = [x - self.heap[0], y - self.heap[1]];
        let part = (u * u + v * v) / (HEAP * HEAP);
        if part < 1.0 {
            let slope = -2.0 * HIGH / (HEAP * HEAP);
            return (HIGH * (1.0 - part), [slope * u, slope * v]);
        }
        (0.0, [0.0; 2])
    }

    /// Discs around pit and heap, where the ground is another one.
    pub(super) fn discs(&self) -> [[f64; 3]; 2] {
        let disc = |[x, y]: [f64; 2], radius: f64| [x, y, radius + 2.0];
        [disc(self.pit, PIT[0]), disc(self.heap, HEAP)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Land, Objects};
    use super::*;

    #[test]
    fn the_ground_rises_by_the_volumes() {
        for seed in [1, 2, 7] {
            let objects = Objects {
                epoch: true,
                ..Objects::default()
            };
            let land = Land::new(seed, &objects);
            let before = Land::new(seed, &Objects::default());
            assert_eq!(land.trees.len() + FELLED, before.trees.len());
            assert_eq!(land.houses.len(), before.houses.len() + 1);
            let changes = land.changes.expect("changes");
            let step = 0.05;
            for (middle, volume) in [(changes.pit, -PIT_VOLUME), (changes.heap, HEAP_VOLUME)] {
                let mut sum = 0.0;
                for k in 0..400 * 400 {
                    let at = |n: i32| (f64::from(n) - 199.5) * step;
                    let [u, v] = [at(k % 400), at(k / 400)];
                    sum += changes.rise([middle[0] + u, middle[1] + v]).0 * step * step;
                }
                assert!((sum / volume - 1.0).abs() < 1e-3, "{sum} {volume}");
                // Nothing of the first survey is there.
                let far =
                    |[x, y, r]: &[f64; 3]| libm::hypot(x - middle[0], y - middle[1]) > r + 10.0;
                assert!(before.discs().iter().all(far), "seed {seed}");
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_rise() {
        let objects = Objects {
            epoch: true,
            ..Objects::default()
        };
        let changes = Land::new(3, &objects).changes.expect("changes");
        let step = 1e-6;
        for k in 0..60 {
            let t = f64::from(k) * 0.13;
            for middle in [changes.pit, changes.heap] {
                let [x, y] = [middle[0] + t, middle[1] + 0.7 * t];
                let rise = |x, y| changes.rise([x, y]).0;
                let (_, [by_x, by_y]) = changes.rise([x, y]);
                let x_slope = (rise(x + step, y) - rise(x - step, y)) / (2.0 * step);
                let y_slope = (rise(x, y + step) - rise(x, y - step)) / (2.0 * step);
                assert!(
                    (by_x - x_slope).abs() < 1e-4 && (by_y - y_slope).abs() < 1e-4,
                    "{t}"
                );
            }
        }
    }
}
