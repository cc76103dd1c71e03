//! Conservative tests whether boxes and points can touch a cell.

use super::{Cell, RIM_PLACES};
use crate::kernels::eight::Eight;
use crate::kernels::{LANES, Place, bisectors_body, kernel, touching_body, touching_places_body};
use outcrop_geom::Point;

/// Groups of spheres and places of corners in memory of fixed size; cells with more corners do without.
const GROUPS: usize = 2 * RIM_PLACES / LANES;

/// The spheres around the corners of a cell through its own point, relative to this point. A point cuts off
/// a corner only if it is nearer to the corner than the cell's own point.
#[derive(Debug)]
pub struct Spheres<'a> {
    cell: &'a Cell,
    groups: [SphereGroup; GROUPS],
    /// Number of groups; 0 if there are too many corners.
    used: usize,
}

/// Spheres in columns; a negative squared radius means none.
#[derive(Debug, Clone, Copy)]
struct SphereGroup {
    at: [[f64; LANES]; 3],
    /// Upper bounds on the squared radii.
    reach2: [f64; LANES],
}

impl SphereGroup {
    const NONE: Self = Self {
        at: [[0.0; LANES]; 3],
        reach2: [-1.0; LANES],
    };
}

impl Cell {
    /// Its spheres, for the tests of many boxes.
    #[must_use]
    pub fn spheres(&self) -> Spheres<'_> {
        let mut spheres = Spheres {
            cell: self,
            groups: [SphereGroup::NONE; GROUPS],
            used: 0,
        };
        if self.many.is_none() && self.count <= GROUPS * LANES {
            let [u, v] = self.frame;
            for (to, k) in self.ring().enumerate() {
                let (corner, group) = (self.corner(k), &mut spheres.groups[to / LANES]);
                for axis in 0..3 {
                    group.at[axis][to % LANES] = corner.at[0] * u[axis] + corner.at[1] * v[axis];
                }
                group.reach2[to % LANES] = corner.reach2 * (1.0 + 1e-9);
            }
            spheres.used = self.count.div_ceil(LANES);
        }
        spheres
    }

    /// As [`Spheres::meet`], for one box.
    pub(super) fn may_touch(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        if let Some(many) = &self.many {
            return many.may_touch(self, low, high);
        }
        let [u, v] = self.frame;
        self.ring().any(|k| {
            let corner = self.corner(k);
            let mut distance2 = 0.0;
            for axis in 0..3 {
                let x = corner.at[0] * u[axis] + corner.at[1] * v[axis];
                let gap = (low[axis] - x).max(x - high[axis]).max(0.0);
                distance2 += gap * gap;
            }
            distance2 <= corner.reach2 * (1.0 + 1e-9)
        })
    }

    /// Appends to `places` the places, in `columns`, of all points whose bisectors may cut off a corner;
    /// `own` is the cell's point. If the cell has many corners, many other points may be included.
    pub fn touching(&self, columns: [&[i32]; 3], own: Point, places: &mut Vec<u32>) {
        if self.many.is_some() {
            places.extend(0..columns[0].len() as u32);
        } else {
            touching(self.level, self, columns, own, places);
        }
    }
}

impl Spheres<'_> {
    /// False if no point in a box, given relative to the cell's point, can change the cell.
    #[must_use]
    pub fn meet(&self, low: [f64; 3], high: [f64; 3]) -> bool {
        match self.used {
            0 => self.cell.may_touch(low, high),
            used => meet(self.cell.level, &self.groups[..used], low, high),
        }
    }
}

kernel! {
    /// True if a sphere may meet the box.
    fn meet(spheres: &[SphereGroup], low: [f64; 3], high: [f64; 3]) -> bool = meet_body<Eight>
}

#[inline(always)]
fn meet_body<E: Eight>(spheres: &[SphereGroup], low: [f64; 3], high: [f64; 3]) -> bool {
    let zero = E::splat(0.0);
    for group in spheres {
        let mut distance2 = zero;
        for axis in 0..3 {
            let at = E::load(&group.at[axis]);
            let below = E::splat(low[axis]).sub(at);
            let above = at.sub(E::splat(high[axis]));
            let gap = below.larger(above).larger(zero);
            distance2 = distance2.add(gap.mul(gap));
        }
        if distance2.greater(E::load(&group.reach2)) != 0xff {
            return true;
        }
    }
    false
}

kernel! {
    /// See [`Cell::touching`].
    fn touching(cell: &Cell, columns: [&[i32]; 3], own: Point, places: &mut Vec<u32>) = touching_points_body<Eight>
}

#[inline(always)]
fn touching_points_body<E: Eight>(
    cell: &Cell,
    [x, y, z]: [&[i32]; 3],
    own: Point,
    places: &mut Vec<u32>,
) {
    let mut listed = [Place::default(); GROUPS * LANES];
    let count = Place::list(&cell.corners, &mut listed);
    for start in (0..x.len()).step_by(LANES) {
        let from = differences([x, y, z], start, own);
        let lines = bisectors_body::<E>(&from[0], &from[1], &from[2], &cell.frame);
        let mut touching = match count {
            Some(count) => touching_places_body::<E>(listed[..count].iter().copied(), &lines),
            None => touching_body::<E>(&cell.corners, &lines),
        };
        while touching != 0 {
            let place = start as u32 + touching.trailing_zeros();
            touching &= touching - 1;
            if (place as usize) < x.len() {
                places.push(place);
            }
        }
    }
}

/// The differences to `own` of up to [`LANES`] points from `start` on; zeros after the last point.
#[inline(always)]
pub(super) fn differences(columns: [&[i32]; 3], start: usize, own: Point) -> [[i32; LANES]; 3] {
    let group = start..(start + LANES).min(columns[0].len());
    let mut from = [[0; LANES]; 3];
    for ((from, column), own) in from.iter_mut().zip(columns).zip(own) {
        for (from, at) in from.iter_mut().zip(&column[group.clone()]) {
            *from = at.wrapping_sub(own);
        }
    }
    from
}
