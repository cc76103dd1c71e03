//! A source: the points of one input file in their native form.

use super::colors::{Depth, Tally};
use super::columns::{COLORS, Column, Span};
use super::native::Native;
use super::number::NOT_FIXED;
use super::stats::SourceStats;
use serde::{Deserialize, Serialize};

/// The points of one input file in the spool.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Source {
    /// The type of its coordinates.
    pub native: Native,
    /// Its counts and extents.
    pub stats: SourceStats,
    /// True if the numbers come from text, so that a fixed number of decimals gives a lattice.
    pub text: bool,
    /// True if points outside the box of `stats` are left out.
    pub cut: bool,
    /// The columns whose values are in the spool.
    pub columns: Vec<Column>,
    /// Their spans.
    pub spans: Vec<Span>,
    /// The scale of its colours, if the file says it.
    pub depth: Option<Depth>,
    /// Its points by their largest colour, if colours were read.
    pub tally: Tally,
}

impl Source {
    /// Number of decimals of all coordinates, if they come from text without exponents and are few enough for
    /// an exact integer in units of the last decimal.
    pub(super) fn decimals(&self) -> Option<u32> {
        let stats = &self.stats;
        let fixed = self.text
            && self.native == Native::F64
            && stats.decimals != NOT_FIXED
            && stats.decimals <= 9;
        let largest = (0..3)
            .map(|a| stats.min[a].abs().max(stats.max[a].abs()))
            .fold(0.0, f64::max);
        let power = 10f64.powi(stats.decimals.min(9) as i32);
        (fixed && largest * power < (1u64 << 50) as f64).then_some(stats.decimals)
    }

    /// True if colours are among the values in the spool.
    #[must_use]
    pub fn reads_colors(&self) -> bool {
        self.columns.iter().any(|c| COLORS.contains(&&*c.name))
    }

    /// Scale and offset of an axis, if the native values are integers or decimals.
    pub(super) fn grid(&self, axis: usize) -> Option<(f64, f64)> {
        match self.native {
            Native::Las { scale, offset } => Some((scale[axis], offset[axis])),
            Native::F32 | Native::F64 => {
                let decimals = self.decimals()?;
                Some((1.0 / 10f64.powi(decimals as i32), 0.0))
            }
        }
    }

    /// Lowest and highest coordinates of the kept points in the input's unit; `None` without points.
    #[must_use]
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        (self.stats.kept > 0).then(|| self.in_unit(self.stats.own))
    }

    /// The same of all points with a place on the lattice.
    pub(super) fn whole_bounds(&self) -> Option<[[f64; 3]; 2]> {
        let whole = [self.stats.min, self.stats.max];
        self.stats.any().then(|| self.in_unit(whole))
    }

    fn in_unit(&self, [mut min, mut max]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        if let Native::Las { scale, offset } = self.native {
            for axis in 0..3 {
                let ends = [min[axis], max[axis]].map(|i| i * scale[axis] + offset[axis]);
                min[axis] = ends[0].min(ends[1]);
                max[axis] = ends[0].max(ends[1]);
            }
        }
        [min, max]
    }
}
