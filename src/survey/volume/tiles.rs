//! The division of a plan into tiles, each with about as many vertices as the others.
//!
//! A fine grid counts the vertices. The grid is halved, by cells, until a part has few vertices: that is a tile. A
//! box belongs to the cells that it touches. The cell of the corner at which the common part of two boxes begins
//! belongs to both of them, so of all tiles that have both boxes exactly one has that cell, and finds the pair.

/// Cells on each side of the grid: two of them are less than the side of a tile in meshes of 400 M triangles.
const SIDE: usize = 512;

/// Vertices of a tile: its triangles take about 3 MB, so that several tiles fit the least budget.
const FULL: u64 = 1 << 14;

type P2 = [f64; 2];

/// A grid over a box of the plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    low: P2,
    /// Cells in a unit of length.
    per_unit: P2,
    side: [usize; 2],
}

impl Grid {
    pub fn new([low, high]: [P2; 2], side: [usize; 2]) -> Self {
        let per_unit = [0, 1].map(|axis| {
            let length = high[axis] - low[axis];
            match length > 0.0 {
                true => side[axis] as f64 / length,
                false => 0.0,
            }
        });
        Self {
            low,
            per_unit,
            side,
        }
    }

    /// The cell of a position, the nearest one for those outside. It never decreases where a coordinate grows.
    pub fn cell(&self, at: P2) -> [usize; 2] {
        [0, 1].map(|axis| {
            // The cast takes what is below 0 to 0.
            let cell = ((at[axis] - self.low[axis]) * self.per_unit[axis]) as usize;
            cell.min(self.side[axis] - 1)
        })
    }
}

#[derive(Debug, Clone, Copy)]
enum Part {
    Tile(u32),
    /// The axis, the first cell of the other half, and the number of the first half; the other follows.
    Halves(u8, u16, u32),
}

/// Counts of vertices, by the cells of a grid.
pub(crate) struct Counts {
    grid: Grid,
    counts: Vec<u64>,
}

impl Counts {
    /// Bytes of counts, and of their sums.
    pub const BYTES: u64 = (SIDE * SIDE * size_of::<u64>()) as u64;

    pub fn new(bounds: [P2; 2]) -> Self {
        Self {
            grid: Grid::new(bounds, [SIDE, SIDE]),
            counts: vec![0; SIDE * SIDE],
        }
    }

    /// Counts a vertex.
    pub fn add(&mut self, at: P2) {
        let [x, y] = self.grid.cell(at);
        self.counts[y * SIDE + x] += 1;
    }

    pub fn join(&mut self, other: &Self) {
        let pairs = self.counts.iter_mut().zip(&other.counts);
        pairs.for_each(|(sum, more)| *sum += more);
    }

    /// The tiles.
    pub fn tiles(self) -> Tiles {
        let side = SIDE + 1;
        let mut sums = vec![0; side * side];
        for y in 0..SIDE {
            let mut row = 0;
            for x in 0..SIDE {
                row += self.counts[y * SIDE + x];
                sums[(y + 1) * side + x + 1] = sums[y * side + x + 1] + row;
            }
        }
        let mut tiles = Tiles {
            grid: self.grid,
            parts: vec![Part::Tile(0)],
            boxes: Vec::new(),
        };
        tiles.divide(0, [[0, 0], [SIDE, SIDE]], &sums);
        tiles
    }
}

/// The tiles of a plan.
pub(crate) struct Tiles {
    grid: Grid,
    parts: Vec<Part>,
    /// The first cell of each tile, and the cell behind its last.
    boxes: Vec<[[u16; 2]; 2]>,
}

impl Tiles {
    /// Most bytes: each cell a tile of its own.
    pub const BYTES: u64 =
        (SIDE * SIDE * (2 * size_of::<Part>() + size_of::<[[u16; 2]; 2]>())) as u64;

    fn divide(&mut self, part: usize, cells: [[usize; 2]; 2], sums: &[u64]) {
        let [low, high] = cells;
        let at = |x: usize, y: usize| sums[y * (SIDE + 1) + x];
        let count = |[[ax, ay], [bx, by]]: [[usize; 2]; 2]| {
            at(bx, by) + at(ax, ay) - at(ax, by) - at(bx, ay)
        };
        let lengths = [high[0] - low[0], high[1] - low[1]];
        let axis = usize::from(lengths[1] > lengths[0]);
        let all = count(cells);
        if all <= FULL || lengths[axis] == 1 {
            self.parts[part] = Part::Tile(self.boxes.len() as u32);
            self.boxes.push(cells.map(|cell| cell.map(|at| at as u16)));
            return;
        }
        let (mut first, mut second) = (cells, cells);
        // Half of the vertices each, or one cell at least.
        let mut cut = (low[axis] + 1, high[axis] - 1);
        while cut.0 < cut.1 {
            let middle = usize::midpoint(cut.0, cut.1);
            first[1][axis] = middle;
            match count(first) * 2 < all {
                true => cut.0 = middle + 1,
                false => cut.1 = middle,
            }
        }
        (first[1][axis], second[0][axis]) = (cut.0, cut.0);
        let number = self.parts.len();
        self.parts[part] = Part::Halves(axis as u8, cut.0 as u16, number as u32);
        self.parts.extend([Part::Tile(0); 2]);
        self.divide(number, first, sums);
        self.divide(number + 1, second, sums);
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.boxes.len()
    }

    /// Calls `each` with the tiles that a box touches.
    pub fn for_each(&self, [low, high]: [P2; 2], mut each: impl FnMut(u32)) {
        self.visit(0, [self.grid.cell(low), self.grid.cell(high)], &mut each);
    }

    fn visit(&self, part: usize, cells: [[usize; 2]; 2], each: &mut impl FnMut(u32)) {
        match self.parts[part] {
            Part::Tile(number) => each(number),
            Part::Halves(axis, at, first) => {
                let (axis, at, first) = (usize::from(axis), usize::from(at), first as usize);
                if cells[0][axis] < at {
                    self.visit(first, cells, each);
                }
                if cells[1][axis] >= at {
                    self.visit(first + 1, cells, each);
                }
            }
        }
    }

    /// True if a position belongs to the tile.
    pub fn has(&self, tile: usize, at: P2) -> bool {
        let ([low, high], cell) = (self.boxes[tile], self.grid.cell(at));
        (0..2).all(|axis| (low[axis].into()..high[axis].into()).contains(&cell[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_position_belongs_to_one_tile() {
        let mut counts = Counts::new([[0.0, 0.0], [10.0, 4.0]]);
        // Many at one place, some everywhere.
        for k in 0..100_000 {
            let spread = f64::from(k % 317) / 317.0;
            counts.add([10.0 * spread * spread, f64::from(k % 211) / 211.0 * 4.0]);
            counts.add([7.0, 3.0]);
        }
        let tiles = counts.tiles();
        assert!(tiles.count() > 8, "{}", tiles.count());
        for k in 0..1000 {
            let at = [f64::from(k % 40) / 3.0 - 1.0, f64::from(k / 40) / 5.0 - 0.5];
            let owners = (0..tiles.count()).filter(|tile| tiles.has(*tile, at));
            let owners: Vec<_> = owners.collect();
            let mut found = Vec::new();
            tiles.for_each([at, at], |tile| found.push(tile as usize));
            assert_eq!(owners, found);
            assert_eq!(owners.len(), 1);
        }
        let mut all = Vec::new();
        tiles.for_each([[-1.0, -1.0], [20.0, 20.0]], |tile| all.push(tile));
        assert_eq!(all.len(), tiles.count());
    }
}
