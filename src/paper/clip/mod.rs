//! The restricted Voronoi cell of a point: its disk clipped by bisectors (paper, Algorithm 1).
//!
//! The polygon is two-dimensional, in a frame of the disk's plane. Its corners are kept in columns,
//! unordered, and linked into a ring; each stores the side that ends at it. Whether a new bisector cuts off a
//! corner is decided in floating point for all corners at once where a forward error bound allows
//! ([`crate::kernels::cut_corners`]), else exactly ([`super::predicate`]).

mod lines;
mod many;
mod rim;
mod scan;
mod touch;
pub mod wrap;

use super::plane::Normal;
use super::predicate::{Neighbor, cuts_corner, cuts_parallel};
use crate::kernels::eight::Eight;
use crate::kernels::{
    CornerGroup, Frame, LANES, Level, Line, bisectors_body, farthest_body, kernel, touching_body,
};
use lines::{Corner, error_of_meeting, frame, meet};
use many::{MANY, Many};
use rim::{RIM, RIM_CORNERS, RIM_DISTANCE, RIM_PLACES, RIM_SIDES};
pub use touch::Spheres;

/// Id of a side that belongs to the disk's rim instead of a bisector.
const RIM_ID: u32 = u32::MAX;

/// A side of the polygon.
#[derive(Debug, Clone, Copy)]
struct Side {
    line: Line,
    neighbor: Neighbor,
}

/// Neighbours of a cell's point in columns, in ascending order of distance.
#[derive(Debug, Clone, Copy)]
pub struct Nearest<'a> {
    /// Squared distances.
    pub distances2: &'a [u64],
    /// Ids.
    pub ids: &'a [u32],
    /// Differences to the cell's point along x.
    pub x: &'a [i32],
    /// Along y.
    pub y: &'a [i32],
    /// Along z.
    pub z: &'a [i32],
}

/// A restricted Voronoi cell under construction. One value can be reused for many cells.
#[derive(Debug, Clone)]
pub struct Cell {
    level: Level,
    own: u32,
    normal: Normal,
    frame: Frame,
    /// All sides so far, including those no longer part of the polygon; those of the rim come first.
    sides: Vec<Side>,
    corners: Vec<CornerGroup>,
    /// For each corner, the next corner around the polygon and the side between it and the previous one.
    links: Vec<Link>,
    /// Unused places in the columns.
    free: Vec<u32>,
    count: usize,
    /// One corner of the ring.
    head: u32,
    cut: Vec<u64>,
    doubt: Vec<u64>,
    /// The largest `reach2` of the corners.
    reach2: f64,
    /// Four times `reach2`, rounded up.
    secure2: u64,
    hidden: bool,
    /// True if a corner on the rim was decided by uncertain floating point.
    unsure: bool,
    /// The index of a cell of many corners.
    many: Option<Box<Many>>,
    /// Cells with more corners use the index.
    most: usize,
    #[cfg(test)]
    looks: usize,
}

#[derive(Debug, Clone, Copy, Default)]
struct Link {
    next: u32,
    before: u32,
    side: u32,
}

impl Cell {
    /// The whole disk of point `own`: `radius` in steps, in the plane with `normal`.
    #[must_use]
    pub fn new(own: u32, normal: Normal, radius: f64) -> Self {
        let rim = |line| Side {
            line: Line {
                line,
                offset: 0.0,
                length: 1.0,
            },
            neighbor: Neighbor {
                difference: [0; 3],
                id: RIM_ID,
            },
        };
        let mut cell = Self {
            level: Level::best(),
            own,
            normal,
            frame: [[0.0; 3]; 2],
            sides: RIM_SIDES.map(rim).to_vec(),
            corners: Vec::new(),
            links: Vec::new(),
            free: Vec::new(),
            count: 0,
            head: 0,
            cut: Vec::new(),
            doubt: Vec::new(),
            reach2: 0.0,
            secure2: 0,
            hidden: false,
            unsure: false,
            many: None,
            most: MANY,
            #[cfg(test)]
            looks: 0,
        };
        cell.start(own, normal, radius);
        cell
    }

    /// Starts a new cell in the same memory.
    pub fn start(&mut self, own: u32, normal: Normal, radius: f64) {
        self.own = own;
        self.normal = normal;
        self.frame = frame(normal);
        self.hidden = false;
        self.unsure = false;
        if self.many.is_some() {
            self.forget_many();
        }
        self.sides.truncate(RIM_CORNERS);
        for side in &mut self.sides {
            side.line.offset = radius * RIM_DISTANCE;
        }
        self.count = RIM_CORNERS;
        self.head = 0;
        self.corners.clear();
        self.corners
            .extend(RIM.corners.iter().map(|unit| CornerGroup {
                x: unit.x.map(|x| x * radius),
                y: unit.y.map(|y| y * radius),
                error: unit.error.map(|e| e * radius),
                reach2: unit.reach2.map(|r| r * radius * radius),
            }));
        self.links.clear();
        self.links.extend_from_slice(&RIM.links);
        self.cut.resize(RIM_PLACES.div_ceil(64), 0);
        self.doubt.resize(RIM_PLACES.div_ceil(64), 0);
        self.free.clear();
        self.free
            .extend((RIM_CORNERS as u32..RIM_PLACES as u32).rev());
        self.set_reach(RIM.corners[0].reach2[0] * radius * radius);
    }

