//! The driver: the stages in the order the data flows.

mod attempt;
mod builder;
mod checks;
mod clock;
mod disk;
mod manifest;
mod points;

use crate::error::Result;
use crate::method::METHOD;
use crate::params::{Method, Params};
use crate::report::{LatticeReport, Report};
use crate::stages::blocks::Blocks;
use crate::stages::cells::{DiskRadius, TileRanges, Widen, cells};
use crate::stages::export::{CoordinateType, export};
use crate::stages::ingest::{self, ingest_classes};
use crate::stages::located::Places;
use crate::stages::repair::{RepairOptions, repair};
use crate::stages::smooth::{Relaxing, relax, smooth};
use crate::stages::spacing::Density;
use crate::stages::stitch::{StitchOptions, stitch};
use crate::stages::triples::triples;
use crate::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use crate::workspace::progress::{Cancel, Observer};
use crate::workspace::{Workspace, limits};
use attempt::Alarm;
pub use attempt::Start;
pub use builder::Builder;
pub(crate) use checks::disk_radius;
use checks::{enough, not_a_line, not_an_input, room, writable};
pub(crate) use clock::Clock;
pub use disk::DiskEstimate;
pub(crate) use disk::Known;
pub(crate) use points::order;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A reconstruction that is ready to run. Made by [`Reconstruction::builder`].
pub struct Reconstruction {
    inputs: Vec<PathBuf>,
    output: PathBuf,
    folder: PathBuf,
    params: Params,
    memory: MemoryPool,
    threads: usize,
    tile_points: u32,
    page_points: usize,
    observer: Arc<dyn Observer>,
    cancel: Cancel,
    start: Start,
    time_limit: Option<Duration>,
}

/// Half of the memory that machine and cgroup allow.
#[must_use]
pub fn default_memory() -> u64 {
    share_of(limits::memory_allowed())
}

/// Half of what is allowed, but no less than the least budget if that is allowed.
fn share_of(allowed: u64) -> u64 {
    (allowed / 2).max(allowed.min(MINIMUM_BUDGET))
}

/// All threads the system offers to this process.
#[must_use]
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

impl Reconstruction {
    /// Starts a description of a reconstruction.
    #[must_use]
    pub fn builder() -> Builder {
        Builder::default()
    }

    /// The description of the run that was left unfinished in a scratch folder; threads, memory,
    /// observer, flag and time limit can be set anew.
    ///
    /// # Errors
    /// [`crate::Error::NotResumable`], [`crate::Error::Locked`], [`crate::Error::Io`].
    pub fn resume(folder: impl AsRef<Path>) -> Result<Builder> {
        attempt::unfinished(folder.as_ref())
    }

    /// Where the mesh goes.
    #[must_use]
    pub fn output(&self) -> &Path {
        &self.output
    }

    /// Reconstructs the surface and writes the mesh.
    ///
    /// # Errors
    /// Any [`crate::Error`]; the output is then untouched. Scratch files are gone, unless the run can be
    /// resumed, see [`Reconstruction::is_unfinished`].
    pub fn run(&self) -> Result<Report> {
        writable(&self.output)?;
        not_an_input(&self.output, &self.inputs)?;
        let _alarm = self
            .time_limit
            .map(|limit| Alarm::set(limit, self.cancel.clone()));
        let workspace = self.open()?;
        let outcome = self.stages(&workspace);
        self.close(workspace, &outcome);
        outcome
    }

