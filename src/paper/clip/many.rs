//! Cells of hundreds of corners or more, for instance of a point in the middle of a sphere of points.
//!
//! An index of the sides by direction finds the corner that is extreme in the direction of a new bisector.
//! The bisector is compared with this corner, and then with the corners beside it until one is kept. As long
//! as every decision was exact or certain, the corners form a convex polygon and the outcome equals that of
//! testing all corners. If a corner on the rim has been, or would now be, decided by uncertain floating
//! point, all corners are tested, as in a small cell.

use super::{Cell, Nearest, RIM_CORNERS, RIM_ID, Side};
use crate::kernels::eight::Base;
use crate::kernels::{Line, SLACK, bisectors};
use crate::predicate::{Neighbor, turn};
use std::cell::OnceCell;
use std::collections::{BTreeMap, BinaryHeap};

/// Cells with more corners use the index.
pub(super) const MANY: usize = 256;

/// Most sides stepped over where directions are too close for the index to distinguish them.
const STEPS: usize = 64;

/// Balls grouped into a larger ball.
const FAN: usize = 8;

/// The data that only a cell of many corners has.
#[derive(Debug, Clone)]
pub(super) struct Many {
    /// The sides sorted by direction in floating point, with the corner at which each ends.
    ends: BTreeMap<(u64, u32), u32>,
    /// Squared reaches of corners, as bits; corners that have been cut off may still be included.
    reaches: BinaryHeap<(u64, u32)>,
    /// The corners on the rim.
    rim: Vec<u32>,
    /// Bounding balls of the spheres around the corners, if computed since the last cut.
    balls: OnceCell<Balls>,
}

/// A hierarchy of bounding balls over the cell's corners.
#[derive(Debug, Clone)]
struct Balls {
    levels: Vec<Vec<Ball>>,
}

/// Spheres around points in a box.
#[derive(Debug, Clone, Copy)]
struct Ball {
    low: [f64; 3],
    high: [f64; 3],
    /// Squared radius of the largest sphere.
    reach2: f64,
}

impl Cell {
    /// As [`Cell::clip_nearest`], while the cell has many corners.
    #[cold]
    pub(super) fn clip_many(&mut self, near: Nearest<'_>, mut next: usize) -> usize {
        if self.many.is_none() {
            self.index();
        }
        while next < near.ids.len() && near.distances2[next] <= self.secure2 {
            let [x, y, z] = [near.x, near.y, near.z].map(|column| &column[next..=next]);
            let line = bisectors(self.level, x, y, z, &self.frame).get(0);
            let difference = [x, y, z].map(|c| i64::from(c[0]));
            let id = near.ids[next];
            self.clip_one_of_many(line, Neighbor { difference, id });
            next += 1;
            if self.count <= self.most / 2 {
                self.many = None;
                break;
            }
        }
        next
    }

    fn clip_one_of_many(&mut self, line: Line, neighbor: Neighbor) {
        if self.shares_place(&neighbor) {
            return;
        }
        let side = Side { line, neighbor };
        let run = self.run_around(&side).unwrap_or_else(|| {
            #[cfg(test)]
            {
                self.looks += self.places();
            }
            self.scan_words(&side)
        });
        if let Some((first, last)) = run {
            self.unlist(first, last);
            let second = self.replace::<Base>(first, last, side);
            self.list(first, second);
        }
    }

    /// The connected run of corners that `side` cuts off; `None` if all corners must be tested.
    fn run_around(&mut self, side: &Side) -> Option<Option<(u32, u32)>> {
        if self.unsure {
            return None;
        }
        let many = self.many.as_ref()?;
        for k in &many.rim {
            self.surely_cuts(*k, side)?;
        }
        let seed = self.support(many, side)?;
        if !self.surely_cuts(seed, side)? {
            return Some(None);
        }
        let (mut first, mut last, mut count) = (seed, seed, 1);
        while count < self.count && self.surely_cuts(self.links[first as usize].before, side)? {
            first = self.links[first as usize].before;
            count += 1;
        }
        while count < self.count && self.surely_cuts(self.links[last as usize].next, side)? {
            last = self.links[last as usize].next;
            count += 1;
        }
        #[cfg(test)]
        {
            self.looks += count + 2;
        }
        Some((count < self.count).then_some((first, last)))
    }

