//! Objects on the ground, and their positions.

use std::f64::consts::PI;

use super::epoch::{Changes, FELLED};
use super::{OUTDOOR_SIDE, Objects};
use crate::rng::{Purpose, Rng};

/// Number of houses.
const HOUSES: u64 = 60;

/// Number of free-standing walls.
const WALLS: u64 = 25;

/// A box with its sides along x and y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct House {
    pub centre: [f64; 2],
    pub width: f64,
    pub depth: f64,
    pub height: f64,
}

impl House {
    /// True if the ground at this position is under the roof.
    pub(crate) fn covers(&self, [x, y]: [f64; 2]) -> bool {
        (x - self.centre[0]).abs() < self.width / 2.0
            && (y - self.centre[1]).abs() < self.depth / 2.0
    }
}

/// A crown on a thin trunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tree {
    pub centre: [f64; 2],
    pub radius: f64,
}

/// A wall that follows the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wall {
    pub centre: [f64; 2],
    /// Direction in the ground plan, of length one.
    pub along: [f64; 2],
    pub length: f64,
    pub height: f64,
}

/// A power line that sags.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wire {
    pub centre: [f64; 2],
    /// Direction in the ground plan, of length one.
    pub along: [f64; 2],
}

/// Objects on the ground. They depend only on the seed and their numbers, not on the points.
#[derive(Clone, Debug)]
pub(crate) struct Land {
    pub houses: Vec<House>,
    pub trees: Vec<Tree>,
    pub walls: Vec<Wall>,
    pub wires: Vec<Wire>,
    /// What changed since the first survey.
    pub changes: Option<Changes>,
}

impl Land {
    /// The first trees and wires are the same for any number of them.
    pub(crate) fn new(seed: u64, objects: &Objects) -> Self {
        let house = |mut rng: Rng| House {
            centre: place(&mut rng, 20.0),
            width: between(&mut rng, 6.0, 20.0),
            depth: between(&mut rng, 6.0, 20.0),
            height: between(&mut rng, 3.0, 9.0),
        };
        let tree = |mut rng: Rng| Tree {
            centre: place(&mut rng, 5.0),
            radius: between(&mut rng, 1.5, 4.0),
        };
        let wall = |mut rng: Rng| {
            let centre = place(&mut rng, 20.0);
            let along = direction(&mut rng);
            let length = between(&mut rng, 10.0, 60.0);
            let usual = between(&mut rng, 1.0, 3.0);
            let height = objects.wall_height.unwrap_or(usual);
            Wall {
                centre,
                along,
                length,
                height,
            }
        };
        let wire = |mut rng: Rng| Wire {
            along: direction(&mut rng),
            centre: place(&mut rng, 100.0),
        };
        let stream = move |group: u64| {
            move |number: u64| Rng::at(seed, Purpose::Object, group << 32 | number)
        };
        let mut land = Land {
            houses: (0..HOUSES).map(stream(0)).map(house).collect(),
            trees: (0..objects.trees.into()).map(stream(1)).map(tree).collect(),
            walls: (0..WALLS).map(stream(2)).map(wall).collect(),
            wires: (0..objects.wires.into()).map(stream(3)).map(wire).collect(),
            changes: None,
        };
        if objects.epoch {
            let changes = Changes::new(&land.discs(), stream(4));
            land.houses.push(changes.new_house());
            land.trees.drain(..FELLED.min(land.trees.len()));
            land.changes = Some(changes);
        }
        land
    }

    /// Discs (x, y, radius) around all houses, trees and walls, with a margin. Ground outside is open. Wires
    /// are too high to matter.
    pub(crate) fn discs(&self) -> Vec<[f64; 3]> {
        let mut discs: Vec<_> = self.changes.iter().flat_map(Changes::discs).collect();
        for house in &self.houses {
            let [x, y] = house.centre;
            discs.push([x, y, house.width.max(house.depth) * 0.75 + 2.0]);
        }
        for tree in &self.trees {
            let [x, y] = tree.centre;
            discs.push([x, y, tree.radius + 2.0]);
        }
        for wall in &self.walls {
            // At least ten long, so at least ten discs.
            let count = wall.length.floor().max(2.0);
            for k in 0..count as u32 {
                let t = wall.length * (f64::from(k) / (count - 1.0) - 0.5);
                let [x, y] = [0, 1].map(|axis| wall.centre[axis] + t * wall.along[axis]);
                discs.push([x, y, 2.5]);
            }
        }
        discs
    }

    /// Area under roofs; overlaps count once.
    pub(crate) fn built_area(&self) -> f64 {
        let cuts = |low: fn(&House) -> f64, high: fn(&House) -> f64| {
            let mut cuts: Vec<f64> = self
                .houses
                .iter()
                .flat_map(|house| [low(house), high(house)])
                .collect();
            cuts.sort_by(f64::total_cmp);
            cuts
        };
        let across = cuts(
            |h| h.centre[0] - h.width / 2.0,
            |h| h.centre[0] + h.width / 2.0,
        );
        let along = cuts(
            |h| h.centre[1] - h.depth / 2.0,
            |h| h.centre[1] + h.depth / 2.0,
        );
        let mut area = 0.0;
        for x in across.windows(2) {
            for y in along.windows(2) {
                let middle = [f64::midpoint(x[0], x[1]), f64::midpoint(y[0], y[1])];
                if self.houses.iter().any(|house| house.covers(middle)) {
                    area += (x[1] - x[0]) * (y[1] - y[0]);
                }
            }
        }
        area
    }
}

/// Uniform from `low` to `high`.
pub(super) fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.uniform()
}

/// A random position at least `margin` from the border.
fn place(rng: &mut Rng, margin: f64) -> [f64; 2] {
    std::array::from_fn(|_| between(rng, margin, OUTDOOR_SIDE - margin))
}

/// A direction in the ground plan.
fn direction(rng: &mut Rng) -> [f64; 2] {
    let (sin, cos) = libm::sincos(PI * rng.uniform());
    [cos, sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_houses_count_once() {
        let house = |x, y, width| House {
            centre: [x, y],
            width,
            depth: 4.0,
            height: 3.0,
        };
        let mut land = Land::new(0, &Objects::default());
        land.houses = vec![
            house(10.0, 10.0, 6.0),
            house(12.0, 11.0, 6.0),
            house(50.0, 9.0, 2.0),
        ];
        assert!((land.built_area() - (24.0 + 24.0 - 12.0 + 8.0)).abs() < 1e-9);
    }

    #[test]
    fn more_trees_leave_the_first_where_they_are() {
        let few = Land::new(3, &Objects::default());
        let objects = Objects {
            trees: 800,
            wires: 4,
            wall_height: Some(0.3),
            epoch: false,
        };
        let many = Land::new(3, &objects);
        assert_eq!((few.trees.len(), many.trees.len()), (400, 800));
        for (a, b) in few.trees.iter().zip(&many.trees) {
            assert_eq!((a.centre, a.radius), (b.centre, b.radius));
        }
        for (a, b) in few.walls.iter().zip(&many.walls) {
            assert_eq!((a.centre, a.length), (b.centre, b.length));
            assert!((1.0..3.0).contains(&a.height) && b.height == 0.3);
        }
    }
}
