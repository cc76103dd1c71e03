//! Triangles without area, and the volume, found without random access to positions.
//!
//! A triangle is examined in the range of its highest corner. Positions that are not in memory there are
//! found later: the triangle, with the positions known so far, is sent down to the ranges of its other
//! corners.

use super::buckets::Buckets;
use super::collinear::collinear;
use super::plan::Plan;
use super::positions::Positions;
use super::volume::Volume;
use outcrop_disk::error::Result;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::Workspace;

row! {
    /// A triangle sent to the ranges of its middle and lowest corner.
    struct Travelling {
        /// The middle corner, [`KNOWN`] once its position is known.
        middle: u32,
        /// The lowest corner.
        low: u32,
        /// 1 if the triangle runs from the highest corner to the lowest, else 0.
        is_turned: u32,
        /// Zero.
        unused: u32,
        /// Position of the highest corner.
        high_at: [f64; 3],
        /// Position of the middle corner, if it is known.
        middle_at: [f64; 3],
    }
    unpacked
}

/// A number that no vertex has.
const KNOWN: u32 = u32::MAX;

/// Counts triangles without area.
#[derive(Debug)]
pub(super) struct Areas {
    plan: Plan,
    positions: Positions,
    travelling: Buckets<Travelling>,
    /// Triangles without area so far.
    pub(super) zero: u64,
    /// The volume so far.
    pub(super) volume: Volume,
}

impl Areas {
    /// With `zero` triangles that are found already, and their `volume`.
    pub(super) fn new(
        workspace: &Workspace,
        plan: &Plan,
        positions: Positions,
        (zero, volume): (u64, Volume),
    ) -> Result<Self> {
        let name = "verify.areas";
        Ok(Self {
            plan: plan.clone(),
            positions,
            travelling: Buckets::new(workspace, name, plan.ranges, plan.blocks[2])?,
            zero,
            volume,
        })
    }

    /// Loads the positions of range `k` and examines the triangles that wait for it.
    pub(super) fn enter(&mut self, k: usize, first: u32) -> Result<()> {
        self.positions.load(k, first)?;
        let mut cursor = self.travelling.cursor(k);
        while let Some(block) = self.travelling.next(&mut cursor)? {
            for row in block {
                let middle = match row.middle {
                    KNOWN => Some(row.middle_at),
                    vertex => self.positions.get(vertex),
                };
                self.go_on(row, row.high_at, middle)?;
            }
        }
        self.travelling.clear(k);
        Ok(())
    }

    /// Examines triangles with valid corners, whose highest corner is at least `first` and in the current
    /// range of `length` vertices.
    pub(super) fn look(&mut self, triangles: &[[u32; 3]], first: u32, length: usize) -> Result<()> {
        for &triangle in triangles {
            let mut sorted = triangle;
            sorted.sort_unstable();
            let [low, middle, high] = sorted;
            let at = triangle.iter().position(|v| *v == high).unwrap_or(0);
            let way = Travelling {
                middle,
                low,
                is_turned: u32::from(triangle[(at + 1) % 3] == low),
                ..Travelling::default()
            };
            if high.wrapping_sub(first) as usize >= length {
                continue;
            }
            if let Some(position) = self.positions.get(high) {
                self.go_on(&way, position, self.positions.get(middle))?;
            }
        }
        Ok(())
    }

    fn go_on(&mut self, way: &Travelling, high: [f64; 3], known: Option<[f64; 3]>) -> Result<()> {
        let (middle, low) = (way.middle, way.low);
        if let (Some(known), Some(lowest)) = (known, self.positions.get(low)) {
            let corners = [high, known, lowest];
            let finite = corners.iter().flatten().all(|c| c.is_finite());
            self.zero += u64::from(finite && collinear(corners));
            if finite {
                self.volume.add(match way.is_turned {
                    0 => corners,
                    _ => [high, lowest, known],
                });
            }
            return Ok(());
        }
        let row = Travelling {
            middle: if known.is_some() { KNOWN } else { middle },
            low,
            is_turned: way.is_turned,
            unused: 0,
            high_at: high,
            middle_at: known.unwrap_or_default(),
        };
        let next = if known.is_some() { low } else { middle };
        self.travelling.push(self.plan.range_of(next), row)
    }
}
