//! Contours: lines of equal height, by marching squares between the middles of cells.
//!
//! A place between two neighbouring cells belongs to a line where the height passes a level, by linear
//! interpolation. Of the two ways through a square whose opposite corners are high, the mean of its corners decides.
//! Squares with a corner without a height have no lines. (The crate `contour` does the same with the whole raster in
//! memory, in double precision.) The higher ground is on the right of a line.

use super::INTERVAL;
use super::cells::{Cell, Level, TILE_BYTES};
use super::grid::{Grid, TILE};
use super::lines::{Done, Gate, Lines};
use super::output::Output;
use super::report::Contours;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use std::fmt::Write;
use std::path::Path;

/// Most levels between the lowest height and the highest.
const MOST_LEVELS: f64 = 1e5;

/// Refuses an interval that makes no sense, or too many levels.
pub(super) fn check(interval: f64, [lowest, highest]: [f32; 2]) -> Result<()> {
    let levels = f64::from(highest - lowest) / interval;
    let farthest = f64::from(highest.abs().max(lowest.abs())) / interval;
    if interval.is_finite() && interval > 0.0 && levels <= MOST_LEVELS && farthest < 1e15 {
        return Ok(());
    }
    Err(Error::Parameter {
        name: INTERVAL,
        found: interval.to_string(),
        expected: "a length above 0 that makes at most 100000 levels".into(),
    })
}

/// Lines of equal height as GeoJSON.
pub(super) struct Map<'a> {
    pub grid: &'a Grid,
    pub interval: f64,
    /// Code of EPSG.
    pub system: Option<u32>,
}

impl Map<'_> {
    /// Writes a file.
    pub fn write(&self, path: &Path, level: &Level, workspace: &Workspace) -> Result<Contours> {
        let columns = level.columns as usize;
        let bytes = ((TILE + 1) * columns * size_of::<f32>()) as u64 + TILE_BYTES;
        let _held = workspace.reserve("raster: rows of cells", bytes)?;
        let mut sweep = Sweep {
            map: self,
            lines: Lines::new(workspace.reserve("raster: lines", 0)?),
            writer: Writer::create(path, self)?,
        };
        let (unit, [across, down]) = (workspace.unit(), level.tiles());
        let observer = &workspace.observer;
        observer.begin("contours", "rows", level.rows.into());
        let (mut cells, mut last) = (Vec::<Cell>::new(), Vec::<f32>::new());
        let mut band = vec![f32::NAN; TILE * columns];
        for tile_row in 0..down {
            for tile in 0..across {
                level.read(&unit, tile_row * across + tile, &mut cells)?;
                for (row, line) in cells.chunks_exact(TILE).enumerate() {
                    let begin = row * columns + tile * TILE;
                    let width = TILE.min(columns - tile * TILE);
                    let heights = line[..width].iter().map(|cell| cell.height);
                    let target = &mut band[begin..begin + width];
                    target.iter_mut().zip(heights).for_each(|(to, h)| *to = h);
                }
            }
            let rows = TILE.min(level.rows as usize - tile_row * TILE);
            for (at, line) in band.chunks_exact(columns).take(rows).enumerate() {
                let row = (tile_row * TILE + at) as u32;
                if row > 0 {
                    sweep.row(row - 1, [&last, line])?;
                }
                last.clear();
                last.extend_from_slice(line);
            }
            observer.advance(rows as u64);
            workspace.check_cancel()?;
        }
        sweep.end(level.rows)?;
        observer.end();
        sweep.writer.finish(path, self.interval)
    }
}

struct Sweep<'a> {
    map: &'a Map<'a>,
    lines: Lines,
    writer: Writer,
}

