//! The restricted Voronoi cell of a point: its disk clipped by bisectors (paper, Algorithm 1).
//!
//! The polygon lives in two dimensions, in a frame of the disk's plane. A corner is kept as the
//! pair of lines that make it; whether a new bisector cuts it off is read off floating point where
//! a forward error bound allows, and else decided exactly ([`super::predicate`]).

use super::plane::Normal;
use super::predicate::{Neighbor, cuts_corner, cuts_parallel};

/// Number of corners of the disk.
const RIM_CORNERS: usize = 10;

/// Id of a line that is part of the disk's rim and not a bisector.
const RIM: u32 = u32::MAX;

/// Unit normals of the disk's sides, at odd multiples of 18 degrees, and their distance from the
/// centre, cos 18°, for a disk of radius 1. Written out so that no library function decides bits.
const RIM_SIDES: [[f64; 2]; RIM_CORNERS] = [
    [0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [0.587_785_252_292_473_1, 0.809_016_994_374_947_5],
    [0.0, 1.0],
    [-0.587_785_252_292_473_1, 0.809_016_994_374_947_5],
    [-0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [-0.951_056_516_295_153_5, -0.309_016_994_374_947_45],
    [-0.587_785_252_292_473_1, -0.809_016_994_374_947_5],
    [0.0, -1.0],
    [0.587_785_252_292_473_1, -0.809_016_994_374_947_5],
    [0.951_056_516_295_153_5, -0.309_016_994_374_947_45],
];
const RIM_DISTANCE: f64 = 0.951_056_516_295_153_5;

/// Factor of the forward error bounds, in units of the last place; several times what a count of
/// the roundings gives.
const SLACK: f64 = 32.0 * f64::EPSILON;

/// A side of the polygon: the line `line · q = offset` in the plane's frame.
#[derive(Debug, Clone, Copy)]
struct Side {
    line: [f64; 2],
    offset: f64,
    /// Length of the neighbour's difference in space, which scales the error of `line`.
    length: f64,
    neighbor: Neighbor,
}

/// The end of a side: where it meets the next.
#[derive(Debug, Clone, Copy)]
struct Corner {
    at: [f64; 2],
    /// Bound on the distance of `at` from the true corner.
    error: f64,
    /// Distance from the centre, at most.
    reach: f64,
}

/// A restricted Voronoi cell in the making. One value can serve many cells in turn.
#[derive(Debug, Clone)]
pub struct Cell {
    own: u32,
    normal: Normal,
    frame: [[f64; 3]; 2],
    sides: Vec<Side>,
    corners: Vec<Corner>,
    cut: Vec<f64>,
    reach: f64,
    hidden: bool,
}

impl Cell {
    /// The whole disk of point `own`: radius in steps, in the plane with `normal`.
    #[must_use]
    pub fn new(own: u32, normal: Normal, radius: f64) -> Self {
        let mut cell = Self {
            own,
            normal,
            frame: [[0.0; 3]; 2],
            sides: Vec::with_capacity(24),
            corners: Vec::with_capacity(24),
            cut: Vec::with_capacity(24),
            reach: 0.0,
            hidden: false,
        };
        cell.start(own, normal, radius);
        cell
    }

    /// Begins another cell in the same memory.
    pub fn start(&mut self, own: u32, normal: Normal, radius: f64) {
        self.own = own;
        self.normal = normal;
        self.frame = frame(normal);
        self.hidden = false;
        self.sides.clear();
        self.corners.clear();
        for line in RIM_SIDES {
            let neighbor = Neighbor {
                difference: [0; 3],
                id: RIM,
            };
            self.sides.push(Side {
                line,
                offset: radius * RIM_DISTANCE,
                length: 1.0,
                neighbor,
            });
        }
        for k in 0..RIM_CORNERS {
            self.corners
                .push(meet(&self.sides[k], &self.sides[(k + 1) % RIM_CORNERS]));
        }
        self.update_reach();
    }

    fn update_reach(&mut self) {
        self.reach = self.corners.iter().fold(0.0, |r, c| r.max(c.reach));
    }

    /// Points at a larger squared distance than this cannot touch the cell: four times the squared
    /// radius of security, rounded up.
    #[must_use]
    pub fn reach2(&self) -> u64 {
        // The conversion saturates for disks larger than any cloud.
        ((4.0 * self.reach * self.reach * (1.0 + 1e-9)) as u64).saturating_add(1)
    }

    /// Clips by the bisector of the point `id` at `difference` from this cell's point.
    pub fn clip(&mut self, difference: [i64; 3], id: u32) {
        if difference == [0; 3] {
            // Of two points in one place the heavier, with the lower id, has the cell.
            self.hidden |= id < self.own;
            return;
        }
        let side = self.side(difference, id);
        let flat2 = side.line[0] * side.line[0] + side.line[1] * side.line[1];
        if side.offset * side.offset > self.reach * self.reach * flat2 * (1.0 + 1e-9) {
            return;
        }
        if let Some((first, count)) = self.arc_cut_by(&side) {
            self.replace(first, count, side);
        }
    }

    fn side(&self, difference: [i64; 3], id: u32) -> Side {
        let d = difference.map(|x| x as f64);
        let dot = |u: [f64; 3]| d[0] * u[0] + d[1] * u[1] + d[2] * u[2];
        let length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        Side {
            line: [dot(self.frame[0]), dot(self.frame[1])],
            offset: 0.5 * length2,
            length: length2.sqrt(),
            neighbor: Neighbor { difference, id },
        }
    }

    /// The run of corners that `side` cuts off, as first and number; `None` if there is none.
    fn arc_cut_by(&mut self, side: &Side) -> Option<(usize, usize)> {
        let n = self.corners.len();
        self.cut.clear();
        let mut deepest = None;
        for k in 0..n {
            let depth = self.depth(k, side);
            if depth > 0.0 && deepest.is_none_or(|(d, _)| depth > d) {
                deepest = Some((depth, k));
            }
            self.cut.push(depth);
        }
        let (_, seed) = deepest?;
        // A line cuts one run off a convex polygon; rim corners decided in floating point might
        // say otherwise by a hair, so the run around the deepest one counts.
        let mut first = seed;
        let mut count = 1;
        while count < n && self.cut[(first + n - 1) % n] > 0.0 {
            first = (first + n - 1) % n;
            count += 1;
        }
        while count < n && self.cut[(first + count) % n] > 0.0 {
            count += 1;
        }
        // The cell's own point is never cut off, so some corner stays.
        (count < n).then_some((first, count))
    }

    /// How far beyond `side` corner `k` lies; positive exactly if it is cut off.
    fn depth(&self, k: usize, side: &Side) -> f64 {
        let corner = &self.corners[k];
        let depth = side.line[0] * corner.at[0] + side.line[1] * corner.at[1] - side.offset;
        let bound = side.length * corner.error + SLACK * (side.length * corner.reach + side.offset);
        if depth.abs() > bound {
            return depth;
        }
        let a = self.sides[k].neighbor;
        let b = self.sides[(k + 1) % self.sides.len()].neighbor;
        let c = side.neighbor;
        let cut = match (a.id == RIM, b.id == RIM) {
            (false, false) => cuts_corner(self.normal, self.own, a, b, c),
            (true, true) => return depth,
            (a_is_rim, _) => {
                let other = if a_is_rim { b } else { a };
                match cuts_parallel(self.normal, self.own, other, c) {
                    Some(cut) => cut,
                    None => return depth,
                }
            }
        };
        if cut {
            f64::MIN_POSITIVE.max(depth)
        } else {
            0.0
        }
    }

    /// Puts `side` in place of `count` corners from `first` on, and the sides between them.
    fn replace(&mut self, first: usize, count: usize, side: Side) {
        let n = self.sides.len();
        // Turned so that the corners that go come last: side 0 begins at the first kept corner.
        let start = (first + count) % n;
        self.sides.rotate_left((start + 1) % n);
        self.corners.rotate_left(start);
        // Now corner k ends side k - 1 (mod n) and begins side k.
        let kept = n - count;
        self.corners.truncate(kept);
        // Sides 0..kept run from kept corner to kept corner or to the first that goes; the last
        // side of the list runs from the last that goes to kept corner 0.
        let into = self.sides[n - 1];
        self.sides.truncate(kept);
        let out = self.sides[kept - 1];
        self.corners.push(meet(&out, &side));
        self.corners.push(meet(&side, &into));
        self.sides.push(side);
        self.sides.push(into);
        // Back to the convention that corner k ends side k.
        self.corners.rotate_left(1);
        self.update_reach();
    }

    /// False if no point in a box, given relative to the cell's point, can change the cell: a point
    /// cuts off a corner only if it is nearer to the corner than the cell's own point.
    #[must_use]
    pub fn may_touch(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        let [u, v] = self.frame;
        self.corners.iter().any(|corner| {
            let mut distance2 = 0.0;
            for axis in 0..3 {
                let x = corner.at[0] * u[axis] + corner.at[1] * v[axis];
                let gap = (low[axis] - x).max(x - high[axis]).max(0.0);
                distance2 += gap * gap;
            }
            let reach = (corner.reach + corner.error) * (1.0 + 1e-9);
            distance2 <= reach * reach
        })
    }

    /// Calls `each` with the ids of the two bisectors at every corner between bisectors, in turn
    /// around the cell: with the cell's own id, the triples it sees.
    pub fn triples(&self, mut each: impl FnMut(u32, u32)) {
        if self.hidden {
            return;
        }
        let n = self.sides.len();
        for k in 0..n {
            let (a, b) = (
                self.sides[k].neighbor.id,
                self.sides[(k + 1) % n].neighbor.id,
            );
            if a != RIM && b != RIM {
                each(a, b);
            }
        }
    }
}

/// Two unit vectors that span the plane across `normal`.
fn frame(normal: Normal) -> [[f64; 3]; 2] {
    let n = normal.map(f64::from);
    let unit = |v: [f64; 3]| {
        let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        v.map(|x| x / length)
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let mut axis = [0.0; 3];
    let mut least = 0;
    for k in 1..3 {
        if n[k].abs() < n[least].abs() {
            least = k;
        }
    }
    axis[least] = 1.0;
    let u = unit(cross(n, axis));
    [u, cross(unit(n), u)]
}

/// Where two sides meet.
fn meet(a: &Side, b: &Side) -> Corner {
    let determinant = a.line[0] * b.line[1] - a.line[1] * b.line[0];
    let at = [
        (a.offset * b.line[1] - b.offset * a.line[1]) / determinant,
        (b.offset * a.line[0] - a.offset * b.line[0]) / determinant,
    ];
    let distance = (at[0] * at[0] + at[1] * at[1]).sqrt();
    let lengths = a.length + b.length;
    let error = SLACK * lengths / determinant.abs() * (a.offset + b.offset + lengths * distance);
    Corner {
        at,
        error,
        reach: distance + error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UP: Normal = [0, 0, 1 << 24];

    fn seen(cell: &Cell) -> Vec<(u32, u32)> {
        let mut all = Vec::new();
        cell.triples(|a, b| all.push((a.min(b), a.max(b))));
        all.sort_unstable();
        all
    }

    #[test]
    fn a_square_grid_gives_one_cell_of_four_sides() {
        let mut cell = Cell::new(0, UP, 50.0);
        for (id, d) in [
            (1, [10, 0, 0]),
            (2, [0, 10, 0]),
            (3, [-10, 0, 0]),
            (4, [0, -10, 0]),
        ] {
            cell.clip(d, id);
        }
        assert_eq!(seen(&cell), [(1, 2), (1, 4), (2, 3), (3, 4)]);
        assert!((200..=202).contains(&cell.reach2()), "{}", cell.reach2());
    }

    #[test]
    fn a_point_straight_above_changes_nothing() {
        let mut cell = Cell::new(0, UP, 50.0);
        let before = cell.reach2();
        cell.clip([0, 0, 3], 1);
        assert_eq!(cell.reach2(), before);
    }

    #[test]
    fn of_two_points_in_one_place_the_lower_id_has_the_cell() {
        let mut cell = Cell::new(5, UP, 50.0);
        cell.clip([0, 0, 0], 7);
        assert!(!cell.hidden);
        cell.clip([0, 0, 0], 2);
        assert!(cell.hidden);
    }

    proptest! {
        /// Corners found by clipping are those that no other bisector cuts off, decided exactly.
        #[test]
        fn corners_are_those_nobody_cuts_off(
            points in prop::collection::hash_set(prop::array::uniform3(-6i64..=6), 3..14),
            n in prop::array::uniform3(-3i32..=3),
        ) {
            prop_assume!(n != [0; 3]);
            let normal = n.map(|x| x << 20);
            let mut points: Vec<_> = points.into_iter().filter(|p| *p != [0; 3]).collect();
            points.sort_by_key(|p| (p.iter().map(|x| x * x).sum::<i64>(), *p));
            let all: Vec<_> = points.iter().enumerate()
                .map(|(i, &difference)| Neighbor { difference, id: i as u32 + 1 }).collect();
            // A disk so large that every bounded corner is inside.
            let mut cell = Cell::new(0, normal, 1e7);
            for p in &all { cell.clip(p.difference, p.id); }
            let mut expected = Vec::new();
            for (x, &a) in all.iter().enumerate() {
                for &b in &all[x + 1..] {
                    if super::super::predicate::turn(normal, a.difference, b.difference) == 0 {
                        continue;
                    }
                    let kept = all.iter().filter(|c| c.id != a.id && c.id != b.id)
                        .all(|&c| !cuts_corner(normal, 0, a, b, c));
                    if kept { expected.push((a.id, b.id)); }
                }
            }
            expected.sort_unstable();
            prop_assert_eq!(seen(&cell), expected);
        }
    }
}
