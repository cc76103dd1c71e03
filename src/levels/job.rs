//! A run that makes a tileset, and that can be resumed.

use super::cells::MOST;
use super::geo::Globe;
use super::tileset::{self, About, beside};
use crate::error::{Error, Result};
use crate::pipeline::Start;
use crate::stages::ingest;
use crate::workspace::memory::MemoryPool;
use crate::workspace::progress::{Cancel, Observer, Silent};
use crate::workspace::{Folder, Found, Storage, Workspace, fault};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The version of what a resumed run reads.
const FORMAT: &str = "tiles 1";

/// What decides the tileset besides the mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Place the tileset on the globe, by the reference system of the mesh.
    pub geo: bool,
    /// Most triangles of a leaf, unless it cannot be divided: for tests.
    #[doc(hidden)]
    pub most_triangles: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            geo: false,
            most_triangles: MOST,
        }
    }
}

/// What was made.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TilesReport {
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh: those of the leaves.
    pub triangles: u64,
    /// Edges of the mesh with one triangle.
    pub boundary_edges: u64,
    /// Number of tiles.
    pub tiles: u64,
    /// Tiles without children.
    pub leaves: u64,
    /// Levels of the tree.
    pub levels: u32,
    /// Bytes of all files.
    pub bytes: u64,
    /// Bytes of the root's file.
    pub root_bytes: u64,
    /// Triangles of the root.
    pub root_triangles: u64,
    /// Largest distance of the root from the mesh, at most, in the mesh's unit.
    pub root_error: f64,
    /// Step of the coordinates, in the mesh's unit.
    pub step: f64,
    /// True if all coordinates are multiples of the step.
    pub exact: bool,
}

impl std::fmt::Display for TilesReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        writeln!(
            f,
            "{} triangles in {} tiles of {} levels, {:.1} MB",
            self.triangles,
            self.tiles,
            self.levels,
            megabytes(self.bytes)
        )?;
        write!(
            f,
            "coarsest tile: {} triangles, {:.2} MB, at most {:.6} from the mesh",
            self.root_triangles,
            megabytes(self.root_bytes),
            self.root_error
        )
    }
}

/// The making of a tileset.
pub struct Tiles {
    mesh: PathBuf,
    folder: PathBuf,
    scratch: Option<PathBuf>,
    options: Options,
    memory: Option<u64>,
    threads: Option<usize>,
    observer: Arc<dyn Observer>,
    cancel: Cancel,
    storage: Storage,
    start: Start,
}

/// What a run began with.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Manifest {
    format: String,
    version: String,
    mesh: PathBuf,
    output: PathBuf,
    options: Options,
    bytes: u64,
    modified: (i64, i64),
    sample: u32,
}

/// Bytes at each end of the mesh by which another content is noticed.
const SAMPLE: u64 = 1 << 16;

