//! Warnings about the points that were read.

use super::Stages;
use outcrop_disk::error::{Result, Setting};
use outcrop_geom::lattice::Lattice;
use outcrop_points::Spool;

impl Stages<'_> {
    /// Warnings about the points that were read, before anything that may fail because of them.
    pub(super) fn warn_of_input(&mut self) {
        let input = &self.report.input;
        let warnings = [input.warnings.clone(), self.carried.warnings.clone()];
        // A header that makes points unreadable too was an error before this.
        let unestimated = self.unestimated.take();
        for warning in warnings.concat().into_iter().chain(unestimated) {
            self.warn(warning);
        }
    }

    /// Warnings about points that were left out; an error that there are too few left says so itself.
    pub(super) fn warn_of_left_out(&mut self) {
        let left_out = self.report.input.dropped_non_finite;
        if left_out > 0 {
            self.warn(format!(
                "{left_out} points left out: a coordinate is NaN or infinite"
            ));
        }
        let far = (self.report.input.dropped_far, self.report.input.far_example);
        if let (count, Some([x, y, z])) = far {
            let option = self.job.observer.spell(&Setting::Flag("keep_far"));
            self.warn(format!(
                "{count} points left out, far from all others (one at {x} {y} {z}): with {option} they \
                 are kept, and all are rounded to coarser steps"
            ));
        }
    }

    /// A warning about many points at the positions of others, if positions are rounded.
    pub(super) fn warn_of_duplicates(
        &mut self,
        spool: Option<&Spool>,
        lattice: &Lattice,
    ) -> Result<()> {
        let (folded, kept) = (self.report.duplicates_folded, self.report.input.kept);
        if lattice.exact || folded <= kept / 100 {
            return Ok(());
        }
        let step = lattice.step;
        self.warn(match Spool::has_duplicates(spool, lattice, self.workspace)? {
            Some(true) => {
                format!("{folded} points are duplicates of others: one at each position is kept")
            }
            Some(false) => format!(
                "{folded} points were merged by rounding: the cloud is so wide that positions had to \
                 be rounded to steps of {step}; are there outliers far away?"
            ),
            None => format!(
                "{folded} points are at the positions of others, to steps of {step}: duplicates, or points that \
                 rounding merged because others are far away; one at each position is kept"
            ),
        });
        Ok(())
    }
}
