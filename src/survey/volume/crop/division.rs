//! The division of a region by halves.

use super::slabs::{Trapezoid, slabs};
use outcrop_disk::error::{Error, Result};
use outcrop_geom::region::Area;

/// Edges in a cell that is not divided: the trapezoids of a cell grow with their square, cells with its inverse.
const FEW: usize = 8;

/// Most edges of a cell that is too small to be divided.
const MANY: usize = 64;

/// Most divisions by halves, one axis after the other: cells of 2^-24 of the box, where rounding begins to count.
pub(super) const DEEPEST: u32 = 48;

type P2 = [f64; 2];

#[derive(Debug, Clone, Copy)]
pub(super) enum Cell {
    Outside,
    Inside,
    /// Two halves: the axis, where it is divided, and the number of the first half; the other follows.
    Halves(usize, f64, usize),
    /// These trapezoids.
    Parts(usize, usize),
}

/// A region that is being divided.
pub(super) struct Division<'a> {
    pub contains: Area<'a>,
    pub origin: P2,
    pub cells: Vec<Cell>,
    pub parts: Vec<Trapezoid>,
    pub most_bytes: u64,
}

impl Division<'_> {
    /// Divides a cell with these edges, each of which may be in it.
    pub fn divide(
        &mut self,
        cell: usize,
        bounds: [P2; 2],
        edges: &[[P2; 2]],
        deep: u32,
    ) -> Result<()> {
        let [low, high] = bounds;
        if edges.is_empty() {
            let middle = [0, 1].map(|axis| low[axis] / 2.0 + high[axis] / 2.0);
            self.cells[cell] = match is_in(&self.contains, self.origin, middle) {
                true => Cell::Inside,
                false => Cell::Outside,
            };
            return Ok(());
        }
        let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
        let at = low[axis] / 2.0 + high[axis] / 2.0;
        let is_small = deep == 0 || at <= low[axis] || at >= high[axis];
        if edges.len() <= FEW || (is_small && edges.len() <= MANY) {
            let from = self.parts.len();
            let inside = |p| is_in(&self.contains, self.origin, p);
            slabs(bounds, edges, &inside, &mut self.parts);
            self.cells[cell] = Cell::Parts(from, self.parts.len());
            return self.check();
        }
        if is_small {
            return Err(entangled(format!("{} edges at one place", edges.len())));
        }
        let first = self.cells.len();
        self.cells[cell] = Cell::Halves(axis, at, first);
        self.cells.extend([Cell::Outside; 2]);
        self.check()?;
        let (mut ends, mut starts) = (bounds, bounds);
        (ends[1][axis], starts[0][axis]) = (at, at);
        for (number, half) in (first..).zip([ends, starts]) {
            let inside = edges.iter().filter(|edge| meets(edge, half));
            let inside: Vec<_> = inside.copied().collect();
            self.divide(number, half, &inside, deep - 1)?;
        }
        Ok(())
    }

    fn check(&self) -> Result<()> {
        let cells = self.cells.len() * size_of::<Cell>();
        let bytes = (cells + self.parts.len() * size_of::<Trapezoid>()) as u64;
        match bytes <= self.most_bytes {
            true => Ok(()),
            false => Err(entangled("polygons whose edges cross too often".into())),
        }
    }
}

/// True if a place, from the origin on, is in the region.
fn is_in(area: &Area<'_>, [ox, oy]: P2, [x, y]: P2) -> bool {
    area.contains([x + ox, y + oy, 0.0])
}

/// True if an edge may be in a box: not beside it, nor on one side of it.
fn meets([a, b]: &[P2; 2], [low, high]: [P2; 2]) -> bool {
    let beside = (0..2).any(|k| a[k].max(b[k]) < low[k] || a[k].min(b[k]) > high[k]);
    if beside {
        return false;
    }
    let side = |x: f64, y: f64| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    let sides = [
        side(low[0], low[1]),
        side(low[0], high[1]),
        side(high[0], low[1]),
        side(high[0], high[1]),
    ];
    // Rounding must not lose an edge.
    let room = 1e-12
        * ((b[0] - a[0]).abs() + (b[1] - a[1]).abs())
        * ((high[0] - low[0]) + (high[1] - low[1]));
    !(sides.iter().all(|s| *s > room) || sides.iter().all(|s| *s < -room))
}

fn entangled(found: String) -> Error {
    Error::Parameter {
        name: "crop",
        found,
        expected: "simpler polygons".into(),
    }
}
