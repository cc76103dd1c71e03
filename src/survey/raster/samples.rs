//! Heights of cells on their way to the raster: sorted by cell, so that each cell has one.

use super::grid::Grid;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Sorter, row};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::region::Area;
use std::cmp::Reverse;

/// Samples that are combined at a time, before they are sorted with all others.
pub(super) const BATCH: usize = 1 << 16;

/// Bytes of a batch.
pub(super) const BATCH_BYTES: u64 = (BATCH * size_of::<Sample>()) as u64;

/// Binary digits of the largest height: a mean of 2^24 heights is exact.
const DIGITS: i32 = 40;

row! {
    /// A height in a cell.
    pub(super) struct Sample {
        /// The tile.
        tile: u32,
        /// The cell in the tile.
        cell: u32,
        /// The height, or the sum of several, as a whole number; the lower word first.
        height: [u32; 2],
        /// Heights in the sum.
        count: u32,
        /// Red, green and blue, the highest byte 0.
        colour: u32,
    }
    packed Above Above Above Above Above Above
}

impl Sample {
    fn sum(&self) -> u64 {
        u64::from(self.height[1]) << 32 | u64::from(self.height[0])
    }

    fn set_sum(&mut self, sum: u64) {
        self.height = [sum as u32, (sum >> 32) as u32];
    }

    /// The colour, from its bytes.
    pub fn colour([red, green, blue]: [u8; 3]) -> u32 {
        u32::from_be_bytes([0, red, green, blue])
    }
}

/// Which height a cell has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// The highest, and its colour.
    Highest,
    /// The lowest, and its colour.
    Lowest,
    /// The mean.
    Mean,
}

impl Choice {
    /// Makes one of two samples of a cell; the result does not depend on the order.
    fn join(self, own: &mut Sample, other: &Sample) {
        let rank = |s: &Sample| (s.sum(), Reverse(s.colour));
        let is_taken = match self {
            Self::Highest => rank(other) > rank(own),
            Self::Lowest => (other.sum(), other.colour) < (own.sum(), own.colour),
            Self::Mean => {
                own.set_sum(own.sum().saturating_add(other.sum()));
                own.count = own.count.saturating_add(other.count);
                own.colour = own.colour.min(other.colour);
                return;
            }
        };
        if is_taken {
            *own = *other;
        }
    }
}

/// Heights as whole numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    base: f64,
    factor: f64,
}

impl Scale {
    /// For heights from the lowest to the highest.
    pub fn of([lowest, highest]: [f64; 2]) -> Self {
        let extent = (highest - lowest).clamp(f64::MIN_POSITIVE, f64::MAX);
        // One more than the exponent: the extent is below 2^exponent.
        let exponent = (extent.to_bits() >> 52) as i32 - 1022;
        Self {
            base: lowest,
            factor: 2f64.powi((DIGITS - exponent).clamp(-1000, 1000)),
        }
    }

    fn whole(self, height: f64) -> u64 {
        // The cast takes what rounding made smaller than the lowest to 0.
        ((height - self.base) * self.factor).round() as u64
    }

    /// The height of a sample.
    pub fn height(self, sample: &Sample) -> f64 {
        self.base + sample.sum() as f64 / f64::from(sample.count.max(1)) / self.factor
    }
}

/// Collects samples.
pub(super) struct Samples<'a> {
    pub grid: Grid,
    pub choice: Choice,
    pub scale: Scale,
    pub area: Option<Area<'a>>,
    pub sorter: Sorter<Sample>,
}

impl Samples<'_> {
    /// A sample in a cell; none outside the region.
    pub fn of(&self, place: [u32; 2], height: f64, colour: u32) -> Option<Sample> {
        if let Some(area) = &self.area {
            let [x, y] = self.grid.middle(place);
            if !area.contains([x, y, 0.0]) {
                return None;
            }
        }
        let [tile, cell] = self.grid.tile_of(place);
        let mut sample = Sample {
            tile,
            cell,
            height: [0, 0],
            count: 1,
            colour,
        };
        sample.set_sum(self.scale.whole(height));
        Some(sample)
    }

    /// Takes all samples of a batch.
    pub fn take(&self, batch: &mut Vec<Sample>) -> Result<()> {
        batch.sort_unstable_by_key(|s| (s.tile, s.cell));
        batch.dedup_by(|next, kept| {
            let is_same = (next.tile, next.cell) == (kept.tile, kept.cell);
            if is_same {
                self.choice.join(kept, next);
            }
            is_same
        });
        self.sorter.push(batch)?;
        batch.clear();
        Ok(())
    }

    /// Calls `each` with the sample of each cell that has any, by tile and cell.
    pub fn for_each(
        self,
        workspace: &Workspace,
        mut each: impl FnMut(&Sample) -> Result<()>,
    ) -> Result<()> {
        let (sorted, choice) = (self.sorter.finish(workspace)?, self.choice);
        let mut last: Option<Sample> = None;
        sorted.for_each(|next| {
            match &mut last {
                Some(own) if (own.tile, own.cell) == (next.tile, next.cell) => {
                    choice.join(own, &next);
                }
                _ => {
                    if let Some(done) = last.replace(next) {
                        each(&done)?;
                    }
                }
            }
            Ok(())
        })?;
        last.map_or(Ok(()), |done| each(&done))
    }
}
