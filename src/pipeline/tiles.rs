//! A run that makes a tileset, and that can be resumed.

use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use super::{Start, start::scratch_folder};
use crate::deliver::{Delivery, Kind};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Storage, Workspace};
use outcrop_levels::{Options, TilesReport};
use std::path::PathBuf;
use std::sync::Arc;

/// The making of a tileset.
#[derive(Clone)]
pub struct Tiles {
    mesh: PathBuf,
    folder: PathBuf,
    options: Options,
    resources: Resources,
}

impl Tiles {
    /// Makes the tileset `folder` of `mesh`, in any format that is read.
    pub fn new(mesh: impl Into<PathBuf>, folder: impl Into<PathBuf>) -> Self {
        Self {
            mesh: mesh.into(),
            folder: folder.into(),
            options: Options::default(),
            resources: Resources::default(),
        }
    }

    resource_setters!();

    /// Sets the options that decide the tileset.
    #[must_use]
    pub fn options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// The scratch folder of the run.
    #[must_use]
    pub fn scratch_folder(&self) -> PathBuf {
        scratch_folder(&self.folder, self.resources.scratch.as_deref())
    }

    /// Makes the tileset.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a file that is no mesh; [`crate::Error::Parameter`] if the folder has other
    /// files; [`crate::Error::Memory`] if the budget is too small; [`crate::Error::Io`], [`crate::Error::Disk`], [`crate::Error::Corrupt`],
    /// [`crate::Error::Cancelled`]; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<TilesReport> {
        let scratch = self.resources.scratch.as_deref();
        match Delivery::of(&self.folder, Kind::Folder, scratch, None)? {
            None => self.run_to(None),
            Some(delivery) => {
                let mut local = self.clone();
                local.folder = delivery.local().to_path_buf();
                local.run_to(Some(&delivery))
            }
        }
    }

    fn run_to(&self, delivery: Option<&Delivery>) -> Result<TilesReport> {
        outcrop_levels::check_folder(&self.folder)?;
        let job = MeshJob {
            kind: "tiles",
            inputs: std::slice::from_ref(&self.mesh),
            output: &self.folder,
            options: &self.options,
            resources: &self.resources,
            delivery,
        };
        job.run(
            |workspace| self.make(workspace),
            || outcrop_levels::remove_unfinished(&self.folder),
        )
    }

    fn make(&self, workspace: &Workspace) -> Result<TilesReport> {
        let source = self.mesh.file_name().unwrap_or_default();
        let source = source.to_string_lossy();
        outcrop_levels::tileset(&self.mesh, &source, &self.folder, &self.options, workspace)
    }
}
