//! A run on finished meshes or on clouds, which can be resumed: its manifest and its scratch folder.

#[cfg(all(test, feature = "cloud"))]
mod tests;

use super::format::FORMAT;
use super::identity::{Identity, difference, identities};
use super::resources::Resources;
use super::{Start, start::scratch_folder};
use crate::deliver::Delivery;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::{Folder, Found, Workspace, fault};
use outcrop_points::is_remote;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A run that makes something of meshes or clouds.
pub(super) struct MeshJob<'a, O> {
    /// What it makes.
    pub kind: &'static str,
    pub inputs: &'a [PathBuf],
    pub output: &'a Path,
    /// The options that decide the result.
    pub options: &'a O,
    pub resources: &'a Resources,
    /// The way of the output to a store, if it is behind a URL.
    pub delivery: Option<&'a Delivery>,
}

/// Inputs and options of a run, by which it is resumed.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Manifest<O> {
    /// What it makes, and the format of scratch files.
    format: String,
    version: String,
    inputs: Vec<PathBuf>,
    output: PathBuf,
    options: O,
    files: Vec<Identity>,
}

impl<O: Clone + Serialize> Manifest<O> {
    fn of(job: &MeshJob<'_, O>) -> Result<Self> {
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let url = job.delivery.map(|delivery| delivery.url().to_path_buf());
        Ok(Self {
            format: format!("{} {FORMAT}", job.kind),
            version: env!("CARGO_PKG_VERSION").into(),
            inputs: job
                .inputs
                .iter()
                .map(|path| {
                    if is_remote(path) {
                        path.clone()
                    } else {
                        whole(path)
                    }
                })
                .collect(),
            output: url.unwrap_or_else(|| whole(job.output)),
            options: job.options.clone(),
            files: identities(job.inputs)?,
        })
    }

    fn to_bytes(&self, folder: &Path) -> Result<Vec<u8>> {
        let json = serde_json::to_vec_pretty(self);
        json.map_err(|e| Error::io(folder, "write the manifest", e.into()))
    }

    /// An error if a run that began with `bytes` is another one.
    fn check(&self, bytes: &[u8], folder: &Path) -> Result<()> {
        let was: serde_json::Value = serde_json::from_slice(bytes).unwrap_or_default();
        let now = serde_json::to_value(self).unwrap_or_default();
        let differ = |what: String, was: String, now: String| {
            Err(Error::Mismatch {
                path: folder.to_path_buf(),
                what,
                was,
                now,
            })
        };
        let mut entries = now.as_object().into_iter().flatten();
        let other = entries.find(|(key, value)| *key != "files" && was.get(key) != Some(value));
        if let Some((key, value)) = other {
            return differ(
                format!("the {key}"),
                was[key].to_string(),
                value.to_string(),
            );
        }
        let files: Vec<Identity> = Vec::deserialize(&was["files"]).unwrap_or_default();
        match difference(&files, &self.files) {
            None => Ok(()),
            Some((what, was, now)) => differ(what, was, now),
        }
    }
}

impl<O: Clone + Serialize> MeshJob<'_, O> {
    fn scratch(&self) -> PathBuf {
        match self.delivery {
            Some(delivery) => delivery.scratch().to_path_buf(),
            None => scratch_folder(self.output, self.resources.scratch.as_deref()),
        }
    }

    fn open(&self) -> Result<Workspace> {
        let path = self.scratch();
        let pool = MemoryPool::new(self.resources.memory())?;
        let manifest = Manifest::of(self)?;
        let bytes = manifest.to_bytes(&path)?;
        let Resources {
            observer, cancel, ..
        } = &self.resources;
        let found = match self.resources.start {
            Start::Resume => Folder::find_when_free(&path, &**observer, cancel)?,
            Start::New | Start::Restart => Folder::find(&path)?,
        };
        let is_left = matches!(found, Found::Run(_) | Found::Damaged(_));
        if is_left && self.resources.start == Start::New && Folder::has_progress(&path) {
            return Err(Error::Unfinished { path });
        }
        if let Some(delivery) = self.delivery
            && !matches!(
                (&found, self.resources.start),
                (Found::Run(_), Start::Resume)
            )
        {
            let begun = delivery.begin(&*self.resources.observer);
            begun.inspect_err(|_| delivery.end(&*self.resources.observer))?;
        }
        let folder = match (found, self.resources.start) {
            (Found::Nothing, _) => Folder::create(&path, bytes)?,
            (Found::Run(folder), Start::Resume) => {
                manifest.check(&folder.manifest, &path)?;
                folder
            }
            (Found::Run(folder) | Found::Damaged(folder), _) => folder.restart(bytes)?,
        };
        let Resources {
            observer,
            cancel,
            storage,
            ..
        } = &self.resources;
        let threads = self.resources.threads();
        let (observer, cancel) = (observer.clone(), cancel.clone());
        let workspace = Workspace::resumable(folder, pool, threads, observer, cancel)?;
        workspace.set_storage(*storage)?;
        Ok(workspace)
    }

    /// Sends the output to a store, if it is behind a URL.
    fn deliver(&self, workspace: &Workspace) -> Result<()> {
        let Some(delivery) = self.delivery else {
            return Ok(());
        };
        let observer = &workspace.observer;
        observer.begin("upload", "bytes", delivery.bytes()?);
        let send = || delivery.send(workspace, &mut |warning| observer.warn(&warning));
        workspace.once("upload", |_| send())?;
        observer.end();
        Ok(())
    }

    /// Does `make` in the scratch folder, and `clean` if the run cannot be resumed.
    pub fn run<T>(
        &self,
        make: impl FnOnce(&Workspace) -> Result<T>,
        clean: impl FnOnce(),
    ) -> Result<T> {
        if let Some(delivery) = self.delivery {
            delivery.prepare()?;
        }
        let workspace = self.open()?;
        let outcome = make(&workspace).and_then(|made| {
            self.deliver(&workspace)?;
            Ok(made)
        });
        let keep = outcome.as_ref().is_err_and(Error::can_resume);
        if !(keep && Folder::has_progress(&self.scratch())) {
            workspace.remove(outcome.is_ok());
            clean();
            if let Some(delivery) = self.delivery {
                delivery.end(&*self.resources.observer);
            }
        }
        drop(workspace);
        fault::finish();
        outcome
    }
}
