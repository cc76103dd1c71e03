//! A run on finished meshes or on clouds, which can be resumed: its manifest and its scratch folder.

use super::resources::Resources;
use super::{Start, start::scratch_folder};
use crate::deliver::Delivery;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::{Folder, Found, Workspace, fault};
use outcrop_formats::expand;
use outcrop_platform::{FileAt, modified};
use outcrop_points::is_remote;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A run that makes something of meshes or clouds.
pub(super) struct MeshJob<'a, O> {
    /// The version of what a resumed run reads.
    pub format: &'static str,
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
    format: String,
    version: String,
    inputs: Vec<PathBuf>,
    output: PathBuf,
    options: O,
    seen: Seen,
}

/// Size in bytes, time of change and checksum of the inputs: a resumed run notices other files of the same names.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Seen {
    bytes: u64,
    /// The latest change.
    modified: (i64, i64),
    sample: u32,
}

/// Bytes at each end of a file by which another content is noticed.
const SAMPLE: u64 = 1 << 16;

impl Seen {
    /// Looks at the inputs, and at the clouds in those that are folders.
    fn of(inputs: &[PathBuf]) -> Result<Self> {
        let (mut seen, mut crc) = (Self::default(), crc32fast::Hasher::new());
        for input in inputs {
            let files = match !is_remote(input) && input.is_dir() {
                true => expand(std::slice::from_ref(input))?,
                false => vec![input.clone()],
            };
            for path in &files {
                if is_remote(path) {
                    // Each attempt reads one version of it, or no more than what an earlier one read.
                    crc.update(path.as_os_str().as_encoded_bytes());
                    continue;
                }
                let read = seen.look(path, &mut crc);
                read.map_err(|e| Error::io(path, "read", e))?;
            }
        }
        seen.sample = crc.finalize();
        Ok(seen)
    }

    fn look(&mut self, path: &Path, crc: &mut crc32fast::Hasher) -> std::io::Result<()> {
        let file = File::open(path)?;
        let about = file.metadata()?;
        for at in [0, about.len().saturating_sub(SAMPLE)] {
            let mut bytes = vec![0; (about.len() - at).min(SAMPLE) as usize];
            file.read_exact_at(&mut bytes, at)?;
            crc.update(&bytes);
        }
        self.bytes += about.len();
        self.modified = self.modified.max(modified(&about));
        Ok(())
    }
}

impl<O: Clone + Serialize> Manifest<O> {
    fn of(job: &MeshJob<'_, O>) -> Result<Self> {
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let url = job.delivery.map(|delivery| delivery.url().to_path_buf());
        Ok(Self {
            format: job.format.into(),
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
            seen: Seen::of(job.inputs)?,
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
        let differing = now
            .as_object()
            .and_then(|now| now.iter().find(|(key, value)| was.get(key) != Some(value)));
        match differing {
            None => Ok(()),
            Some((key, value)) => Err(Error::Mismatch {
                path: folder.to_path_buf(),
                what: format!("the {key}"),
                was: was[key].to_string(),
                now: value.to_string(),
            }),
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