    /// True if `side` cuts off corner `k`; `None` if rounding could decide it.
    fn surely_cuts(&self, k: u32, side: &Side) -> Option<bool> {
        let corner = self.corner(k as usize);
        let [x, y] = corner.at;
        let depth = side.line.depth(x, y);
        if depth.abs() > side.line.bound(x, y, corner.error) {
            return Some(depth > 0.0);
        }
        let certain = || self.is_certain(k as usize, side).then_some(depth > 0.0);
        self.cuts(k as usize, side).or_else(certain)
    }

    /// The extreme corner in the direction of `side`: the one whose own two sides enclose this direction.
    fn support(&self, many: &Many, side: &Side) -> Option<u32> {
        let from = (key(&side.line), 0);
        let after = many
            .ends
            .range(from..)
            .next()
            .or(many.ends.first_key_value());
        let mut k = self.links[*after?.1 as usize].before;
        for _ in 0..STEPS {
            let [before, after] = self.sides_at(k as usize);
            if self.turn(before, side)? < 0 {
                k = self.links[k as usize].before;
            } else if self.turn(after, side)? > 0 {
                k = self.links[k as usize].next;
            } else {
                return Some(k);
            }
        }
        None
    }

    /// Sign of the turn from the direction of `from`, a side of the cell, to that of `to`; `None` if rounding
    /// could decide it.
    fn turn(&self, from: &Side, to: &Side) -> Option<i32> {
        let (a, b) = (&from.line, &to.line);
        let cross = a.line[0] * b.line[1] - a.line[1] * b.line[0];
        if cross.abs() > 4.0 * SLACK * a.length * b.length {
            return Some(if cross > 0.0 { 1 } else { -1 });
        }
        let [a, b] = [from, to].map(|side| side.neighbor.difference);
        (from.neighbor.id != RIM_ID).then(|| turn(self.normal, a, b))
    }

    /// Removes the sides between the corners `first` and `last` from the index.
    fn unlist(&mut self, first: u32, last: u32) {
        let Some(many) = &mut self.many else { return };
        many.rim.retain(|k| *k != first);
        let mut gone = first;
        while gone != last {
            gone = self.links[gone as usize].next;
            let number = self.links[gone as usize].side;
            let line = &self.sides[number as usize].line;
            many.ends.remove(&(key(line), number));
            many.rim.retain(|k| *k != gone);
        }
    }

    /// Adds to the index a new side with its first and last corner.
    fn list(&mut self, begin: u32, end: u32) {
        let number = self.links[end as usize].side;
        let line = self.sides[number as usize].line;
        let new = [begin, end].map(|k| (k, self.corner(k as usize).reach2, self.is_rim(k)));
        let Some(mut many) = self.many.take() else {
            return;
        };
        many.ends.insert((key(&line), number), end);
        many.balls.take();
        for (k, reach2, is_rim) in new {
            many.note(reach2, k);
            many.rim.extend(is_rim.then_some(k));
        }
        let reach2 = self.farthest(&mut many.reaches);
        let stale = many.reaches.len() > 4 * self.count;
        self.many = Some(many);
        self.set_reach(reach2);
        if stale || self.sides.len() > 2 * self.count + RIM_CORNERS {
            self.index();
        }
    }

    /// True for a corner on the rim.
    fn is_rim(&self, k: u32) -> bool {
        let sides = self.sides_at(k as usize);
        sides.iter().any(|side| side.neighbor.id == RIM_ID)
    }

    /// The largest reach of a corner; entries of removed corners are popped from the heap first.
    fn farthest(&self, reaches: &mut BinaryHeap<(u64, u32)>) -> f64 {
        while let Some(&(bits, k)) = reaches.peek() {
            if self.corner(k as usize).reach2.to_bits() == bits {
                return f64::from_bits(bits);
            }
            reaches.pop();
        }
        0.0
    }