    #[inline(always)]
    fn set_reach(&mut self, reach2: f64) {
        self.reach2 = reach2;
        self.secure2 = secure2(reach2);
    }

    /// Number of places for corners, used or not.
    fn places(&self) -> usize {
        self.corners.len() * LANES
    }

    /// Increases the number of places, a multiple of [`LANES`], to `places`; lower ones are used first.
    fn grow(&mut self, places: usize) {
        let before = self.places() as u32;
        self.corners.resize(places / LANES, CornerGroup::default());
        self.links.resize(places, Link::default());
        self.cut.resize(places.div_ceil(64), 0);
        self.doubt.resize(places.div_ceil(64), 0);
        self.free.extend((before..places as u32).rev());
    }

    #[inline(always)]
    fn corner(&self, k: usize) -> Corner {
        let (group, k) = (&self.corners[k / LANES], k % LANES);
        Corner {
            at: [group.x[k], group.y[k]],
            error: group.error[k],
            reach2: group.reach2[k],
        }
    }

    #[inline(always)]
    fn set_corner<E: Eight>(&mut self, k: usize, corner: Corner) {
        let (group, k) = (&mut self.corners[k / LANES], k % LANES);
        E::put(&mut group.x, k, corner.at[0]);
        E::put(&mut group.y, k, corner.at[1]);
        E::put(&mut group.error, k, corner.error);
        E::put(&mut group.reach2, k, corner.reach2);
    }

    /// Points at a larger squared distance cannot touch the cell: four times the squared radius of security,
    /// rounded up.
    #[must_use]
    #[inline]
    pub fn reach2(&self) -> u64 {
        self.secure2
    }

    /// Clips by the bisector of the point `id`, at `difference` from this cell's point.
    pub fn clip(&mut self, difference: [i64; 3], id: u32) {
        // Differences of coordinates in 0..2^30 fit 32 bits.
        let [x, y, z] = difference.map(|c| [c as i32]);
        let near = Nearest {
            distances2: &[0],
            ids: &[id],
            x: &x,
            y: &y,
            z: &z,
        };
        clip_nearest(self.level, self, near, 0);
    }

    /// Clips by the bisectors of neighbours, nearest first, from index `next` until one cannot touch the
    /// cell. Returns the index of that one, or the number of neighbours.
    pub fn clip_nearest(&mut self, near: Nearest<'_>, next: usize) -> usize {
        clip_nearest(self.level, self, near, next)
    }

    #[inline(always)]
    fn clip_line<E: Eight>(&mut self, line: Line, neighbor: Neighbor) {
        if self.shares_place(&neighbor) {
            return;
        }
        let side = Side { line, neighbor };
        if let Some((first, last)) = self.scan::<E>(&side) {
            self.replace::<E>(first, last, side);
            self.set_reach(farthest_body::<E>(&self.corners));
        }
    }

    /// True for a point at the same position, which has no bisector.
    #[inline(always)]
    fn shares_place(&mut self, neighbor: &Neighbor) -> bool {
        let same = neighbor.difference == [0; 3];
        // Of points at one position, the one with the lowest id (the largest weight) has the cell.
        self.hidden |= same && neighbor.id < self.own;
        same
    }

    /// True if `side` cuts off corner `k`, decided exactly; `None` for a corner on the rim.
    fn cuts(&self, k: usize, side: &Side) -> Option<bool> {
        let [a, b] = self.sides_at(k).map(|side| side.neighbor);
        let c = side.neighbor;
        match (a.id == RIM_ID, b.id == RIM_ID) {
            (false, false) => Some(cuts_corner(self.normal, self.own, a, b, c)),
            (true, true) => None,
            (a_is_rim, _) => {
                let other = if a_is_rim { b } else { a };
                cuts_parallel(self.normal, self.own, other, c)
            }
        }
    }

    /// True if the sign of the depth of corner `k` is certain although it is within the general bound. That
    /// bound is far too large where the lengths of the corner's two lines differ, as those of the rim and of
    /// bisectors do.
    fn is_certain(&self, k: usize, side: &Side) -> bool {
        let [a, b] = self.sides_at(k).map(|side| &side.line);
        let [x, y] = self.corner(k).at;
        let bound = side.line.bound(x, y, error_of_meeting(a, b, [x, y]));
        self.depth(k, side).abs() > bound
    }

