//! The cells of a raster: squares whose sides lie at multiples of their length, in rows from north to south.

use super::CELL;
use outcrop_disk::error::{Error, Result};
use outcrop_geom::vector::V3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Cells on each side of a tile.
pub(super) const TILE: usize = 256;

/// Most columns, and most rows: the tables of tiles stay below 0.3 GB.
const MOST: f64 = (1u32 << 20) as f64;

/// Largest distance from the origin of coordinates, in cells: numbers of cells stay exact with their halves.
const FARTHEST: f64 = (1u64 << 50) as f64;

/// The cells of a raster.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Grid {
    /// Length of the sides of a cell.
    pub cell: f64,
    /// Lengths of a cell from the origin of coordinates to the western and to the northern side.
    first: [i64; 2],
    /// Cells in a row.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
}

impl Grid {
    /// The cells that cover a box of the plan.
    pub fn around([low, high]: [[f64; 2]; 2], cell: f64) -> Result<Self> {
        let refuse = |found: String, expected: &str| {
            Err(Error::Parameter {
                name: CELL,
                found,
                expected: expected.into(),
            })
        };
        if !(cell.is_finite() && cell > 0.0) {
            return refuse(cell.to_string(), "a length above 0");
        }
        let [from, to] = [low, high].map(|corner| corner.map(|at| at / cell));
        let [west, south] = from.map(f64::floor);
        let [east, north] = to.map(f64::ceil);
        let farthest = [west, south, east, north].map(f64::abs);
        if farthest
            .iter()
            .any(|at| at.partial_cmp(&FARTHEST).is_none_or(|o| o.is_gt()))
        {
            return refuse(cell.to_string(), "longer sides: there are too many cells");
        }
        let sides = [(east - west).max(1.0), (north - south).max(1.0)];
        if sides.iter().any(|side| *side > MOST) {
            let found = format!("{cell}, which makes {} x {} cells", sides[0], sides[1]);
            return refuse(
                found,
                "longer sides: at most 1048576 cells in a row or a column",
            );
        }
        Ok(Self {
            cell,
            first: [west as i64, north.max(south + 1.0) as i64],
            columns: sides[0] as u32,
            rows: sides[1] as u32,
        })
    }

    /// The north-western corner.
    pub fn corner(&self) -> [f64; 2] {
        self.first.map(|lengths| lengths as f64 * self.cell)
    }

    /// The south-eastern corner.
    pub fn far_corner(&self) -> [f64; 2] {
        let [x, y] = self.first;
        let far = [x + i64::from(self.columns), y - i64::from(self.rows)];
        far.map(|lengths| lengths as f64 * self.cell)
    }

    /// Column and row of the cell with a position, the nearest one for those outside.
    pub fn place(&self, at: [f64; 2]) -> [u32; 2] {
        let [x, y] = at.map(|at| at / self.cell);
        let column = x.floor() as i64 - self.first[0];
        let row = self.first[1] - y.ceil() as i64;
        [(column, self.columns), (row, self.rows)]
            .map(|(at, count)| at.clamp(0, i64::from(count) - 1) as u32)
    }

    /// The middle of a cell.
    pub fn middle(&self, [column, row]: [u32; 2]) -> [f64; 2] {
        self.middle_of_lengths([f64::from(column), f64::from(row)])
    }

    /// The same for places between the middles of cells.
    pub fn middle_of_lengths(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.first.map(|lengths| lengths as f64);
        [(x + column + 0.5) * self.cell, (y - row - 0.5) * self.cell]
    }

    /// Columns and rows of the cells whose middles are in a box, given from `origin` on.
    pub fn middles_in(&self, [low, high]: [[f64; 2]; 2], origin: V3) -> [Range<u32>; 2] {
        let x = |column| self.middle([column, 0])[0] - origin[0];
        let south = |row| origin[1] - self.middle([0, row])[1];
        [
            span([low[0], high[0]], self.columns, self.cell, x),
            span([-high[1], -low[1]], self.rows, self.cell, south),
        ]
    }

    /// The number of a cell's tile, and that of the cell in it.
    pub fn tile_of(&self, [column, row]: [u32; 2]) -> [u32; 2] {
        let side = TILE as u32;
        let across = self.columns.div_ceil(side);
        [
            row / side * across + column / side,
            row % side * side + column % side,
        ]
    }
}

/// The numbers up to `count` whose places, which ascend by `step`, are in an interval.
fn span([low, high]: [f64; 2], count: u32, step: f64, at: impl Fn(u32) -> f64) -> Range<u32> {
    let guess = |place: f64| ((place - at(0)) / step).clamp(0.0, f64::from(count)) as u32;
    let mut first = guess(low);
    while first > 0 && at(first - 1) >= low {
        first -= 1;
    }
    while first < count && at(first) < low {
        first += 1;
    }
    let mut end = guess(high).max(first);
    while end < count && at(end) <= high {
        end += 1;
    }
    while end > first && at(end - 1) > high {
        end -= 1;
    }
    first..end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_lie_at_multiples_of_their_length() {
        let grid = Grid::around([[10.2, -3.9], [12.0, 1.1]], 0.5).unwrap();
        assert_eq!((grid.columns, grid.rows), (4, 11));
        assert_eq!(
            (grid.corner(), grid.far_corner()),
            ([10.0, 1.5], [12.0, -4.0])
        );
        assert_eq!(grid.middle([0, 0]), [10.25, 1.25]);
        assert_eq!(grid.place([10.25, 1.25]), [0, 0]);
        assert_eq!(grid.place([12.0, -4.0]), [3, 10]);
        assert_eq!(grid.place([1e9, -1e9]), [3, 10]);
        let [columns, rows] = grid.middles_in([[0.25, 0.0], [0.75, 0.3]], [10.0, 0.0, 0.0]);
        assert_eq!((columns, rows), (0..2, 2..3));
    }

    #[test]
    fn a_place_without_extent_has_one_cell() {
        let grid = Grid::around([[3.0, 3.0], [3.0, 3.0]], 1.0).unwrap();
        assert_eq!((grid.columns, grid.rows), (1, 1));
        assert_eq!(grid.place([3.0, 3.0]), [0, 0]);
    }

    #[test]
    fn cells_that_are_too_short_are_refused() {
        for cell in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e-5] {
            let grid = Grid::around([[0.0, 0.0], [100.0, 100.0]], cell);
            assert!(matches!(grid, Err(Error::Parameter { .. })), "{cell}");
        }
    }
}
