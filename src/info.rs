//! Description of a cloud, and estimates for a run on it.

#[cfg(feature = "pages")]
mod drawing;
mod headers;
mod text;

use crate::params::Params;
use crate::pipeline::{Files, Known};
#[cfg(feature = "pages")]
pub use drawing::{Illustration, illustrated};
pub use headers::{Headers, headers};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use outcrop_draw::histogram::Tally;
use outcrop_formats::ingest_selected;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::Lattice;
use outcrop_paper::method::METHOD;
use outcrop_points::{Attributes, CoordinateType, IngestStats, Selection, Spool};
use outcrop_stages::attributes::attributes;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{CellMaker, DiskRadius, Widen, fit_in_tile};
use outcrop_stages::normals::{NormalStats, Normals, look};
use outcrop_stages::order::{PAGE, PointStore, StoredPoints, order};
use outcrop_stages::smooth::Gauge;
use outcrop_stages::tiles::Tile;
use outcrop_stages::tiles::near::Search;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Number of sampled sequences of points, and of points in each.
const SAMPLES: usize = 24;
const SAMPLE_POINTS: usize = 1024;

/// Time of the other stages per second of the stage of cells; measured on real scans.
const OTHER_STAGES: f64 = 1.3;

/// Percentiles of a length over a sample of the points, in the cloud's unit.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq)]
pub struct Percentiles {
    /// 5th percentile.
    pub p5: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
}

/// Description of a cloud, with estimates.
#[derive(Debug, Clone, Serialize)]
pub struct Info {
    /// Points and files.
    pub input: IngestStats,
    /// Points with the position of another one.
    pub duplicates: u64,
    /// Distinct points.
    pub points: u64,
    /// Lowest corner in the cloud's unit.
    pub min: [f64; 3],
    /// Highest corner in the cloud's unit.
    pub max: [f64; 3],
    /// Step of the lattice of the positions.
    pub lattice_step: f64,
    /// True if every position is on the lattice without rounding.
    pub lattice_exact: bool,
    /// The normals that points bring.
    pub normals: Option<NormalStats>,
    /// Distance to the nearest other point.
    pub spacing: Percentiles,
    /// Disk radius that `--radius auto` would use.
    pub auto_radius: Percentiles,
    /// Noise at a point, in local spacings: the root mean square height of the nearest points over a smooth
    /// surface through them.
    pub noise: Percentiles,
    /// Share of the points, from 0 to 1, with more noise than a clean surface has. By default they are smoothed
    /// where clean points are not among their neighbours.
    pub noisy: f64,
    /// Smallest memory budget, in bytes.
    pub memory_minimum: u64,
    /// Estimated peak of the scratch space, in bytes.
    pub scratch_bytes: u64,
    /// Estimated size of the mesh file, in bytes.
    pub output_bytes: u64,
    /// Estimated seconds of a run on these threads.
    pub seconds: f64,
}

/// Reads the cloud once, as far as it is selected by `params`, and samples it.
///
/// # Errors
/// As for a reconstruction, but a cloud that is too small for a surface is no error.
pub fn info(inputs: &[PathBuf], params: &Params, workspace: &Workspace) -> Result<Info> {
    described(inputs, params, None, workspace)
}

/// Draws the cloud while it is described.
trait Sketch {
    /// Counts what the spool tells.
    fn count(&mut self, spool: &Spool, lattice: &Lattice, workspace: &Workspace) -> Result<()>;

    /// Draws the points; `spacings` are squared distances to the nearest point.
    fn draw(
        &mut self,
        store: &PointStore,
        lattice: &Lattice,
        spacings: &Tally,
        workspace: &Workspace,
    ) -> Result<()>;
}

fn described(
    inputs: &[PathBuf],
    params: &Params,
    mut sketch: Option<&mut dyn Sketch>,
    workspace: &Workspace,
) -> Result<Info> {
    let start = Instant::now();
    let observer = &workspace.observer;
    observer.begin("ingest", "points", 0);
    let every = Selection {
        attributes: Attributes::None,
        scanners: true,
        ..params.selection()
    };
    let (headers, unestimated) = Known::or_warning(inputs, &every);
    let selection = Selection {
        scanners: false,
        depths: true,
        attributes: match sketch {
            // A list would have to be of columns that are there.
            Some(_) => Attributes::Auto,
            None => Attributes::None,
        },
        ..params.selection()
    };
    let mut spool = ingest_selected(inputs, &selection, workspace)?;
    spool.drop_far(workspace)?;
    observer.end();
    let input = spool.stats().clone();
    let warnings = input.warnings.iter().chain(&unestimated);
    warnings.for_each(|w| observer.warn(w));
    let lattice = spool.choose_lattice(0)?;
    if let Some(sketch) = &mut sketch {
        sketch.count(&spool, &lattice, workspace)?;
    }
    let double = spool.source_precision() == CoordinateType::F64;
    let spool_bytes = spool.bytes();
    observer.begin("order", "points", input.kept);
    let (stored, duplicates, spool) = order(spool, &lattice, PAGE, workspace)?;
    observer.end();
    let store = stored.open(workspace)?;
    let read = start.elapsed().as_secs_f64();
    let sample = sample(&store, workspace)?;
    let Aabb { min, max } = store.bounds();
    if let Some(sketch) = sketch {
        sketch.draw(&store, &lattice, &sample.tally, workspace)?;
    }
    let normals = spool.map(|spool| normals(spool, &lattice, (&stored, &store), workspace));
    let normals = normals.transpose()?.flatten();
    stored.release(workspace)?;
    let points = store.len() as u64;
    let cells = sample.seconds / sample.points.max(1) as f64 * points as f64;
    let known = Known {
        read: input.kept,
        spool: spool_bytes,
        decompressed: headers.map_or(0, |known| known.decompressed),
        points,
        values: 0,
        scanner: headers.map_or(0, |headers| headers.scanner),
        normal: headers.map_or(0, |headers| headers.normal),
        double: Some(double),
        moved: None,
        text: None,
    };
    let disk = known.estimate(&Params::default(), Files::of(Path::new("mesh.ply")));
    Ok(Info {
        normals,
        duplicates,
        points,
        min: lattice.position(min),
        max: lattice.position(max),
        lattice_step: lattice.step,
        lattice_exact: lattice.exact,
        spacing: percentiles(sample.nearest, lattice.step),
        auto_radius: percentiles(sample.radius, lattice.step),
        noisy: sample.noisy as f64 / sample.noise.len().max(1) as f64,
        noise: percentiles(sample.noise, 1.0),
        memory_minimum: MINIMUM_BUDGET,
        scratch_bytes: disk.scratch,
        output_bytes: disk.output,
        seconds: read + cells / workspace.threads as f64 * (1.0 + OTHER_STAGES),
        input,
    })
}

