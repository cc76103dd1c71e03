//! The points: ground and objects.

use super::epoch::Changes;
use super::land::{House, Land, Tree, Wall, Wire, between};
use super::{HIGHEST_WALL, OUTDOOR_SIDE, height, slopes};
use crate::rng::Rng;
use crate::surface::Sample;
use crate::vec3::{Vec3, normalize, scale};

/// Density of points on the ground, relative to one point per square of the spacing.
const GROUND: f64 = 0.8;

/// Density on the sides of houses, likewise: they are scanned from above.
const SIDES: f64 = 0.25;

/// Density on walls, likewise.
const WALL: f64 = 0.5;

/// Points of a crown of radius 2, relative to those of the whole land.
const CROWN: f64 = 0.6e-4;

/// Points of a trunk, relative to those of its crown.
const TRUNK: f64 = 1.0 / 8.0;

/// Length of a wire.
const WIRE_LENGTH: f64 = 180.0;

/// Distance of points on a wire, in spacings.
const WIRE_STEP: f64 = 3.0;

const AREA: f64 = OUTDOOR_SIDE * OUTDOOR_SIDE;

/// Parts of the land.
#[derive(Clone, Copy, Debug)]
enum Part {
    Ground,
    Roof(House),
    Sides(House),
    Crown(Tree),
    Trunk(Tree),
    Wall(Wall),
    Wire(Wire),
}

/// The points of the land, made on demand.
#[derive(Debug)]
pub(crate) struct Outdoor {
    houses: Vec<House>,
    /// First point of each part.
    starts: Vec<u64>,
    parts: Vec<Part>,
    spacing: f64,
    changes: Option<Changes>,
}

impl Outdoor {
    pub(crate) fn new(land: &Land, points: u64) -> Self {
        let parts = parts(land);
        let open = 1.0 - land.built_area() / AREA;
        let share = |part: &Part| share(part, open);
        // The points of wires grow only with the root: points = rate * root^2 + wire * root.
        let rate: f64 = parts.iter().map(share).sum();
        let wire = land.wires.len() as f64 * WIRE_LENGTH / WIRE_STEP / OUTDOOR_SIDE;
        let discriminant = wire * wire + 4.0 * rate * points as f64;
        let root = (discriminant.sqrt() - wire) / (2.0 * rate);
        let count = |part: &Part| match part {
            Part::Ground => 0,
            Part::Wire(_) => (WIRE_LENGTH / WIRE_STEP * root / OUTDOOR_SIDE) as u64,
            _ => (share(part) * root * root) as u64,
        };
        // The rest is ground, which comes first.
        let objects: u64 = parts.iter().map(count).sum();
        let ground = points.saturating_sub(objects);
        let mut next = 0;
        let starts = parts.iter().map(|part| {
            let start = next;
            next += match part {
                Part::Ground => ground,
                _ => count(part),
            };
            start
        });
        Outdoor {
            starts: starts.collect(),
            houses: land.houses.clone(),
            parts,
            spacing: OUTDOOR_SIDE / root,
            changes: land.changes,
        }
    }

    /// Side of the square with one point on a roof.
    pub(crate) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Corners of a box with all points, without noise.
    pub(crate) fn bounds() -> [Vec3; 2] {
        // Walls reach over the border by 10 at most. The ground is within 17 of zero, and nothing is higher
        // above it than the highest allowed wall.
        let far = OUTDOOR_SIDE + 10.0;
        [[-10.0, -10.0, -17.0], [far, far, 17.0 + HIGHEST_WALL]]
    }

    /// Point `rank`, in the order of the parts.
    pub(crate) fn point(&self, rank: u64, rng: &mut Rng) -> Sample {
        let at = self.starts.partition_point(|&start| start <= rank);
        let at = at.saturating_sub(1);
        match &self.parts[at] {
            Part::Ground => self.ground(rng),
            Part::Roof(house) => roof(house, rng),
            Part::Sides(house) => side(house, rng),
            Part::Crown(tree) => crown(tree, rng),
            Part::Trunk(tree) => trunk(tree, rng),
            Part::Wall(wall) => on_wall(wall, rng),
            Part::Wire(wire) => self.on_wire(wire, rank - self.starts[at]),
        }
    }

    /// A random point in the air.
    pub(crate) fn outlier(rng: &mut Rng) -> Vec3 {
        let [x, y] = [0, 1].map(|_| OUTDOOR_SIDE * rng.uniform());
        [x, y, height(x, y) + between(rng, 0.5, 30.0)]
    }