    /// The sides before and after corner `k`.
    fn sides_at(&self, k: usize) -> [&Side; 2] {
        let next = self.links[k].next as usize;
        [k, next].map(|k| &self.sides[self.links[k].side as usize])
    }

    #[inline(always)]
    fn depth(&self, k: usize, side: &Side) -> f64 {
        let [x, y] = self.corner(k).at;
        side.line.depth(x, y)
    }

    /// Replaces the corners from `first` to `last`, and the sides between them, by `side`. Returns the corner
    /// at which it ends.
    #[inline(always)]
    fn replace<E: Eight>(&mut self, first: u32, last: u32, side: Side) -> u32 {
        let start = self.links[first as usize];
        let end = self.links[last as usize];
        let mut gone = first;
        while gone != last {
            gone = self.links[gone as usize].next;
            self.set_corner::<E>(gone as usize, Corner::default());
            self.free.push(gone);
            self.count -= 1;
        }
        let into = self.links[end.next as usize].side;
        let entry = meet(&self.sides[start.side as usize].line, &side.line);
        let exit = meet(&side.line, &self.sides[into as usize].line);
        // The side before the run now ends at its intersection with the new side, and the new side at its
        // intersection with the side after the run.
        self.set_corner::<E>(first as usize, entry);
        let second = self.free_place();
        self.set_corner::<E>(second as usize, exit);
        self.links[second as usize] = Link {
            next: end.next,
            before: first,
            side: self.sides.len() as u32,
        };
        self.links[end.next as usize].before = second;
        self.links[first as usize].next = second;
        self.count += 1;
        self.head = first;
        self.sides.push(side);
        second
    }

    fn free_place(&mut self) -> u32 {
        if self.free.is_empty() {
            self.grow(self.places() + LANES);
        }
        self.free.pop().unwrap_or_default()
    }

    /// The places of the corners, in order around the cell.
    fn ring(&self) -> impl Iterator<Item = usize> + '_ {
        let first = self.head;
        std::iter::successors(Some(first), move |k| {
            let next = self.links[*k as usize].next;
            (next != first).then_some(next)
        })
        .map(|k| k as usize)
    }

    /// Calls `each` with the ids of the two bisectors at every corner between bisectors, in order around the
    /// cell. With the cell's own id these are its triples.
    pub fn triples(&self, mut each: impl FnMut(u32, u32)) {
        if self.hidden {
            return;
        }
        for k in self.ring() {
            let [a, b] = self.sides_at(k).map(|side| side.neighbor.id);
            if a != RIM_ID && b != RIM_ID {
                each(a, b);
            }
        }
    }
}

/// The squared distance beyond which no point touches a cell whose corners have at most the squared distance
/// `reach2`: four times as much, rounded up.
#[inline(always)]
fn secure2(reach2: f64) -> u64 {
    // The conversion saturates for disks larger than any cloud.
    ((4.0 * reach2 * (1.0 + 1e-9)) as u64).saturating_add(1)
}

kernel! {
    /// See [`Cell::clip_nearest`].
    fn clip_nearest(cell: &mut Cell, near: Nearest<'_>, next: usize) -> usize = clip_nearest_body<Eight>
}

#[inline(always)]
fn clip_nearest_body<E: Eight>(cell: &mut Cell, near: Nearest<'_>, mut next: usize) -> usize {
    let count = near.distances2.len();
    // After eight bisectors without effect, most of the following have none.
    let mut quiet = false;
    while next < count {
        if cell.count > cell.most || cell.many.is_some() {
            next = cell.clip_many(near, next);
            if next == count {
                break;
            }
        }
        let group = next..(next + LANES).min(count);
        let (x, y) = (&near.x[group.clone()], &near.y[group.clone()]);
        let z = &near.z[group.clone()];
        let lines = bisectors_body::<E>(x, y, z, &cell.frame);
        let sides = cell.sides.len();
        let touching = match quiet && near.distances2[group.end - 1] <= cell.secure2 {
            true => touching_body::<E>(&cell.corners, &lines),
            false => 0xff,
        };
        for (k, number) in group.enumerate() {
            if near.distances2[number] > cell.secure2 {
                return number;
            }
            if touching >> k & 1 == 0 && cell.sides.len() == sides {
                next += 1;
                continue;
            }
            let difference = [i64::from(x[k]), i64::from(y[k]), i64::from(z[k])];
            let id = near.ids[number];
            cell.clip_line::<E>(lines.get(k), Neighbor { difference, id });
            next += 1;
        }
        quiet = cell.sides.len() == sides;
    }
    next
}

#[cfg(test)]
mod tests;
