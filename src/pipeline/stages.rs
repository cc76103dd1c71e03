//! The stages of a run: each with its parameters, its part of the report, and the check of disk space for the
//! following stages.

mod cells;
mod confidence;
mod draw;
mod export;
mod moved;
mod plan;
mod shape;
mod side;
mod values;
mod warnings;

use super::checks::{all_are_kept, disk_radius, enough, room};
use super::disk::{DISTINCT, NORMAL, SCANNER, SURE, Text, made};
use super::{Clock, Files, Known, Reconstruction};
use crate::params::Method;
use crate::report::{LatticeReport, Report};
use export::written;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::course::Course;
use outcrop_formats::ingest_selected;
use outcrop_geom::lattice::Lattice;
use outcrop_mesh::repair::{RepairOptions, Repaired, repair};
use outcrop_mesh::stitch::{StitchOptions, Stitched, stitch};
use outcrop_mesh::triples::{Triples, triples};
use outcrop_mesh_files::cut::{CutOptions, StoredPieces, cut};
use outcrop_mesh_files::export::CoordinateType;
use outcrop_paper::method::method_version;
use outcrop_points::{Attributes, Carried, Column, Spool};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{CellTriples, DiskRadius, TileRanges};
use outcrop_stages::located::Places;
use outcrop_stages::order::{Orderer, PointStore, StoredPoints, order, sample_sort};
use outcrop_stages::outliers::{OutlierOptions, drop_outliers};
use outcrop_stages::thin::{Grid, LeftOut, thin};
use std::time::Instant;

/// Halvings of the lattice step before points move, so that rounding does not undo the movement. With 5 or 20
/// no figure of docs/ablation.md changes by more than chance.
const HALVINGS: u32 = 10;

/// The points that the surface is made of, and their division.
pub(super) struct Divided {
    pub points: StoredPoints,
    pub blocks: Blocks,
    pub tiles: TileRanges,
}

impl Divided {
    fn new(points: StoredPoints, job: &Reconstruction) -> Self {
        let blocks = Blocks::new(points.len(), job.params.block);
        Self {
            points,
            blocks,
            tiles: TileRanges::new(blocks, job.tile_points),
        }
    }
}

/// The stages of one run.
pub(super) struct Stages<'a> {
    job: &'a Reconstruction,
    workspace: &'a Workspace,
    clock: Clock<'a>,
    begin: Instant,
    known: Known,
    unestimated: Option<String>,
    carried: Carried,
    report: Report,
    /// Step of the lattice before it was refined.
    coarse: f64,
    /// Decimals of coordinates as text.
    decimals: usize,
    /// Well-known text of the reference system.
    wkt: Option<String>,
    /// The course of the attempt, if the report shows it.
    course: Option<Course>,
}

impl<'a> Stages<'a> {
    /// Begins with the estimate of disk space from the headers of the inputs.
    pub fn begin(job: &'a Reconstruction, workspace: &'a Workspace) -> Result<Self> {
        // A task leaves the check of disk space to the process that began its generation.
        // With a region, headers do not tell how many points there will be.
        let (headers, unestimated) = match workspace.is_task() || job.params.crop.is_some() {
            true => (None, None),
            false => Known::or_warning(&job.inputs, &job.params.selection()),
        };
        let first = headers.map(|known| known.estimate(&job.params, Files::of_job(job)));
        let mut exceeded = None;
        if let Some(known) = headers.filter(|_| all_are_kept(&job.params)) {
            exceeded = known.fits(&job.params, &job.mesh, DISTINCT)?;
        }
        let mut stages = Self {
            job,
            workspace,
            clock: Clock::new(workspace),
            begin: Instant::now(),
            known: headers.unwrap_or_default(),
            unestimated,
            carried: Carried::default(),
            coarse: 0.0,
            decimals: 0,
            wkt: None,
            course: (job.pictures && !workspace.is_shared())
                .then(|| Course::start(job.memory.clone(), workspace.io.clone())),
            report: Report {
                version: env!("CARGO_PKG_VERSION"),
                method_version: method_version!(),
                parameters: job.params.clone(),
                memory_budget: job.memory.budget(),
                threads: job.threads,
                estimated_first: first,
                ..Report::default()
            },
        };
        stages.plan(
            stages.known.read,
            None,
            job.params.attributes != Attributes::None,
        );
        if let Some(error) = exceeded {
            stages.warn(format!("{error}; unless many points are the same"));
        }
        if let Some(estimate) = first {
            room(&job.folder, &job.mesh, estimate, workspace)?;
        }
        Ok(stages)
    }

