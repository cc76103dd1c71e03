//! The driver: the stages in the order the data flows.

mod points;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::params::{Method, Params, Radius};
use crate::report::{LatticeReport, PartReport, Report, StageReport};
use crate::stages::blocks::Blocks;
use crate::stages::cells::{CellStats, DiskRadius, TileRanges, Widen, cells};
use crate::stages::export::{CoordinateType, export};
use crate::stages::ingest::{self, ingest_classes};
use crate::stages::located::Places;
use crate::stages::order::{PAGE, PointStore};
use crate::stages::repair::{RepairOptions, repair};
use crate::stages::smooth::{relax, smooth};
use crate::stages::stitch::{StitchOptions, stitch};
use crate::stages::triples::triples;
use crate::workspace::memory::MemoryPool;
use crate::workspace::progress::{Cancel, Observer, Silent};
use crate::workspace::{Workspace, limits};
pub(crate) use points::order;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Halvings of the lattice step before smoothing, so that rounding does not undo it.
const SMOOTH_REFINE: u32 = 10;

/// A reconstruction that is ready to run. Made by [`Reconstruction::builder`].
pub struct Reconstruction {
    inputs: Vec<PathBuf>,
    output: PathBuf,
    scratch: PathBuf,
    params: Params,
    memory: MemoryPool,
    threads: usize,
    tile_points: u32,
    page_points: usize,
    observer: Arc<dyn Observer>,
    cancel: Cancel,
}

/// Collects what a [`Reconstruction`] needs; everything but inputs and output has a default.
#[derive(Default)]
pub struct Builder {
    inputs: Vec<PathBuf>,
    output: PathBuf,
    scratch: Option<PathBuf>,
    params: Params,
    memory: Option<u64>,
    threads: Option<usize>,
    tile_points: Option<u32>,
    page_points: Option<usize>,
    observer: Option<Arc<dyn Observer>>,
    cancel: Cancel,
}

impl Builder {
    /// Adds a file or folder of points; together they are one cloud.
    #[must_use]
    pub fn input(mut self, path: impl Into<PathBuf>) -> Self {
        self.inputs.push(path.into());
        self
    }

    /// Where the mesh goes (binary PLY).
    #[must_use]
    pub fn output(mut self, path: impl Into<PathBuf>) -> Self {
        self.output = path.into();
        self
    }

    /// Folder for scratch files; default: beside the output.
    #[must_use]
    pub fn scratch(mut self, path: impl Into<PathBuf>) -> Self {
        self.scratch = Some(path.into());
        self
    }

    /// Geometric parameters.
    #[must_use]
    pub fn params(mut self, params: Params) -> Self {
        self.params = params;
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

    /// Who is told of progress.
    #[must_use]
    pub fn observer(mut self, observer: Arc<dyn Observer>) -> Self {
        self.observer = Some(observer);
        self
    }

    /// The flag that stops the run.
    #[must_use]
    pub fn cancel(mut self, cancel: Cancel) -> Self {
        self.cancel = cancel;
        self
    }

    /// Checks everything that can be checked before work starts.
    ///
    /// # Errors
    /// [`Error::Parameter`], [`Error::Memory`].
    pub fn build(self) -> Result<Reconstruction> {
        self.params.check()?;
        let missing = |name, expected: &str| {
            Err(Error::Parameter {
                name,
                found: "nothing".into(),
                expected: expected.into(),
            })
        };
        if self.inputs.is_empty() {
            return missing("INPUT", "at least one file or folder");
        }
        if self.output.as_os_str().is_empty() {
            return missing("--output", "the path of the mesh");
        }
        let budget = self.memory.unwrap_or_else(default_memory);
        let parent = self.output.parent().filter(|p| !p.as_os_str().is_empty());
        let scratch = self
            .scratch
            .unwrap_or_else(|| parent.unwrap_or(Path::new(".")).into());
        Ok(Reconstruction {
            inputs: self.inputs,
            output: self.output,
            scratch,
            memory: MemoryPool::new(budget)?,
            threads: self.threads.unwrap_or_else(default_threads),
            tile_points: self.tile_points.unwrap_or(self.params.block),
            page_points: self.page_points.unwrap_or(PAGE),
            params: self.params,
            observer: self.observer.unwrap_or_else(|| Arc::new(Silent)),
            cancel: self.cancel,
        })
    }
}

/// Half of the memory that machine and cgroup allow.
#[must_use]
pub fn default_memory() -> u64 {
    limits::memory_allowed() / 2
}

/// All threads the system offers to this process.
#[must_use]
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Runs stages and notes what each takes.
pub(crate) struct Clock<'a> {
    workspace: &'a Workspace,
    stages: Vec<StageReport>,
}