/// What is known about the normals of the points, if they were read and a file has any.
fn normals(
    spool: Spool,
    lattice: &Lattice,
    (stored, store): (&StoredPoints, &PointStore),
    workspace: &Workspace,
) -> Result<Option<NormalStats>> {
    let Some(names) = spool.normal_names() else {
        return spool.release(workspace).map(|()| None);
    };
    let observer = &workspace.observer;
    observer.begin("attributes", "points", spool.points());
    let blocks = Blocks::new(stored.len(), METHOD.curve.block);
    let carried = spool.with_normals(spool.carried(&Attributes::None, false));
    let values = attributes(spool, lattice, &carried, stored, blocks, workspace)?;
    let found = values.normals.as_ref().map(|of| {
        let found = look(Normals::new(of, blocks), store, names.to_vec(), workspace)?;
        of.release(workspace)?;
        Ok(found)
    });
    observer.end();
    found.transpose()
}

#[derive(Default)]
struct Sample {
    nearest: Vec<f64>,
    radius: Vec<f64>,
    /// In local spacings.
    noise: Vec<f64>,
    /// Points with more noise than a clean surface has.
    noisy: usize,
    /// Squared distances to the nearest point.
    tally: Tally,
    points: usize,
    seconds: f64,
}

fn sample(store: &PointStore, workspace: &Workspace) -> Result<Sample> {
    let _held = workspace.reserve("info: sample", 16 << 20)?;
    let mut sample = Sample::default();
    let neighbors = METHOD.plane.neighbors;
    let mut maker = CellMaker::new(neighbors, DiskRadius::Auto, Widen::OnBands, None);
    let mut gauge = Gauge::default();
    let mut search = Search::default();
    let count = SAMPLES.min(store.len().div_ceil(SAMPLE_POINTS));
    for index in 0..count {
        workspace.check_cancel()?;
        let start = (store.len() * index / count) / PAGE * PAGE;
        let ids = start..(start + SAMPLE_POINTS).min(store.len());
        let tile = Tile::load(store, ids.clone())?;
        let begin = Instant::now();
        // The time of the cells alone is what the estimate follows from.
        let mut besides = Duration::ZERO;
        let mut failed = None;
        tile.for_each_query(
            neighbors,
            &mut search,
            |_| (),
            |_, _, query| {
                let Some(mut query) = query else { return };
                let near = query.near();
                if let Some(last) = near.get(neighbors - 1) {
                    let first2 = near.get(0).map_or(0, |n| n.distance2);
                    sample.nearest.push((first2 as f64).sqrt());
                    sample.tally.add(first2);
                    let radius = METHOD.disk.reach * (last.distance2 as f64).sqrt();
                    sample.radius.push(radius);
                }
                let fit = match fit_in_tile(&mut query, neighbors, Widen::OnBands) {
                    Ok(Some(fit)) => fit,
                    Ok(None) => return,
                    Err(error) => {
                        failed = Some(error);
                        return;
                    }
                };
                let measured = Instant::now();
                if let Some((noise, noisy)) = gauge.noise(query.near(), &fit, neighbors) {
                    sample.noise.push(noise);
                    sample.noisy += usize::from(noisy);
                }
                besides += measured.elapsed();
                maker.from_fit(&mut query, &fit, |_, _| {});
            },
        );
        sample.seconds += begin.elapsed().saturating_sub(besides).as_secs_f64();
        sample.points += ids.len();
        if let Some(error) = failed {
            return Err(error);
        }
    }
    Ok(sample)
}

fn percentiles(mut lengths: Vec<f64>, step: f64) -> Percentiles {
    if lengths.is_empty() {
        return Percentiles::default();
    }
    lengths.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| lengths[((lengths.len() - 1) as f64 * share).round() as usize] * step;
    Percentiles {
        p5: at(0.05),
        p50: at(0.5),
        p95: at(0.95),
    }
}
