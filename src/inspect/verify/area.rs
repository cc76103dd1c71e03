//! Triangles without area, found without random access to positions.
//!
//! A triangle is looked at in the range of its highest corner. Positions that are not in memory
//! there are found later: the triangle travels down to the ranges of its other corners and takes
//! the positions known so far along.

use super::buckets::Buckets;
use super::collinear::collinear;
use super::plan::Plan;
use super::positions::Positions;
use crate::error::Result;
use crate::spill::Record;
use crate::workspace::Workspace;

/// Words of a triangle on its way: the middle corner ([`KNOWN`] once its position is known), the
/// lowest corner, the positions of the highest and the middle corner.
const WORDS: usize = 14;

/// No vertex has this number.
const KNOWN: u32 = u32::MAX;

/// Counts the triangles that have no area.
#[derive(Debug)]
pub(super) struct Areas {
    plan: Plan,
    positions: Positions,
    travelling: Buckets<WORDS>,
    block: Vec<Record<WORDS>>,
    /// Triangles without area so far.
    pub(super) zero: u64,
}

impl Areas {
    pub(super) fn new(workspace: &Workspace, plan: &Plan, positions: Positions) -> Self {
        let name = "verify.areas";
        Self {
            plan: plan.clone(),
            positions,
            travelling: Buckets::new(workspace, name, plan.ranges, plan.blocks[2]),
            block: Vec::new(),
            zero: 0,
        }
    }

    /// Brings the positions of range `k` into memory and looks at the triangles that wait for it.
    pub(super) fn enter(&mut self, k: usize, first: u32) -> Result<()> {
        self.positions.load(k, first)?;
        let mut block = std::mem::take(&mut self.block);
        let mut cursor = self.travelling.cursor(k);
        while self.travelling.next(&mut cursor, &mut block)? {
            for record in &block {
                let position = |at: usize| {
                    let words: [u32; 6] = std::array::from_fn(|i| record[at + i]);
                    bytemuck::cast::<_, [f64; 3]>(words)
                };
                let middle = match record[0] {
                    KNOWN => Some(position(8)),
                    vertex => self.positions.get(vertex),
                };
                self.go_on(record[0], record[1], position(2), middle)?;
            }
        }
        self.travelling.clear(k);
        self.block = block;
        Ok(())
    }

    /// Looks at triangles with sound corners, those whose highest corner is from `first` on, in
    /// the current range of `length` vertices.
    pub(super) fn look(&mut self, triangles: &[[u32; 3]], first: u32, length: usize) -> Result<()> {
        for &triangle in triangles {
            let mut sorted = triangle;
            sorted.sort_unstable();
            let [low, middle, high] = sorted;
            if high.wrapping_sub(first) as usize >= length {
                continue;
            }
            if let Some(position) = self.positions.get(high) {
                self.go_on(middle, low, position, self.positions.get(middle))?;
            }
        }
        Ok(())
    }

    fn go_on(
        &mut self,
        middle: u32,
        low: u32,
        high: [f64; 3],
        known: Option<[f64; 3]>,
    ) -> Result<()> {
        if let (Some(known), Some(lowest)) = (known, self.positions.get(low)) {
            let finite = [high, known, lowest]
                .iter()
                .flatten()
                .all(|c| c.is_finite());
            self.zero += u64::from(finite && collinear([high, known, lowest]));
            return Ok(());
        }
        let mut record = [0; WORDS];
        record[1] = low;
        record[2..8].copy_from_slice(&bytemuck::cast::<_, [u32; 6]>(high));
        let next = if let Some(position) = known {
            record[0] = KNOWN;
            record[8..].copy_from_slice(&bytemuck::cast::<_, [u32; 6]>(position));
            low
        } else {
            record[0] = middle;
            middle
        };
        self.travelling.push(self.plan.range_of(next), record)
    }
}