    /// All stages, in the order the data flows.
    fn stages(&self, workspace: &Workspace) -> Result<Report> {
        let begin = Instant::now();
        let params = &self.params;
        let mut clock = Clock::new(workspace);
        let fits = |estimate| room(&self.folder, &self.output, estimate, workspace);
        let first = Known::from_headers(&self.inputs).map(|known| known.estimate(params));
        first.map_or(Ok(()), fits)?;

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
        let coordinates = match spool.source_precision() {
            ingest::CoordinateType::F32 => CoordinateType::Float,
            ingest::CoordinateType::F64 => CoordinateType::Double,
        };
        let mut known = Known {
            read: input.kept,
            spool: spool.bytes(),
            points: input.kept,
            double: Some(coordinates == CoordinateType::Double),
            moved: None,
        };
        if params.thin.is_some() {
            // Nobody knows how many stay.
            known.points = 0;
        }
        fits(known.estimate(params))?;
        let refine = if params.smooth + params.relax > 0 {
            METHOD.smoothing.halvings
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
        known.points = store.len() as u64;
        fits(known.estimate(params))?;
        let (mut store, outliers) = self.without_outliers(store, &mut clock, workspace)?;
        enough(&store)?;
        let points = store.len() as u64;
        let radius = disk_radius(params.radius, &store, &lattice);
        let blocks = Blocks::new(store.len(), params.block);
        let tiles = TileRanges::new(blocks, self.tile_points);
        workspace.trim();
        for round in 1..=params.smooth {
            store = clock.stage("smooth", "points", points, || {
                let (k, smoothing) = (params.neighbors, params.smoothing);
                smooth(&store, tiles, k, smoothing, round, workspace)
            })?;
        }
        let relaxing = Relaxing {
            neighbors: params.neighbors,
            rounds: params.relax,
            smoothed: params.smooth > 0,
            off_surface: params.off_surface(),
        };
        let relaxed = if params.relax > 0 || params.method == Method::Robust {
            Some(clock.stage(
                "relax",
                "points",
                points * u64::from(params.relax.max(1)),
                || relax(&store, tiles, relaxing, workspace),
            )?)
        } else {
            None
        };
        known.points = points;
        known.moved = relaxed.as_ref().map(|r| r.store.is_some());
        let noisy = relaxed.as_ref().is_some_and(|r| r.is_noisy(points));
        let estimate = known.estimate(params);
        fits(estimate)?;
        let robust = relaxed.as_ref().filter(|_| params.method == Method::Robust);
        let density = robust.map(|relaxed| Density {
            spacings: &relaxed.spacings,
            neighbors: params.neighbors,
            limits: params.limits(lattice.step),
        });
        let places = Places {
            shape: relaxed
                .as_ref()
                .and_then(|r| r.store.as_ref())
                .unwrap_or(&store),
            file: &store,
            density,
        };
        workspace.trim();
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
                density,
                workspace,
            )
        })?;
        not_a_line(&cell_stats, points)?;
        workspace.trim();
        let (triples, triple_stats) =
            clock.stage("triples", "triples", 0, || triples(seen, blocks, workspace))?;
        let count = blocks.count() as u64;
        let extraction = StitchOptions {
            cos_max_angle: params.cos_max_angle(),
            weigh: (params.method == Method::Robust).then_some(params.division),
        };
        let (stitched, base, insertion) = clock.stage("stitch", "blocks", 3 * count, || {
            stitch(places, triples, blocks, extraction, workspace)
        })?;
        let options = RepairOptions {
            repair: params.repair,
            min_component: params.least_component(points, noisy),
            max_hole_edges: params.max_hole_edges,
            flip: params.method == Method::Robust,
            zip: params.method == Method::Robust,
        };
        workspace.trim();
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
            resident_file_bytes: limits::resident_file(),
            peak_held_bytes: self.memory.peak_held(),
            held_at_peak: self.memory.held_at_peak(),
            peak_reserved_bytes: self.memory.peak(),
            reserved_at_peak: self.memory.at_peak(),
            estimated_first: first,
            estimated_scratch_bytes: estimate.scratch,
            estimated_output_bytes: estimate.output,
            peak_scratch_bytes: workspace.io.scratch_peak(),
            seconds: begin.elapsed().as_secs_f64() + clock.earlier,
            stages: clock.stages,
        })
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
        // Too little is refused, with what is the least.
        assert_eq!(share_of(mib(100)), mib(100));
    }
}