    fn ground(&self, rng: &mut Rng) -> Sample {
        // Houses cover at most a seventh, so the loop ends.
        let mut place = [0.0; 2];
        loop {
            place.fill_with(|| OUTDOOR_SIDE * rng.uniform());
            if !self.houses.iter().any(|house| house.covers(place)) {
                break;
            }
        }
        let [x, y] = place;
        let [slope_x, slope_y] = slopes(x, y);
        let changes = self.changes.map(|changes| changes.rise(place));
        let (rise, [more_x, more_y]) = changes.unwrap_or_default();
        let (slope_x, slope_y) = (slope_x + more_x, slope_y + more_y);
        Sample {
            position: [x, y, height(x, y) + rise],
            normal: normalize([-slope_x, -slope_y, 1.0]),
        }
    }

    fn on_wire(&self, wire: &Wire, number: u64) -> Sample {
        let half = WIRE_LENGTH / 2.0;
        let t = WIRE_STEP * self.spacing * number as f64 - half;
        let [x, y] = [0, 1].map(|axis| wire.centre[axis] + t * wire.along[axis]);
        let bottom = height(wire.centre[0], wire.centre[1]) + 12.0;
        Sample {
            position: [x, y, bottom + 6.0 * (t / half) * (t / half)],
            normal: [0.0; 3],
        }
    }
}

fn parts(land: &Land) -> Vec<Part> {
    let houses = land.houses.iter();
    let houses = houses.flat_map(|&house| [Part::Roof(house), Part::Sides(house)]);
    let trees = land.trees.iter();
    let trees = trees.flat_map(|&tree| [Part::Crown(tree), Part::Trunk(tree)]);
    let walls = land.walls.iter().map(|&wall| Part::Wall(wall));
    let wires = land.wires.iter().map(|&wire| Part::Wire(wire));
    [Part::Ground]
        .into_iter()
        .chain(houses)
        .chain(trees)
        .chain(walls)
        .chain(wires)
        .collect()
}

/// Points of a part, relative to those of the whole square; `open` is the share without houses.
fn share(part: &Part, open: f64) -> f64 {
    match part {
        Part::Ground => GROUND * open,
        Part::Roof(house) => house.width * house.depth / AREA,
        Part::Sides(house) => SIDES * 2.0 * (house.width + house.depth) * house.height / AREA,
        Part::Crown(tree) => CROWN * tree.radius * tree.radius / 4.0,
        Part::Trunk(tree) => TRUNK * CROWN * tree.radius * tree.radius / 4.0,
        Part::Wall(wall) => WALL * wall.length * wall.height / AREA,
        Part::Wire(_) => 0.0,
    }
}

fn roof(house: &House, rng: &mut Rng) -> Sample {
    let [x, y] = house.centre;
    let u = house.width * (rng.uniform() - 0.5);
    let v = house.depth * (rng.uniform() - 0.5);
    Sample {
        position: [x + u, y + v, height(x, y) + house.height],
        normal: [0.0, 0.0, 1.0],
    }
}

fn side(house: &House, rng: &mut Rng) -> Sample {
    let [x, y] = house.centre;
    let (w, d) = (house.width, house.depth);
    let t = 2.0 * (w + d) * rng.uniform();
    let ([u, v], [a, b]) = if t < w {
        ([t - w / 2.0, -d / 2.0], [0.0, -1.0])
    } else if t < w + d {
        ([w / 2.0, t - w - d / 2.0], [1.0, 0.0])
    } else if t < 2.0 * w + d {
        ([w / 2.0 - (t - w - d), d / 2.0], [0.0, 1.0])
    } else {
        ([-w / 2.0, d / 2.0 - (t - 2.0 * w - d)], [-1.0, 0.0])
    };
    let up = between(rng, -1.0, house.height);
    Sample {
        position: [x + u, y + v, height(x, y) + up],
        normal: [a, b, 0.0],
    }
}

fn crown(tree: &Tree, rng: &mut Rng) -> Sample {
    let [x, y] = tree.centre;
    let normal = normalize(std::array::from_fn(|_| rng.normal()));
    let [u, v, w] = scale(normal, tree.radius * between(rng, 0.3, 1.0).sqrt());
    let middle = height(x, y) + 1.0 + tree.radius;
    Sample {
        position: [x + u, y + v, middle + 1.2 * w],
        normal,
    }
}