impl<'a> Clock<'a> {
    pub(crate) fn new(workspace: &'a Workspace) -> Self {
        Self {
            workspace,
            stages: Vec::new(),
        }
    }

    pub(crate) fn stage<T>(
        &mut self,
        name: &'static str,
        unit: &'static str,
        total: u64,
        work: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        let io = &self.workspace.io;
        let (start, read, written) = (Instant::now(), io.read(), io.written());
        self.workspace.observer.begin(name, unit, total);
        let outcome = work();
        self.workspace.observer.end();
        let parts = self.workspace.take_parts().into_iter();
        self.stages.push(StageReport {
            name,
            seconds: start.elapsed().as_secs_f64(),
            bytes_read: io.read() - read,
            bytes_written: io.written() - written,
            parts: parts
                .map(|(name, seconds)| PartReport { name, seconds })
                .collect(),
        });
        outcome
    }
}

impl Reconstruction {
    /// Starts a description of a reconstruction.
    #[must_use]
    pub fn builder() -> Builder {
        Builder::default()
    }

    /// Reconstructs the surface and writes the mesh.
    ///
    /// # Errors
    /// Any [`Error`]; the output is then untouched and scratch files are gone.
    pub fn run(&self) -> Result<Report> {
        let begin = Instant::now();
        writable(&self.output)?;
        not_an_input(&self.output, &self.inputs)?;
        let workspace = &Workspace::new(
            &self.scratch,
            self.memory.clone(),
            self.threads,
            self.observer.clone(),
            self.cancel.clone(),
        )?;
        let params = &self.params;
        let mut clock = Clock::new(workspace);

        let spool = clock.stage("ingest", "points", 0, || {
            ingest_classes(&self.inputs, &params.classes, workspace)
        })?;
        let input = spool.stats().clone();
        let mut warnings = input.warnings.clone();
        if input.dropped_non_finite > 0 {
            let count = input.dropped_non_finite;
            warnings.push(format!(
                "{count} points left out: a coordinate is NaN or infinite"
            ));
        }
        room(&self.scratch, input.kept * self.scratch_per_point())?;
        let coordinates = match spool.source_precision() {
            ingest::CoordinateType::F32 => CoordinateType::Float,
            ingest::CoordinateType::F64 => CoordinateType::Double,
        };
        let refine = if params.smooth + params.relax > 0 {
            SMOOTH_REFINE
        } else {
            0
        };
        let lattice = spool.choose_lattice(refine)?;
        let (store, duplicates_folded, thin) =
            self.in_order(spool, &lattice, &mut clock, workspace)?;
        if !lattice.exact && duplicates_folded > input.kept / 100 {
            warnings.push(format!(
                "{duplicates_folded} points fell together: the cloud is so wide that positions had to \
                 be rounded to steps of {}; are there outliers far away?",
                lattice.step
            ));
        }
        warnings.iter().for_each(|w| self.observer.warn(w));
        enough(&store)?;
        if params.thin.is_some() {
            room(&self.scratch, store.len() as u64 * SCRATCH_PER_POINT)?;
        }
        let (mut store, outliers) = self.without_outliers(store, &mut clock, workspace)?;
        enough(&store)?;
        let points = store.len() as u64;
        let radius = disk_radius(params.radius, &store, &lattice);
        let blocks = Blocks::new(store.len(), params.block);
        let tiles = TileRanges::new(blocks, self.tile_points);
        for round in 1..=params.smooth {
            store = clock.stage("smooth", "points", points, || {
                let (k, smoothing) = (params.neighbors, params.smoothing);
                smooth(&store, tiles, k, smoothing, round, workspace)
            })?;
        }
        let relaxed = if params.relax > 0 {
            Some(clock.stage(
                "relax",
                "points",
                points * u64::from(params.relax + 1),
                || relax(&store, tiles, params.neighbors, params.relax, workspace),
            )?)
        } else {
            None
        };
        let places = Places {
            shape: relaxed
                .as_ref()
                .and_then(|r| r.store.as_ref())
                .unwrap_or(&store),
            file: &store,
        };
        let (seen, cell_stats) = clock.stage("cells", "points", points, || {
            let widen = match params.method {
                Method::Robust => Widen::OnBands,
                Method::Paper => Widen::OnLines,
            };
            cells(
                places.shape,
                tiles,
                params.neighbors,
                radius,
                widen,
                workspace,
            )
        })?;
        not_a_line(&cell_stats, points)?;
        let (triples, triple_stats) =
            clock.stage("triples", "triples", 0, || triples(seen, blocks, workspace))?;
        let count = blocks.count() as u64;
        let extraction = StitchOptions {
            cos_max_angle: params.cos_max_angle(),
            weigh: params.method == Method::Robust,
        };
        let (stitched, base, insertion) = clock.stage("stitch", "blocks", 3 * count, || {
            stitch(places, triples, blocks, extraction, workspace)
        })?;
        let options = RepairOptions {
            repair: params.repair,
            min_component: params.least_component(points),
            max_hole_edges: params.max_hole_edges,
            zip: params.method == Method::Robust,
        };
        let (repaired, repair) = clock.stage("repair", "blocks", 2 * count, || {
            repair(places, stitched, blocks, options, workspace)
        })?;
        let mesh = clock.stage("export", "blocks", 2 * count, || {
            export(
                &store,
                &repaired,
                blocks,
                &lattice,
                coordinates,
                &self.output,
                workspace,
            )
        })?;

        Ok(Report {
            version: env!("CARGO_PKG_VERSION"),
            parameters: params.clone(),
            memory_budget: self.memory.budget(),
            threads: self.threads,
            warnings,
            input,
            duplicates_folded,
            thin,
            outliers,
            points,
            lattice: LatticeReport {
                step: lattice.step,
                exact: lattice.exact,
            },
            radius: match radius {
                DiskRadius::Auto => None,
                DiskRadius::Steps(steps) => Some(steps * lattice.step),
            },
            relax: relaxed.as_ref().map(|r| r.stats),
            cells: cell_stats,
            triples: triple_stats,
            base,
            insertion,
            holes_left: repair.holes_found - repair.holes_filled,
            repair,
            mesh,
            coordinates,
            peak_resident_bytes: limits::peak_resident(),
            peak_reserved_bytes: self.memory.peak(),
            peak_scratch_bytes: workspace.io.scratch_peak(),
            seconds: begin.elapsed().as_secs_f64(),
            stages: clock.stages,
        })
    }
}