impl Sweep<'_> {
    /// Visits the squares between two rows of cells.
    fn row(&mut self, row: u32, heights: [&[f32]; 2]) -> Result<()> {
        let [upper, lower] = heights;
        let corners = upper.windows(2).zip(lower.windows(2));
        for (column, (top, bottom)) in corners.enumerate() {
            // Clockwise from the north-western one.
            let square = [top[0], top[1], bottom[1], bottom[0]].map(f64::from);
            let low = square.iter().copied().fold(f64::INFINITY, f64::min);
            let high = square.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if square.iter().any(|height| height.is_nan()) {
                continue;
            }
            let first = (low / self.map.interval).floor() as i64;
            let last = (high / self.map.interval).ceil() as i64;
            for level in first..=last {
                self.square([column as u32, row], &square, level)?;
            }
        }
        self.end(row + 1)
    }

    fn square(&mut self, place: [u32; 2], square: &[f64; 4], level: i64) -> Result<()> {
        let height = level as f64 * self.map.interval;
        let is_high = square.map(|corner| corner >= height);
        // Side k lies between corners k and k + 1. A line enters where the ground falls, clockwise.
        let falls = |k: usize| is_high[k] && !is_high[(k + 1) % 4];
        let rises = |k: usize| !is_high[k] && is_high[(k + 1) % 4];
        let count = (0..4).filter(|k| falls(*k)).count();
        for from in (0..4).filter(|k| falls(*k)) {
            let is_middle_high = square.iter().sum::<f64>() / 4.0 >= height;
            let to = match (count, is_middle_high) {
                (2, true) => (from + 1) % 4,
                (2, false) => (from + 3) % 4,
                _ => (0..4).find(|k| rises(*k)).unwrap_or(from),
            };
            let ways = [from, to].map(|side| self.gate(place, square, side, level));
            let [a, b] = ways;
            if let Some(done) = self.lines.add([a.0, b.0], [a.1, b.1])? {
                self.writer.line(self.map, &done)?;
            }
        }
        Ok(())
    }

    /// The gate at a side of a square, and the position of the line there.
    fn gate(
        &self,
        [column, row]: [u32; 2],
        square: &[f64; 4],
        side: usize,
        level: i64,
    ) -> (Gate, [f64; 2]) {
        // The cells of the side, from west to east or from north to south.
        let (first, second, at, is_down) = match side {
            0 => (0, 1, [column, row], false),
            1 => (1, 2, [column + 1, row], true),
            2 => (3, 2, [column, row + 1], false),
            _ => (0, 3, [column, row], true),
        };
        let height = level as f64 * self.map.interval;
        let share = (height - square[first]) / (square[second] - square[first]);
        let mut place = at.map(f64::from);
        place[usize::from(is_down)] += share.clamp(0.0, 1.0);
        let gate = Gate {
            row: at[1],
            is_down,
            column: at[0],
            level,
        };
        (gate, self.map.grid.middle_of_lengths(place))
    }

    /// Writes the lines that end above a row of cells.
    fn end(&mut self, row: u32) -> Result<()> {
        let done = self.lines.end_row(row);
        done.iter()
            .try_for_each(|done| self.writer.line(self.map, done))
    }
}

/// Writes GeoJSON.
struct Writer {
    file: Output,
    text: String,
    /// Digits of coordinates after the point: a thousandth of a cell.
    digits: usize,
    lines: u64,
    positions: u64,
}

impl Writer {
    fn create(path: &Path, map: &Map<'_>) -> Result<Self> {
        let mut text = String::from("{\"type\":\"FeatureCollection\",\"name\":\"contours\"");
        if let Some(code) = map.system {
            let name = format!("urn:ogc:def:crs:EPSG::{code}");
            let system =
                format!(",\"crs\":{{\"type\":\"name\",\"properties\":{{\"name\":\"{name}\"}}}}");
            text.push_str(&system);
        }
        text.push_str(",\"features\":[");
        Ok(Self {
            file: Output::create(path)?,
            text,
            digits: (3.0 - libm::log10(map.grid.cell)).ceil().clamp(0.0, 12.0) as usize,
            lines: 0,
            positions: 0,
        })
    }

    fn line(&mut self, map: &Map<'_>, done: &Done) -> Result<()> {
        // Multiples of an interval like 0.1 without the noise of binary numbers.
        let elevation = format!("{:.9}", done.level as f64 * map.interval);
        let elevation: f64 = elevation.parse().unwrap_or_default();
        let comma = if self.lines == 0 { "" } else { "," };
        let head = "{\"type\":\"Feature\",\"properties\":{\"elevation\":";
        let geometry = "},\"geometry\":{\"type\":\"LineString\",\"coordinates\":[";
        let _ = write!(self.text, "{comma}\n{head}{}{geometry}", elevation + 0.0);
        let digits = self.digits;
        for (number, [x, y]) in done.positions.iter().enumerate() {
            let comma = if number == 0 { "" } else { "," };
            let _ = write!(self.text, "{comma}[{x:.digits$},{y:.digits$}]");
        }
        self.text.push_str("]}}");
        self.lines += 1;
        self.positions += done.positions.len() as u64;
        self.file.write(self.text.as_bytes())?;
        self.text.clear();
        Ok(())
    }

    fn finish(mut self, path: &Path, interval: f64) -> Result<Contours> {
        self.text.push_str("\n]}\n");
        self.file.write(self.text.as_bytes())?;
        Ok(Contours {
            path: path.to_path_buf(),
            interval,
            lines: self.lines,
            positions: self.positions,
            bytes: self.file.finish()?,
        })
    }
}
