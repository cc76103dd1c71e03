//! The cells of a raster in tiles, and the same with cells of twice the length, four times, and so on.

use super::grid::{Grid, TILE};
use super::samples::Samples;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, row};
use outcrop_disk::workspace::{Unit, Workspace, lock};
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// Cells of a tile.
pub(super) const CELLS: usize = TILE * TILE;

/// Bytes of the cells of a tile.
pub(super) const TILE_BYTES: u64 = (CELLS * size_of::<Cell>()) as u64;

row! {
    /// A cell; NaN is its height if it has none.
    pub(super) struct Cell {
        /// The height.
        height: f32,
        /// Red, green and blue, the highest byte 0.
        colour: u32,
    }
    unpacked
}

impl Cell {
    /// A cell without a height.
    pub const NONE: Self = Self {
        height: f32::NAN,
        colour: 0,
    };
}

/// The cells of one length.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Level {
    pub columns: u32,
    pub rows: u32,
    /// Section = tile; tiles without a height have none.
    cells: Table<Cell>,
}

/// The number of cells with a height, and the range of their heights.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Found {
    /// Cells with a height.
    pub cells: u64,
    /// The lowest height and the highest.
    pub heights: [f32; 2],
}

/// Tiles in a row of tiles, and rows of tiles, of a raster with these columns and rows.
fn tiles(sides: [u32; 2]) -> [usize; 2] {
    sides.map(|count| (count as usize).div_ceil(TILE))
}

impl Level {
    fn new(number: usize, [columns, rows]: [u32; 2]) -> Self {
        let [across, down] = tiles([columns, rows]);
        let (name, count) = (format!("raster.cells{number}"), across * down);
        Self {
            columns,
            rows,
            cells: match number {
                0 => Table::new(&name, count),
                _ => Table::temporary(&name, count),
            },
        }
    }

    /// Deletes the cells.
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.cells.release(workspace)
    }

    /// Tiles in a row of tiles, and rows of tiles.
    pub fn tiles(&self) -> [usize; 2] {
        tiles([self.columns, self.rows])
    }

    pub fn count(&self) -> usize {
        let [across, down] = self.tiles();
        across * down
    }

    /// Reads a tile.
    pub fn read(&self, unit: &Unit<'_>, tile: usize, cells: &mut Vec<Cell>) -> Result<()> {
        self.cells.get_into(unit, tile, cells)?;
        cells.resize(CELLS, Cell::NONE);
        Ok(())
    }

    /// The cells of the raster, from its samples.
    pub fn of_samples(
        grid: &Grid,
        samples: Samples<'_>,
        unit: &Unit<'_>,
        workspace: &Workspace,
    ) -> Result<(Self, Found)> {
        let level = Self::new(0, [grid.columns, grid.rows]);
        let _held = workspace.reserve("raster: tile", TILE_BYTES)?;
        let mut found = Found {
            cells: 0,
            heights: [f32::INFINITY, f32::NEG_INFINITY],
        };
        let (mut cells, mut tile) = (vec![Cell::NONE; CELLS], None);
        let scale = samples.scale;
        workspace.observer.begin("sort cells", "cells", 0);
        samples.for_each(workspace, |sample| {
            if let Some(done) = tile.filter(|tile| *tile != sample.tile) {
                level.cells.put(unit, done as usize, &cells)?;
                cells.fill(Cell::NONE);
                workspace.check_cancel()?;
            }
            tile = Some(sample.tile);
            let height = scale.height(sample) as f32;
            found.cells += 1;
            found.heights = [found.heights[0].min(height), found.heights[1].max(height)];
            cells[sample.cell as usize] = Cell {
                height,
                colour: sample.colour,
            };
            Ok(())
        })?;
        if let Some(last) = tile {
            level.cells.put(unit, last as usize, &cells)?;
        }
        workspace.observer.end();
        Ok((level, found))
    }

    /// The same with cells of twice the length; none if this level is one tile.
    pub fn halved(&self, number: usize, workspace: &Workspace) -> Result<Option<Self>> {
        if self.count() <= 1 {
            return Ok(None);
        }
        let sides = [self.columns, self.rows].map(|count| count.div_ceil(2));
        let level = Self::new(number, sides);
        let size = 2 * TILE_BYTES;
        let spare = Mutex::new(Vec::<[Vec<Cell>; 2]>::new());
        workspace.for_each_unit(
            "raster: overviews",
            level.count(),
            |_| size,
            |unit| {
                let _held = unit.hold(size);
                let [mut fine, mut coarse] = lock(&spare).pop().unwrap_or_default();
                let is_any = self.halve(unit, level.tiles()[0], &mut fine, &mut coarse)?;
                if is_any {
                    level.cells.put(unit, unit.number(), &coarse)?;
                }
                lock(&spare).push([fine, coarse]);
                unit.check_cancel()
            },
        )?;
        Ok(Some(level))
    }

    /// A tile of the next level; false if it has no height.
    fn halve(
        &self,
        unit: &Unit<'_>,
        across: usize,
        fine: &mut Vec<Cell>,
        coarse: &mut Vec<Cell>,
    ) -> Result<bool> {
        const HALF: usize = TILE / 2;
        let tile = unit.number();
        coarse.clear();
        coarse.resize(CELLS, Cell::NONE);
        let mut is_any = false;
        let [columns, rows] = self.tiles();
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let [column, row] = [tile % across * 2 + x, tile / across * 2 + y];
            if column >= columns || row >= rows {
                continue;
            }
            self.read(unit, row * columns + column, fine)?;
            for at in 0..HALF * HALF {
                let [left, top] = [at % HALF * 2, at / HALF * 2];
                let place = top * TILE + left;
                let four = [place, place + 1, place + TILE, place + TILE + 1];
                let cell = mean(four.map(|place| fine[place]));
                is_any |= !cell.height.is_nan();
                coarse[(y * HALF + at / HALF) * TILE + x * HALF + at % HALF] = cell;
            }
        }
        Ok(is_any)
    }
}

/// The mean of the cells with a height.
fn mean(cells: [Cell; 4]) -> Cell {
    let present = cells.iter().filter(|cell| !cell.height.is_nan());
    let count = present.clone().count() as u32;
    if count == 0 {
        return Cell::NONE;
    }
    let height: f64 = present.clone().map(|cell| f64::from(cell.height)).sum();
    let colours = present.map(|cell| cell.colour.to_be_bytes().map(u32::from));
    let sums = colours.fold([0; 4], |sum, c| [0, 1, 2, 3].map(|k| sum[k] + c[k]));
    Cell {
        height: (height / f64::from(count)) as f32,
        colour: u32::from_be_bytes(sums.map(|sum| ((sum + count / 2) / count) as u8)),
    }
}

/// A raster and its overviews, the finest first.
pub(super) fn pyramid(first: Level, workspace: &Workspace) -> Result<Vec<Level>> {
    let mut levels = vec![first];
    loop {
        let number = levels.len();
        match levels[number - 1].halved(number, workspace)? {
            Some(next) => levels.push(next),
            None => return Ok(levels),
        }
    }
}