fn trunk(tree: &Tree, rng: &mut Rng) -> Sample {
    let [x, y] = tree.centre;
    let [u, v] = [0, 1].map(|_| 0.15 * rng.normal());
    Sample {
        position: [x + u, y + v, height(x, y) + between(rng, 0.0, 1.5)],
        normal: normalize([u, v, 0.0]),
    }
}

fn on_wall(wall: &Wall, rng: &mut Rng) -> Sample {
    let t = wall.length * (rng.uniform() - 0.5);
    let [x, y] = [0, 1].map(|axis| wall.centre[axis] + t * wall.along[axis]);
    Sample {
        position: [x, y, height(x, y) + wall.height * rng.uniform()],
        normal: [-wall.along[1], wall.along[0], 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outdoor::Objects;
    use crate::rng::Purpose;

    fn outdoor(seed: u64, objects: &Objects, points: u64) -> Outdoor {
        Outdoor::new(&Land::new(seed, objects), points)
    }

    /// Shares of ground, roofs, sides, crowns, trunks, walls and wires.
    fn shares(outdoor: &Outdoor, points: u64) -> [f64; 7] {
        let mut counts = [0.0; 7];
        let ends = outdoor.starts[1..].iter().chain([&points]);
        for ((part, start), end) in outdoor.parts.iter().zip(&outdoor.starts).zip(ends) {
            let at = match part {
                Part::Ground => 0,
                Part::Roof(_) => 1,
                Part::Sides(_) => 2,
                Part::Crown(_) => 3,
                Part::Trunk(_) => 4,
                Part::Wall(_) => 5,
                Part::Wire(_) => 6,
            };
            counts[at] += (end - start) as f64;
        }
        counts.map(|count| count / points as f64)
    }

    #[test]
    fn parts_share_the_points() {
        // Means of the distributions of the sizes; seeds differ from them by some per cent.
        let points = 4_500_000;
        let wires = Objects {
            wires: 4,
            ..Objects::default()
        };
        let mut mean = [0.0; 7];
        for seed in 0..40 {
            let shares = shares(&outdoor(seed, &wires, points), points);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            (0..7).for_each(|k| mean[k] += shares[k] / 40.0);
        }
        let nominal = 4_500_000.0 / 0.902;
        let roofs = 60.0 * 169.0 / AREA;
        let sides = 60.0 * 0.25 * 2.0 * 26.0 * 6.0 / AREA;
        let crowns = 400.0 * 0.6e-4 * (4.0f64.powi(3) - 1.5f64.powi(3)) / 7.5 / 4.0;
        let walls = 25.0 * 0.5 * 35.0 * 2.0 / AREA;
        let wires = 4.0 * 60.0 * f64::sqrt(nominal) / 400.0 / nominal;
        let wanted = [roofs, sides, crowns, crowns / 8.0, walls, wires];
        for (mean, wanted) in mean[1..].iter().zip(wanted) {
            assert!(
                (mean * 0.902 / wanted - 1.0).abs() < 0.06,
                "{mean} {wanted}"
            );
        }
        assert!((0.80..0.86).contains(&mean[0]), "{}", mean[0]);
    }

    #[test]
    fn points_and_spacing_belong_together() {
        for (points, wires) in [(0, 3), (1, 0), (100, 50), (18_000_000, 12)] {
            let objects = Objects {
                wires,
                ..Objects::default()
            };
            let outdoor = outdoor(2, &objects, points);
            let on_roofs = (OUTDOOR_SIDE / outdoor.spacing()).powi(2);
            assert!(on_roofs <= 1.3 * points as f64, "{points}");
            assert!(points < 1000 || on_roofs > points as f64, "{points}");
            assert!(outdoor.starts.iter().all(|&start| start <= points));
        }
    }

    #[test]
    fn wires_hang_through() {
        let objects = Objects {
            wires: 1,
            ..Objects::default()
        };
        let points = 100_000;
        let outdoor = outdoor(5, &objects, points);
        let wire = Land::new(5, &objects).wires[0];
        let first = outdoor.starts[outdoor.starts.len() - 1];
        for rank in first..points {
            let mut rng = Rng::at(0, Purpose::Position, rank);
            let [x, y, z] = outdoor.point(rank, &mut rng).position;
            let t = libm::hypot(x - wire.centre[0], y - wire.centre[1]);
            let up = z - height(wire.centre[0], wire.centre[1]);
            assert!(t <= 90.0 + 1e-9 && (up - 12.0 - 6.0 * (t / 90.0).powi(2)).abs() < 1e-9);
        }
        assert!(points - first > 40, "{}", points - first);
    }
}
