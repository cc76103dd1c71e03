//! Conservative tests whether boxes and points can touch a cell.

use super::Cell;
use crate::geom::Point;
use crate::kernels::eight::Eight;
use crate::kernels::{LANES, bisectors_body, kernel, touching_body};

impl Cell {
    /// False if no point in a box, given relative to the cell's point, can change the cell. A point cuts off
    /// a corner only if it is nearer to the corner than the cell's own point.
    #[must_use]
    pub fn may_touch(&self, low: [f64; 3], high: [f64; 3]) -> bool {
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
    for start in (0..x.len()).step_by(LANES) {
        let group = start..(start + LANES).min(x.len());
        let mut from = [[0; LANES]; 3];
        for ((from, column), own) in from.iter_mut().zip([x, y, z]).zip(own) {
            for (from, at) in from.iter_mut().zip(&column[group.clone()]) {
                *from = at.wrapping_sub(own);
            }
        }
        let lines = bisectors_body::<E>(&from[0], &from[1], &from[2], &cell.frame);
        let mut touching = touching_body::<E>(&cell.corners, &lines);
        while touching != 0 {
            let place = start as u32 + touching.trailing_zeros();
            touching &= touching - 1;
            if (place as usize) < group.end {
                places.push(place);
            }
        }
    }
}