impl Manifest {
    fn of(job: &Tiles) -> Result<Self> {
        let path = &job.mesh;
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
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            mesh: whole(path),
            output: whole(&job.folder),
            options: job.options.clone(),
            bytes: about.len(),
            modified: (about.mtime(), about.mtime_nsec()),
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

impl Tiles {
    /// Makes the tileset `folder` of `mesh`, a PLY file.
    pub fn new(mesh: impl Into<PathBuf>, folder: impl Into<PathBuf>) -> Self {
        Self {
            mesh: mesh.into(),
            folder: folder.into(),
            scratch: None,
            options: Options::default(),
            memory: None,
            threads: None,
            observer: Arc::new(Silent),
            cancel: Cancel::new(),
            storage: Storage::default(),
            start: Start::New,
        }
    }

    /// What decides the tileset.
    #[must_use]
    pub fn options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Folder for scratch files; default: beside the output.
    #[must_use]
    pub fn scratch(mut self, path: impl Into<PathBuf>) -> Self {
        self.scratch = Some(path.into());
        self
    }

    /// Memory budget in bytes; default: half of what machine and cgroup allow.
    #[must_use]
    pub fn memory(mut self, bytes: u64) -> Self {
        self.memory = Some(bytes);
        self
    }

    /// Worker threads; default: all available.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = Some(threads);
        self
    }

    /// Receiver of progress.
    #[must_use]
    pub fn observer(mut self, observer: Arc<dyn Observer>) -> Self {
        self.observer = observer;
        self
    }

    /// The flag that stops the run.
    #[must_use]
    pub fn cancel(mut self, cancel: Cancel) -> Self {
        self.cancel = cancel;
        self
    }

    /// How scratch files are read and written.
    #[must_use]
    pub fn storage(mut self, storage: Storage) -> Self {
        self.storage = storage;
        self
    }

    /// Treatment of an unfinished run with the same output and scratch folder; default: an error.
    #[must_use]
    pub fn start(mut self, start: Start) -> Self {
        self.start = start;
        self
    }

    /// The scratch folder of the run.
    #[must_use]
    pub fn scratch_folder(&self) -> PathBuf {
        crate::pipeline::scratch_folder(&self.folder, self.scratch.as_deref())
    }

    fn open(&self) -> Result<Workspace> {
        let path = self.scratch_folder();
        let manifest = Manifest::of(self)?;
        let bytes = manifest.to_bytes(&path)?;
        let folder = match (Folder::find(&path)?, self.start) {
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
        let memory = self.memory.unwrap_or_else(crate::pipeline::default_memory);
        let threads = self
            .threads
            .unwrap_or_else(crate::pipeline::default_threads);
        let pool = MemoryPool::new(memory)?;
        let (observer, cancel) = (self.observer.clone(), self.cancel.clone());
        let workspace = Workspace::resumable(folder, pool, threads, observer, cancel)?;
        workspace.set_storage(self.storage)?;
        Ok(workspace)
    }

    /// Makes the tileset.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that is no mesh of triangles in PLY; [`Error::Parameter`] if the folder has other
    /// files; [`Error::Memory`] if the budget is too small; [`Error::Io`], [`Error::Disk`], [`Error::Corrupt`],
    /// [`Error::Cancelled`]; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<TilesReport> {
        tileset::check_folder(&self.folder)?;
        let workspace = self.open()?;
        let outcome = self.make(&workspace);
        let path = self.scratch_folder();
        let keep = outcome.as_ref().is_err_and(Error::can_resume) && Folder::has_progress(&path);
        if !keep {
            workspace.remove(outcome.is_ok());
            // If it cannot be deleted it does no harm.
            let _ = tileset::remove(&beside(&self.folder, "part"));
        }
        drop(workspace);
        fault::finish();
        outcome
    }

    fn make(&self, workspace: &Workspace) -> Result<TilesReport> {
        let (crs, warning) = ingest::of_prj(&ingest::prj_of(&self.mesh));
        if let Some(warning) = warning {
            workspace.observer.warn(&warning);
        }
        let code = crs.as_ref().and_then(|crs| crs.horizontal);
        // What cannot be placed is refused before the work.
        let globe = match self.options.geo {
            true => Some(Globe::of(&self.mesh, code)?),
            false => None,
        };
        let source = self.mesh.file_name().unwrap_or_default();
        let about = |origin: [f64; 3], high: [f64; 3]| {
            let middle = std::array::from_fn(|axis| (origin[axis] + high[axis]) / 2.0);
            let globe = globe.as_ref();
            let matrix = globe.map(|globe| globe.matrix(&self.mesh, origin, middle));
            Ok(About {
                source: source.to_string_lossy().into_owned(),
                epsg: code,
                crs: crs.map(|crs| crs.wkt().map_or_else(|| crs.line(), str::to_owned)),
                transform: matrix.transpose()?,
            })
        };
        super::make(&self.mesh, &self.folder, &self.options, about, workspace)
    }
}