    /// Ends the run if the disk is too small for the following stages.
    fn check_room(&mut self) -> Result<()> {
        if self.workspace.is_task() {
            return Ok(());
        }
        let (params, output) = (&self.job.params, &self.job.mesh);
        // What these leave out, and how much a square has, is not known yet.
        let whole = params.crop.is_none() && params.split.is_none();
        if whole && params.drop_outliers.is_none() {
            self.known.fits(params, output, SURE)?;
        }
        let estimate = self.known.estimate(params, Files::of_job(self.job));
        self.report.estimated_scratch_bytes = estimate.scratch;
        self.report.estimated_output_bytes = estimate.output;
        room(&self.job.folder, &self.job.mesh, estimate, self.workspace)
    }

    fn warn(&mut self, warning: String) {
        // Of a run that tasks share, the process that finishes it has them in its report.
        if !self.workspace.is_task() {
            self.job.observer.warn(&warning);
        }
        self.report.warnings.push(warning);
    }

    /// Reads the files; returns the points and their lattice.
    pub fn ingest(&mut self) -> Result<(Spool, Lattice)> {
        let (job, workspace) = (self.job, self.workspace);
        let params = &job.params;
        let selection = params.selection();
        let spool = self.clock.stage("ingest", "points", 0, || {
            let mut spool = ingest_selected(&job.inputs, &selection, workspace)?;
            if !params.keep_far {
                spool.drop_far(workspace)?;
            }
            Ok(spool)
        })?;
        self.carried = self.carry(&spool);
        self.report.attributes = self.carried.attributes.clone();
        let input = spool.stats().clone();
        if let Some(mixed) = input.mixed.as_ref().filter(|_| !params.ignore_crs) {
            return Err(mixed.refused());
        }
        self.wkt = spool.wkt().map(str::to_owned);
        self.report.coordinates = written(spool.source_precision());
        let scanner = if self.carried.has_scanners() {
            SCANNER
        } else {
            0
        };
        let normal = if self.carried.has_normals() {
            NORMAL
        } else {
            0
        };
        self.known = Known {
            read: input.kept,
            spool: spool.bytes(),
            decompressed: 0,
            // With thinning, the number of points that stay is unknown.
            points: if params.thin.is_some() { 0 } else { input.kept },
            values: self.carried.bytes() as u64 - scanner - normal + made(&params.attributes),
            scanner,
            normal,
            double: Some(self.report.coordinates == CoordinateType::Double),
            moved: None,
            text: None,
        };
        workspace.note_points(input.kept);
        self.plan(input.kept, Some("ingest"), !self.carried.is_empty());
        let narrow = params.narrow_margin(&input, &*job.observer);
        self.report.input = input;
        self.warn_of_input();
        narrow.into_iter().for_each(|warning| self.warn(warning));
        self.check_room()?;
        let moves = params.smooth.rounds() + params.relax > 0;
        let lattice = spool.choose_lattice(if moves { HALVINGS } else { 0 })?;
        let own = spool.choose_lattice(0)?;
        self.coarse = own.step;
        self.decimals = Text::decimals(&own, &lattice, params);
        self.check_origin(&lattice)?;
        self.check_facing(&lattice)?;
        self.report.lattice = LatticeReport {
            step: lattice.step,
            exact: lattice.exact,
        };
        Ok((spool, lattice))
    }

    /// Sorts the points along the curve, thinned if requested; duplicates become one point. The spool comes back if
    /// values are still to be read.
    pub fn order(
        &mut self,
        spool: Spool,
        lattice: &Lattice,
    ) -> Result<(StoredPoints, Option<Spool>)> {
        let (job, workspace) = (self.job, self.workspace);
        let (points, page) = (spool.points(), job.page_points);
        let grid = job.params.thin.and_then(|side| Grid::new(lattice, side));
        let (store, spool) = if let Some(grid) = grid {
            let (thinned, spool) = self.clock.stage("thin", "points", points, || {
                thin(spool, lattice, grid, workspace)
            })?;
            let (store, left_out) = self.clock.stage("order", "points", 0, || {
                let orderer = Orderer::for_points(workspace, points)?;
                let left_out: LeftOut = orderer
                    .take_stream(workspace, |from, left_out, each| {
                        thinned.for_each(workspace, from, left_out, each)
                    })?;
                let (store, _) = orderer.finish(workspace, page)?;
                Ok((store, left_out))
            })?;
            thinned.release(workspace)?;
            self.report.duplicates_folded = left_out.duplicates;
            self.report.thin = left_out.thin;
            (store, spool)
        } else {
            let (store, folded, spool) =
                self.clock
                    .stage("order", "points", points, || match workspace.is_shared() {
                        true => sample_sort(spool, lattice, page, workspace),
                        false => order(spool, lattice, page, workspace),
                    })?;
            self.report.duplicates_folded = folded;
            (store, spool)
        };
        let text = Text::of(self.decimals, lattice, &store);
        self.warn_of_duplicates(spool.as_ref(), lattice)?;
        let again = !self.carried.is_empty();
        let spool = spool.map_or(Ok(None), |spool| spool.kept_if(again, workspace))?;
        enough(&store)?;
        self.warn_of_left_out();
        self.known.points = store.len() as u64;
        self.known.text = Some(text);
        let mut columns = self.carried.columns.clone();
        let displaced = job.params.attributes.has_displacement();
        columns.extend(displaced.then(Column::displacement));
        let confident = job.params.attributes.has_confidence();
        columns.extend(confident.then(Column::confidence));
        let (shift, coordinates) = self.shift(store.bounds(), lattice)?;
        let place = (coordinates, shift.map_or([0.0; 3], |shift| shift.origin));
        for warning in self.known.left_out(job, &columns, place)? {
            self.warn(warning);
        }
        workspace.note_points(self.known.points);
        if job.params.thin.is_some() {
            self.plan(self.known.points, Some("order"), !self.carried.is_empty());
        }
        self.check_room()?;
        Ok((store, spool))
    }

