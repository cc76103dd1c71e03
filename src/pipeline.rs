//! The driver: the stages in the order of the data flow.

mod attempt;
mod away;
mod beside;
mod builder;
mod change;
mod checks;
mod clock;
#[cfg(feature = "levels")]
mod close;
pub mod compare;
mod disk;
mod format;
mod hidden;
mod identity;
mod levels;
mod like;
mod made;
mod manifest;
mod mesh_job;
mod origin;
mod outlook;
mod raster;
mod resources;
mod shared;
#[cfg(feature = "levels")]
mod simplify;
mod stages;
mod start;
#[cfg(feature = "levels")]
mod tiles;

use crate::deliver::Delivery;
use crate::params::Params;
use crate::report::Report;
use attempt::Alarm;
pub(crate) use away::Copies;
pub use builder::Builder;
pub use change::ChangeDetection;
use checks::{not_an_input, one_system, writable};
pub(crate) use clock::Clock;
#[cfg(feature = "levels")]
pub use close::Closing;
pub(crate) use disk::{Files, Known};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Folder, Storage, Workspace, limits};
pub use raster::Rasterization;
pub(crate) use resources::temporary;
pub(crate) use shared::planned_shards;
pub use shared::{
    Advanced, Begun, Status, TaskState, Totals, Worked, part_of, shared_folder, status,
};
#[cfg(feature = "levels")]
pub use simplify::Simplification;
use stages::Stages;
pub use start::Start;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
#[cfg(feature = "levels")]
pub use tiles::Tiles;

/// A reconstruction that is ready to run, made by [`Reconstruction::builder`].
pub struct Reconstruction {
    inputs: Vec<PathBuf>,
    /// The mesh: of a tileset one in the scratch's place, which is deleted at the end.
    mesh: PathBuf,
    /// The output that was asked for.
    output: PathBuf,
    /// The mesh that is made of the whole one, if that is wanted: the whole one is then a file beside it, which is
    /// deleted at the end.
    made: Option<PathBuf>,
    /// The folder of the tileset, if that is wanted.
    tiles: Option<PathBuf>,
    /// The way of the output to a store, if it is behind a URL: the paths above are then of files on this machine.
    delivery: Option<Delivery>,
    folder: PathBuf,
    /// True if the run was found by its folder.
    goes_on: bool,
    params: Params,
    memory: MemoryPool,
    threads: usize,
    tile_points: u32,
    page_points: usize,
    observer: Arc<dyn Observer>,
    cancel: Cancel,
    storage: Storage,
    start: Start,
    time_limit: Option<Duration>,
    pictures: bool,
    copies: Copies,
}

/// Half of the memory that machine and cgroup allow.
#[must_use]
pub fn default_memory() -> u64 {
    share_of(limits::memory_allowed())
}

/// Half of the allowed memory, but at least the smallest budget if that is allowed.
fn share_of(allowed: u64) -> u64 {
    (allowed / 2).max(allowed.min(MINIMUM_BUDGET))
}

/// Number of threads available to this process.
#[must_use]
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

impl Reconstruction {
    /// A builder with the default parameters.
    #[must_use]
    pub fn builder() -> Builder {
        Builder::default()
    }

    /// The builder of the unfinished run in a scratch folder. Threads, memory, observer, flag and time limit
    /// can be changed; the output too, as for a mesh that is [too large](crate::Error::TooLarge) for its format.
    ///
    /// # Errors
    /// [`crate::Error::NotResumable`], [`crate::Error::Locked`], [`crate::Error::Io`].
    pub fn resume(folder: impl AsRef<Path>) -> Result<Builder> {
        let folder = folder.as_ref();
        builder::unfinished(folder, Folder::find(folder)?)
    }

    /// As [`Reconstruction::resume`]; waits some seconds for a process that still ends, and tells the observer.
    ///
    /// # Errors
    /// See [`Reconstruction::resume`]; [`crate::Error::Cancelled`].
    pub fn resume_when_free(
        folder: impl AsRef<Path>,
        observer: &dyn Observer,
        cancel: &Cancel,
    ) -> Result<Builder> {
        let folder = folder.as_ref();
        builder::unfinished(folder, Folder::find_when_free(folder, observer, cancel)?)
    }

    /// Path of the mesh, or of the tileset.
    #[must_use]
    pub fn output(&self) -> &Path {
        &self.output
    }

    /// Reconstructs the surface and writes the mesh.
    ///
    /// # Errors
    /// Any [`crate::Error`]; an existing output file is then unchanged. Scratch files are deleted, unless the
    /// run can be resumed, see [`Reconstruction::is_unfinished`].
    pub fn run(&self) -> Result<Report> {
        if let Some(delivery) = &self.delivery {
            delivery.refuse_inputs(&outcrop_formats::expand(&self.inputs)?)?;
            delivery.prepare()?;
        }
        writable(&self.mesh)?;
        if let Some(made) = &self.made {
            writable(made)?;
            not_an_input(made, false, &self.inputs)?;
        }
        self.tiles.as_deref().map_or(Ok(()), levels::check_folder)?;
        not_an_input(&self.mesh, self.params.split.is_some(), &self.inputs)?;
        one_system(&self.params, &self.inputs)?;
        let _alarm = self
            .time_limit
            .map(|limit| Alarm::set(limit, self.cancel.clone()));
        let workspace = self.open()?;
        let outcome = self.reconstruct(&workspace);
        self.close(workspace, &outcome);
        outcome
    }

    /// All stages, in the order of the data flow.
    fn reconstruct(&self, workspace: &Workspace) -> Result<Report> {
        let mut stages = Stages::begin(self, workspace)?;
        let (spool, lattice) = stages.ingest()?;
        let (points, spool) = stages.order(spool, &lattice)?;
        let divided = stages.without_outliers(points)?;
        let (blocks, tiles) = (divided.blocks, divided.tiles);
        let mut values = stages.values(spool, &lattice, &divided)?;
        let radius = stages.radius(&divided.points, &lattice);
        let (points, relaxed) = stages.moved(divided, &mut values)?;
        let store = points.open(workspace)?;
        let shape = stages.open_shape(relaxed)?;
        let side = stages.side(shape.or(&store), blocks, &lattice)?;
        let places = stages.places(&store, &shape, side.outside(&values), &lattice);
        let (seen, coarse) = stages.cells(places, radius, &values, tiles)?;
        let places = places.with_coarse(coarse.as_deref());
        let triples = stages.triples(&seen, blocks)?;
        let supports = stages.kept(&triples);
        let stitched = stages.stitch(places, triples, blocks)?;
        let repaired = stages.repair(places, stitched, blocks)?;
        stages.confidence(supports, &repaired, blocks, &mut values)?;
        values.release_told(workspace)?;
        side.release(workspace)?;
        let pieces = stages.cut(&store, &repaired, blocks, &lattice)?;
        stages.export(
            &store,
            values.columns(),
            &repaired,
            pieces.as_ref(),
            blocks,
            &lattice,
        )?;
        stages.draw(&store, &shape, &repaired, pieces.as_ref(), blocks, &lattice)?;
        stages.make_of_whole()?;
        stages.levels()?;
        stages.deliver()?;
        Ok(stages.report())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_half_but_enough() {
        let mib = |n: u64| n << 20;
        assert_eq!(share_of(mib(1024)), mib(512));
        assert_eq!(share_of(mib(256)), mib(192));
        assert_eq!(share_of(mib(192)), mib(192));
        // Too little memory is refused, with the least budget in the message.
        assert_eq!(share_of(mib(100)), mib(100));
    }
}
