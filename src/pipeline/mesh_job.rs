//! A run on a finished mesh, which can be resumed: its manifest and its scratch folder.

use super::resources::Resources;
use super::{Start, start::scratch_folder};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::{Folder, Found, Workspace, fault};
use outcrop_platform::{FileAt, modified};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A run that makes something of a mesh.
pub(super) struct MeshJob<'a, O> {
    /// The version of what a resumed run reads.
    pub format: &'static str,
    pub mesh: &'a Path,
    pub output: &'a Path,
    /// The options that decide the result.
    pub options: &'a O,
    pub resources: &'a Resources,
}

/// Mesh and options of a run, by which it is resumed.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Manifest<O> {
    format: String,
    version: String,
    mesh: PathBuf,
    output: PathBuf,
    options: O,
    bytes: u64,
    modified: (i64, i64),
    sample: u32,
}

/// Bytes at each end of the mesh by which another content is noticed.
const SAMPLE: u64 = 1 << 16;

impl<O: Clone + Serialize> Manifest<O> {
    fn of(job: &MeshJob<'_, O>) -> Result<Self> {
        let path = job.mesh;
        let read = || {
            let file = File::open(path)?;
            let about = file.metadata()?;
            let mut crc = crc32fast::Hasher::new();
            for at in [0, about.len().saturating_sub(SAMPLE)] {
                let mut bytes = vec![0; (about.len() - at).min(SAMPLE) as usize];
                file.read_exact_at(&mut bytes, at)?;
                crc.update(&bytes);
            }
            Ok((about, crc.finalize()))
        };
        let (about, sample) = read().map_err(|e| Error::io(path, "read", e))?;
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        Ok(Self {
            format: job.format.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            mesh: whole(path),
            output: whole(job.output),
            options: job.options.clone(),
            bytes: about.len(),
            modified: modified(&about),
            sample,
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
        scratch_folder(self.output, self.resources.scratch.as_deref())
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
        let folder = match (found, self.resources.start) {
            (Found::Nothing, _) => Folder::create(&path, bytes)?,
            (Found::Run(folder), Start::Resume) => {
                manifest.check(&folder.manifest, &path)?;
                folder
            }
            (Found::Run(_) | Found::Damaged(_), Start::New) if Folder::has_progress(&path) => {
                return Err(Error::Unfinished { path });
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

    /// Does `make` in the scratch folder, and `clean` if the run cannot be resumed.
    pub fn run<T>(
        &self,
        make: impl FnOnce(&Workspace) -> Result<T>,
        clean: impl FnOnce(),
    ) -> Result<T> {
        let workspace = self.open()?;
        let outcome = make(&workspace);
        let keep = outcome.as_ref().is_err_and(Error::can_resume);
        if !(keep && Folder::has_progress(&self.scratch())) {
            workspace.remove(outcome.is_ok());
            clean();
        }
        drop(workspace);
        fault::finish();
        outcome
    }
}