    /// Drops outliers, if requested; the points that stay are divided.
    pub fn without_outliers(&mut self, store: StoredPoints) -> Result<Divided> {
        let (job, workspace) = (self.job, self.workspace);
        let Some(factor) = job.params.drop_outliers else {
            self.report.points = store.len() as u64;
            return Ok(Divided::new(store, job));
        };
        let options = OutlierOptions {
            factor,
            block: job.params.block,
            tile: job.tile_points,
        };
        let (store, stats) = self.clock.stage("outliers", "points", 0, || {
            drop_outliers(store, options, workspace)
        })?;
        enough(&store)?;
        self.report.outliers = stats;
        self.report.points = store.len() as u64;
        Ok(Divided::new(store, job))
    }

    /// The radius of the disks; a percentage refers to the points before smoothing.
    pub fn radius(&mut self, store: &StoredPoints, lattice: &Lattice) -> DiskRadius {
        let radius = disk_radius(self.job.params.radius, store, lattice);
        self.report.radius = match radius {
            DiskRadius::Auto => None,
            DiskRadius::Steps(steps) => Some(steps * lattice.step),
        };
        radius
    }

    /// Adds up the number of cells of each triple.
    pub fn triples(&mut self, seen: &CellTriples, blocks: Blocks) -> Result<Triples> {
        let workspace = self.workspace;
        workspace.trim();
        let (all, stats) = self
            .clock
            .stage("triples", "triples", 0, || triples(seen, blocks, workspace))?;
        seen.release(workspace)?;
        self.report.triples = stats;
        Ok(all)
    }

    /// Makes an oriented manifold from the triples.
    pub fn stitch(
        &mut self,
        places: Places<'_>,
        triples: Triples,
        blocks: Blocks,
    ) -> Result<Stitched> {
        let (params, workspace) = (&self.job.params, self.workspace);
        let options = StitchOptions {
            cos_max_angle: params.cos_max_angle(),
            weigh: (params.method == Method::Robust).then_some(params.division),
            keep_triples: params.attributes.has_confidence(),
        };
        let items = 3 * blocks.count() as u64;
        let (stitched, base, insertion) = self.clock.stage("stitch", "blocks", items, || {
            stitch(places, triples, blocks, options, workspace)
        })?;
        self.report.base = base;
        self.report.insertion = insertion;
        Ok(stitched)
    }

    /// Removes bridges and small components, and fills holes.
    pub fn repair(
        &mut self,
        places: Places<'_>,
        stitched: Stitched,
        blocks: Blocks,
    ) -> Result<Repaired> {
        let (params, workspace) = (&self.job.params, self.workspace);
        let points = blocks.points() as u64;
        let robust = params.method == Method::Robust;
        let options = RepairOptions {
            repair: params.repair,
            min_component: params.least_component(points, false),
            min_noisy_component: params.least_component(points, true),
            max_hole_edges: params.max_hole_edges,
            clip_ears: robust,
        };
        workspace.trim();
        let items = 2 * blocks.count() as u64;
        let (repaired, stats) = self.clock.stage("repair", "blocks", items, || {
            repair(places, stitched, blocks, options, workspace)
        })?;
        self.report.holes_left = stats.holes_found - stats.holes_filled;
        self.report.repair = stats;
        Ok(repaired)
    }

    /// Cuts the surface, if requested.
    pub fn cut(
        &mut self,
        store: &PointStore,
        repaired: &Repaired,
        blocks: Blocks,
        lattice: &Lattice,
    ) -> Result<Option<StoredPieces>> {
        let (params, workspace) = (&self.job.params, self.workspace);
        let options = CutOptions {
            region: params.crop.as_ref(),
            side: params.split,
            normals: params.normals,
        };
        if options.region.is_none() && options.side.is_none() {
            return Ok(None);
        }
        workspace.trim();
        let items = 2 * blocks.count() as u64;
        let (pieces, stats) = self.clock.stage("cut", "blocks", items, || {
            cut(store, repaired, blocks, lattice, options, workspace)
        })?;
        repaired.release(workspace)?;
        self.report.cut = stats;
        Ok(Some(pieces))
    }
}
