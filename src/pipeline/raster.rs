//! A run that makes a raster of heights, and that can be resumed.

use super::Start;
use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Storage;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_formats::ingest_selected;
use outcrop_survey::raster::{self, Options, Raster};
use std::path::PathBuf;
use std::sync::Arc;

/// The making of a raster of heights, of a mesh or a cloud.
#[derive(Clone)]
pub struct Rasterization {
    source: PathBuf,
    options: Options,
    resources: Resources,
}

impl Rasterization {
    /// Makes a raster of `source`, a mesh or a cloud in any format that is read, or a folder of clouds.
    pub fn new(source: impl Into<PathBuf>, options: Options) -> Self {
        Self {
            source: source.into(),
            options,
            resources: Resources::default(),
        }
    }

    resource_setters!();

    /// Makes the raster.
    ///
    /// # Errors
    /// See [`raster::raster`]; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<Raster> {
        self.options.check(&self.source)?;
        let job = MeshJob {
            kind: "raster",
            inputs: std::slice::from_ref(&self.source),
            output: &self.options.output,
            options: &self.options,
            resources: &self.resources,
            delivery: None,
        };
        job.run(
            |workspace| raster::raster(&self.source, &self.options, ingest_selected, workspace),
            || (),
        )
    }
}
