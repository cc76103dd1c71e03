//! Pictures of a cloud that is described.

use super::{Info, Sketch, described};
use crate::params::Params;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_draw::histogram::Tally;
use outcrop_geom::lattice::Lattice;
use outcrop_pictures::cloud;
pub use outcrop_pictures::cloud::Illustration;
use outcrop_points::Spool;
use outcrop_stages::order::PointStore;
use std::path::PathBuf;

/// As [`super::info`], with pictures and counts for [`crate::page::cloud`].
///
/// # Errors
/// See [`super::info`].
pub fn illustrated(
    inputs: &[PathBuf],
    params: &Params,
    workspace: &Workspace,
) -> Result<(Info, Illustration)> {
    let mut drawn = Illustration::default();
    let info = described(inputs, params, Some(&mut drawn), workspace)?;
    Ok((info, drawn))
}

impl Sketch for Illustration {
    fn count(&mut self, spool: &Spool, lattice: &Lattice, workspace: &Workspace) -> Result<()> {
        self.classes = cloud::classes(spool, lattice, workspace)?;
        Ok(())
    }

    fn draw(
        &mut self,
        store: &PointStore,
        lattice: &Lattice,
        spacings: &Tally,
        workspace: &Workspace,
    ) -> Result<()> {
        let classes = std::mem::take(&mut self.classes);
        *self = Self {
            classes,
            ..Self::of(store, lattice, spacings, workspace)?
        };
        Ok(())
    }
}