    /// Rebuilds the index, and drops sides that are no longer part of the polygon.
    fn index(&mut self) {
        let mut sides = self.sides[..RIM_CORNERS].to_vec();
        let ring: Vec<u32> = self.ring().map(|k| k as u32).collect();
        for k in &ring {
            let number = &mut self.links[*k as usize].side;
            if *number as usize >= RIM_CORNERS {
                sides.push(self.sides[*number as usize]);
                *number = sides.len() as u32 - 1;
            }
        }
        self.sides = sides;
        let end = |k: &u32| {
            let number = self.links[*k as usize].side;
            ((key(&self.sides[number as usize].line), number), *k)
        };
        let mut many = Many {
            ends: ring.iter().map(end).collect(),
            reaches: BinaryHeap::with_capacity(ring.len()),
            rim: ring.iter().copied().filter(|k| self.is_rim(*k)).collect(),
            balls: OnceCell::new(),
        };
        for k in ring {
            many.note(self.corner(k as usize).reach2, k);
        }
        self.many = Some(Box::new(many));
        #[cfg(test)]
        {
            self.looks += self.count;
        }
    }

    /// Releases the memory of many corners.
    #[cold]
    pub(super) fn forget_many(&mut self) {
        self.many = None;
        self.sides.truncate(RIM_CORNERS);
        self.sides.shrink_to_fit();
        self.corners = Vec::new();
        self.links = Vec::new();
        self.free = Vec::new();
        (self.cut, self.doubt) = (Vec::new(), Vec::new());
    }
}

impl Many {
    fn note(&mut self, reach2: f64, k: u32) {
        // NaN is excluded. The other values are not negative, so their bits are ordered like their values.
        if !reach2.is_nan() {
            self.reaches.push((reach2.to_bits(), k));
        }
    }

    /// See [`Cell::may_touch`].
    pub fn may_touch(&self, cell: &Cell, low: [f64; 3], high: [f64; 3]) -> bool {
        let balls = self.balls.get_or_init(|| Balls::of(cell));
        balls.touch(balls.levels.len() - 1, 0, low, high)
    }
}

impl Balls {
    fn of(cell: &Cell) -> Self {
        let corners: Vec<Ball> = cell.ring().map(|k| Ball::around(cell, k)).collect();
        // Up to eight corners, one box suffices.
        let mut levels = vec![Ball::joined(&corners)];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let above = Ball::joined(below);
            levels.push(above);
        }
        Self { levels }
    }

    /// True if a box may intersect a sphere in ball `number` of a level.
    fn touch(&self, level: usize, number: usize, low: [f64; 3], high: [f64; 3]) -> bool {
        let Some(ball) = self.levels[level].get(number) else {
            return false;
        };
        let below = FAN * number..FAN * (number + 1);
        ball.meets(low, high)
            && (level == 0
                || below
                    .into_iter()
                    .any(|k| self.touch(level - 1, k, low, high)))
    }
}

impl Ball {
    fn around(cell: &Cell, k: usize) -> Self {
        let [u, v] = cell.frame;
        let corner = cell.corner(k);
        let at = std::array::from_fn(|axis| corner.at[0] * u[axis] + corner.at[1] * v[axis]);
        Self {
            low: at,
            high: at,
            reach2: corner.reach2,
        }
    }

    /// The next level: each few consecutive balls in one.
    fn joined(balls: &[Self]) -> Vec<Self> {
        let both = |a: &Self, b: &Self| Self {
            low: std::array::from_fn(|axis| a.low[axis].min(b.low[axis])),
            high: std::array::from_fn(|axis| a.high[axis].max(b.high[axis])),
            reach2: a.reach2.max(b.reach2),
        };
        let few = balls.chunks(FAN);
        few.map(|few| few[1..].iter().fold(few[0], |a, b| both(&a, b)))
            .collect()
    }

    /// False if no sphere around a point of the ball intersects the box. Rounding is monotone, so no sphere
    /// that does is missed.
    fn meets(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        let mut distance2 = 0.0;
        for axis in 0..3 {
            let gap = (low[axis] - self.high[axis])
                .max(self.low[axis] - high[axis])
                .max(0.0);
            distance2 += gap * gap;
        }
        distance2 <= self.reach2 * (1.0 + 1e-9)
    }
}

/// Bits that increase with the angle of a direction, computed in floating point.
fn key(line: &Line) -> u64 {
    let [x, y] = line.line;
    let part = y / (x.abs() + y.abs());
    let turned = if x >= 0.0 { part } else { 2.0 - part };
    // A value from one to five; arbitrary for a line without direction.
    (turned + 2.0).to_bits()
}

#[cfg(test)]
mod tests;
