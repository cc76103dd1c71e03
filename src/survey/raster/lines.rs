//! Lines that grow segment by segment, while the squares of a raster are visited row by row.
//!
//! A segment is directed, and where a line leaves one square it enters the next. So each end of a line waits for one
//! segment, and lines are joined without being turned. A line leaves memory when it is closed, or when no square will
//! be visited any more that one of its ends touches.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::Reservation;
use rustc_hash::FxHashMap;
use std::collections::VecDeque;

type P2 = [f64; 2];

/// Bytes of a line and its place in the tables, without its positions.
const LINE: u64 = 256;

/// Bytes by which the reservation grows at least.
const STEP: u64 = 1 << 20;

/// A place where a line of a level passes from a square to the next: between two neighbouring cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Gate {
    /// Row of the first of the two cells.
    pub row: u32,
    /// True if the other cell is in the next row, and not in the next column.
    pub is_down: bool,
    /// Column of the first.
    pub column: u32,
    /// Number of the level.
    pub level: i64,
}

struct Line {
    positions: VecDeque<P2>,
    /// Where it begins and where it ends; none where no square is left.
    ends: [Option<Gate>; 2],
}

/// A whole line.
#[derive(Debug)]
pub(super) struct Done {
    pub level: i64,
    /// The first position is the last one too if the line is closed.
    pub positions: VecDeque<P2>,
}

/// The lines that are not yet whole.
pub(super) struct Lines {
    lines: Vec<Option<Line>>,
    free: Vec<usize>,
    /// By gate: the line, and 0 if it begins there, 1 if it ends there.
    open: FxHashMap<Gate, (usize, usize)>,
    /// Positions of all lines.
    positions: u64,
    held: Reservation,
}

impl Lines {
    pub fn new(held: Reservation) -> Self {
        Self {
            lines: Vec::new(),
            free: Vec::new(),
            open: FxHashMap::default(),
            positions: 0,
            held,
        }
    }

    /// Adds a segment from one gate to another; returns a line that it closes.
    pub fn add(&mut self, gates: [Gate; 2], ends: [P2; 2]) -> Result<Option<Done>> {
        let before = self.open.remove(&gates[0]);
        let after = self.open.remove(&gates[1]);
        match (before, after) {
            (Some((line, _)), Some((other, _))) if line == other => Ok(self.close(line)),
            (Some((line, _)), Some((other, _))) => {
                self.join(line, other);
                Ok(None)
            }
            (Some((line, _)), None) => self.grow((line, 1), gates[1], ends[1]),
            (None, Some((line, _))) => self.grow((line, 0), gates[0], ends[0]),
            (None, None) => self.begin(gates, ends),
        }
    }

    fn begin(&mut self, gates: [Gate; 2], ends: [P2; 2]) -> Result<Option<Done>> {
        self.count(2)?;
        let line = Line {
            positions: VecDeque::from(ends),
            ends: gates.map(Some),
        };
        let number = self.free.pop().unwrap_or_else(|| {
            self.lines.push(None);
            self.lines.len() - 1
        });
        self.lines[number] = Some(line);
        self.open.insert(gates[0], (number, 0));
        self.open.insert(gates[1], (number, 1));
        Ok(None)
    }

    fn grow(&mut self, (number, end): (usize, usize), gate: Gate, at: P2) -> Result<Option<Done>> {
        self.count(1)?;
        if let Some(line) = &mut self.lines[number] {
            match end {
                0 => line.positions.push_front(at),
                _ => line.positions.push_back(at),
            }
            line.ends[end] = Some(gate);
            self.open.insert(gate, (number, end));
        }
        Ok(None)
    }

    /// Joins a line and the one that follows; the positions of the shorter one move.
    fn join(&mut self, first: usize, second: usize) {
        let (Some(mut a), Some(mut b)) = (self.lines[first].take(), self.lines[second].take())
        else {
            return;
        };
        let ends = [a.ends[0], b.ends[1]];
        let (kept, positions) = match a.positions.len() >= b.positions.len() {
            true => {
                a.positions.append(&mut b.positions);
                (first, a.positions)
            }
            false => {
                while let Some(position) = a.positions.pop_back() {
                    b.positions.push_front(position);
                }
                (second, b.positions)
            }
        };
        self.free.push(first + second - kept);
        for (end, gate) in ends.iter().enumerate() {
            if let Some(gate) = gate {
                self.open.insert(*gate, (kept, end));
            }
        }
        self.lines[kept] = Some(Line { positions, ends });
    }

    /// Takes out a line whose ends meet.
    fn close(&mut self, number: usize) -> Option<Done> {
        let line = self.lines[number].take()?;
        self.free.push(number);
        self.positions -= line.positions.len() as u64;
        let level = line.ends[0].or(line.ends[1])?.level;
        let mut positions = line.positions;
        let first = *positions.front()?;
        positions.push_back(first);
        Some(Done { level, positions })
    }

    /// Takes out the lines with both ends at gates above `row`, or out of reach: all squares above it were visited.
    pub fn end_row(&mut self, row: u32) -> Vec<Done> {
        let passed = |gate: &Gate| gate.row < row;
        let mut dead: Vec<Gate> = self.open.keys().filter(|g| passed(g)).copied().collect();
        dead.sort_unstable();
        let mut done = Vec::new();
        for gate in dead {
            let Some((number, end)) = self.open.remove(&gate) else {
                continue;
            };
            let Some(line) = &mut self.lines[number] else {
                continue;
            };
            line.ends[end] = None;
            if line.ends == [None, None]
                && let Some(line) = self.lines[number].take()
            {
                self.free.push(number);
                self.positions -= line.positions.len() as u64;
                done.push(Done {
                    level: gate.level,
                    positions: line.positions,
                });
            }
        }
        done
    }

    /// Reserves memory for more positions.
    fn count(&mut self, more: u64) -> Result<()> {
        self.positions += more;
        let each = 2 * size_of::<P2>() as u64;
        let bytes = self.positions * each + self.lines.len() as u64 * LINE;
        if bytes > self.held.bytes() {
            self.held.at_least(bytes + bytes / 4 + STEP)?;
        }
        Ok(())
    }
}
