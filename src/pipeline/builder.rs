//! The builder of a reconstruction, with all checks before it begins.

use super::away::Copies;
use super::hidden::mesh_of;
use super::manifest::Manifest;
use super::resources::{Resources, resource_setters};
use super::start::{Start, scratch_folder};
use super::{Reconstruction, levels, made};
use crate::deliver::{Delivery, Kind};
use crate::features::PAGES;
use crate::params::Params;
use outcrop_disk::error::{Error, Remedy, Result, Setting};
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Found, Storage};
use outcrop_mesh_files::export::check_name;
use outcrop_stages::order::PAGE;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Collects the settings of a [`Reconstruction`]; all but inputs and output have defaults.
#[derive(Default)]
pub struct Builder {
    inputs: Vec<PathBuf>,
    output: PathBuf,
    params: Params,
    tile_points: Option<u32>,
    page_points: Option<usize>,
    resources: Resources,
    /// The scratch folder, if an unfinished run is continued.
    folder: Option<PathBuf>,
    time_limit: Option<Duration>,
    pictures: bool,
    copies: Copies,
}

impl Builder {
    /// With the settings of a run.
    pub(super) fn of(manifest: &Manifest) -> Self {
        manifest
            .inputs()
            .fold(Self::default(), Self::input)
            .output(manifest.output())
            .params(manifest.params())
            .tile_points(manifest.tile_points)
            .page_points(manifest.page_points)
    }

    /// Adds a file or folder of points; all inputs together are one cloud.
    #[must_use]
    pub fn input(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Path of the mesh. Its extension selects the format: `.ply`, `.obj`, `.stl` or `.glb`; with `.zst`
    /// behind it the mesh is compressed. `DIR/tileset.json` makes levels of detail in that folder. A URL of a store
    /// is one too, such as `s3://bucket/mesh.ply`.
    #[must_use]
    pub fn output(mut self, path: impl Into<PathBuf>) -> Self {
        self.output = path.into();
        self
    }

    resource_setters!();

    /// Parameters of the reconstruction.
    #[must_use]
    pub fn params(mut self, params: Params) -> Self {
        self.params = params;
        self
    }

    /// Points per tile; does not change the result.
    #[must_use]
    pub fn tile_points(mut self, points: u32) -> Self {
        self.tile_points = Some(points);
        self
    }

    /// Points per page of the ordered store; does not change the result.
    #[must_use]
    pub fn page_points(mut self, points: usize) -> Self {
        self.page_points = Some(points);
        self
    }

    /// The run stops by itself before this time is over; it can be resumed then.
    #[must_use]
    pub fn time_limit(mut self, limit: Duration) -> Self {
        self.time_limit = Some(limit);
        self
    }

    /// The report has pictures, distributions, and the course of memory and disk: [`Report::pictures`](crate::Report::pictures) and
    /// [`Report::details`](crate::Report::details), for `outcrop::page::report`.
    #[must_use]
    pub fn pictures(mut self, wanted: bool) -> Self {
        self.pictures = wanted;
        self
    }

    /// Folder for copies of scratch files that are in a store, and their most bytes; default: the folder for
    /// temporary files, and 4 GiB.
    #[must_use]
    pub fn copies(mut self, folder: Option<PathBuf>, limit: Option<u64>) -> Self {
        self.copies = Copies::new(folder, limit);
        self
    }

    /// The same, all at once.
    pub(super) fn with_copies(mut self, copies: Copies) -> Self {
        self.copies = copies;
        self
    }

    /// The scratch folder of the run.
    pub(super) fn folder(mut self, folder: PathBuf) -> Self {
        self.folder = Some(folder);
        self
    }

    /// Checks everything that can be checked in advance.
    ///
    /// # Errors
    /// [`Error::Parameter`], [`Error::Memory`], [`Error::NotBuilt`].
    pub fn build(mut self) -> Result<Reconstruction> {
        self.params.check()?;
        let missing = |name, expected: &str| {
            Err(Error::Parameter {
                name,
                found: "nothing".into(),
                expected: expected.into(),
            })
        };
        if self.pictures {
            PAGES.require()?;
        }
        if self.inputs.is_empty() {
            return missing("INPUT", "at least one file or folder");
        }
        if self.output.as_os_str().is_empty() {
            return missing("output", "the path of the mesh");
        }
        let parent = self.resources.scratch.as_deref();
        let delivery = Delivery::of(&self.output, Kind::Mesh, parent, self.folder.as_deref())?;
        let local = delivery.as_ref().map_or(&*self.output, Delivery::local);
        let tiles = levels::folder(local, &self.params)?;
        let made = made::output(local, &self.params, tiles.is_some())?;
        let target = tiles.as_deref().unwrap_or(local);
        let mesh = (tiles.is_some() || made.is_some()).then(|| mesh_of(target));
        let named = mesh.as_deref().unwrap_or(local);
        if self.folder.is_some() && check_name(named, true).is_err() {
            // An unfinished run whose mesh was a GLB, and is to be another now.
            self.params.compress_glb = false;
        }
        check_name(named, self.params.compress_glb)?;
        let resources = self.resources;
        let folder = match &delivery {
            Some(delivery) => delivery.scratch().to_path_buf(),
            None => scratch_folder(target, resources.scratch.as_deref()),
        };
        Ok(Reconstruction {
            goes_on: self.folder.is_some(),
            folder: self.folder.unwrap_or(folder),
            inputs: self.inputs,
            mesh: mesh.unwrap_or_else(|| local.to_path_buf()),
            delivery,
            output: self.output,
            made,
            tiles,
            memory: MemoryPool::new(resources.memory())?,
            threads: resources.threads(),
            tile_points: self.tile_points.unwrap_or(self.params.block),
            page_points: self.page_points.unwrap_or(PAGE),
            params: self.params,
            observer: resources.observer,
            cancel: resources.cancel,
            storage: resources.storage,
            start: resources.start,
            time_limit: self.time_limit,
            pictures: self.pictures,
            copies: self.copies,
        })
    }
}

/// The builder of the unfinished run that was found in a scratch folder.
///
/// # Errors
/// [`Error::NotResumable`].
pub(super) fn unfinished(folder: &Path, found: Found) -> Result<Builder> {
    let not = |why: &str| Error::not_resumable(folder, why);
    let found = match found {
        Found::Run(found) => found,
        Found::Nothing => return Err(not("no unfinished run is here")),
        Found::Damaged(_) => {
            let restart = Remedy::Give(Setting::Flag("restart"), "begins again");
            return Err(not("its manifest is damaged").with(restart));
        }
    };
    let manifest = Manifest::from_bytes(folder, &found.manifest)?;
    Ok(Builder::of(&manifest)
        .start(Start::Resume)
        .folder(folder.to_path_buf()))
}