/// Disks larger than this, in steps, see all of any cloud.
const LARGEST_RADIUS: f64 = (1u64 << 34) as f64;

/// The radius in lattice steps.
pub(crate) fn disk_radius(radius: Radius, store: &PointStore, lattice: &Lattice) -> DiskRadius {
    match radius {
        Radius::Auto => DiskRadius::Auto,
        Radius::Length(length) => DiskRadius::Steps((length / lattice.step).min(LARGEST_RADIUS)),
        Radius::Percent(percent) => {
            let bounds = store.bounds();
            let diagonal = (crate::geom::distance2(bounds.min, bounds.max) as f64).sqrt();
            DiskRadius::Steps((percent / 100.0 * diagonal).min(LARGEST_RADIUS))
        }
    }
}

/// Finds out before any work whether the output's folder takes files.
fn writable(output: &Path) -> Result<()> {
    let folder = output
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    if output.is_dir() {
        let error = std::io::Error::from(std::io::ErrorKind::IsADirectory);
        return Err(Error::io(output, "write the mesh", error));
    }
    tempfile::tempfile_in(folder)
        .map(drop)
        .map_err(|e| Error::io(output, "write the mesh into this folder", e))
}

/// Scratch bytes a point at the peak, about, after the points were read; measured on real scans.
pub(crate) const SCRATCH_PER_POINT: u64 = 50;

/// Refuses before the long stages what the scratch folder has no room for.
fn room(scratch: &Path, needed: u64) -> Result<()> {
    match limits::disk_free(scratch) {
        Some(free) if free < needed => Err(Error::Disk {
            path: scratch.to_path_buf(),
            needed,
            free,
        }),
        _ => Ok(()),
    }
}

/// Refuses to replace a file that the cloud is read from.
fn not_an_input(output: &Path, inputs: &[PathBuf]) -> Result<()> {
    let Ok(output) = output.canonicalize() else {
        return Ok(());
    };
    for input in ingest::expand(inputs)? {
        if input.canonicalize().is_ok_and(|input| input == output) {
            return Err(Error::Parameter {
                name: "--output",
                found: format!("{} (an input)", output.display()),
                expected: "another file".into(),
            });
        }
    }
    Ok(())
}

fn enough(store: &PointStore) -> Result<()> {
    if store.len() >= 3 {
        return Ok(());
    }
    let found = match store.len() {
        0 => "no points".to_owned(),
        1 => "one distinct point".to_owned(),
        n => format!("{n} distinct points"),
    };
    Err(Error::Degenerate { found })
}

fn not_a_line(stats: &CellStats, points: u64) -> Result<()> {
    if stats.no_plane < points {
        return Ok(());
    }
    Err(Error::Degenerate {
        found: format!("{points} distinct points, all on one line"),
    })
}
