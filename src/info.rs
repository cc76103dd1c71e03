//! Description of a cloud, and estimates for a run on it.

#[cfg(feature = "pages")]
mod drawing;

use crate::params::Params;
use crate::pipeline::Known;
#[cfg(feature = "pages")]
pub use drawing::{Illustration, illustrated};
use outcrop_disk::error::{Result, Setting};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use outcrop_draw::histogram::Tally;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::Lattice;
use outcrop_geom::method::METHOD;
use outcrop_points::{
    Attributes, CoordinateType, FileStats, IngestStats, Selection, Spool, depths_shown,
    ingest_selected,
};
use outcrop_stages::attributes::attributes;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{CellMaker, DiskRadius, Widen, fit_in_tile};
use outcrop_stages::normals::{NormalStats, Normals, look};
use outcrop_stages::order::{PAGE, PointStore, StoredPoints, order};
use outcrop_stages::smooth::Gauge;
use outcrop_stages::tiles::Tile;
use outcrop_stages::tiles::near::Search;
use serde::Serialize;
use std::fmt;
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
    let headers = Known::from_headers(inputs, &every);
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
    input.warnings.iter().for_each(|w| observer.warn(w));
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
    let disk = known.estimate(&Params::default(), Path::new("mesh.ply"));
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

/// Most positions of scanners in the text; the report has all.
const MOST_SCANNERS: usize = 8;

/// The number of scanners and their positions; none without any.
fn shown(scanners: &[[f64; 3]]) -> Option<String> {
    let position = |[x, y, z]: &[f64; 3]| format!("{x} {y} {z}");
    let some = scanners.iter().take(MOST_SCANNERS).map(position);
    let some: Vec<String> = some.collect();
    let more = if scanners.len() > some.len() {
        "; …"
    } else {
        ""
    };
    let count = match scanners.len() {
        0 => return None,
        1 => "1 scanner position".to_owned(),
        many => format!("{many} scanner positions"),
    };
    Some(format!("{count}: {}{more}", some.join("; ")))
}

impl Info {
    /// The columns of all files, for `--attributes`.
    pub(crate) fn columns(&self) -> String {
        let mut names: Vec<&str> = Vec::new();
        for name in self.input.files.iter().flat_map(|file| &file.columns) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        match names.is_empty() {
            true => "none".to_owned(),
            false => names.join(", "),
        }
    }
}

impl Info {
    /// The scale of the colours, if files have any.
    fn colors(&self) -> String {
        let depths = self.input.files.iter().filter_map(|file| file.colors);
        let line = depths_shown(&depths.collect::<Vec<_>>()).unwrap_or_default();
        line.trim_start_matches("colours ").to_owned()
    }

    /// How many files in folders were left out; nothing without any.
    fn not_read(&self) -> String {
        match self.input.left_out.len() {
            0 => String::new(),
            1 => "1 file in a folder, which is no scan".into(),
            count => format!("{count} files in folders, which are no scans"),
        }
    }

    /// The noise of the sample, and how many of its points are noisy.
    fn noise_line(&self) -> String {
        let Percentiles { p5, p50, p95 } = self.noise;
        let share = 100.0 * self.noisy;
        format!(
            "{p50:.3} local spacings (5-95 %: {p5:.3} to {p95:.3}); {share:.0} % of the points are noisy"
        )
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told(Setting::to_string))
    }
}

impl Info {
    /// As text, for a front that spells options so.
    #[must_use]
    pub fn told(&self, spell: impl Fn(&Setting) -> String) -> String {
        let rows = self.rows(&spell);
        let rows = rows.iter().filter(|row| !row.1.is_empty());
        let rows = rows.map(|(name, text)| format!("{name:<13}{text}\n"));
        let files = self.input.files.iter().map(|file| self.file(file, &spell));
        let time = format!("time         about {:.0} s", self.seconds.ceil());
        files.chain(rows).chain([time]).collect()
    }

    /// The lines of a file.
    fn file(&self, file: &FileStats, spell: impl Fn(&Setting) -> String) -> String {
        let path = file.path.display();
        let mut lines = format!("{path}: {}, {} points", file.format, file.points);
        // If it is not that of all.
        if let (None, Some(crs)) = (&self.input.crs, &file.crs) {
            lines += &format!(", {}", crs.described(spell));
        }
        let more = file.taken.clone().into_iter().chain(shown(&file.scanners));
        lines.extend(more.map(|line| format!("\n  {line}")));
        lines + "\n"
    }

    /// The lines about the cloud: the name and the text of each. A line without text is not printed.
    fn rows(&self, spell: impl Fn(&Setting) -> String) -> [(&'static str, String); 16] {
        let three = |p: &[f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
        let spread =
            |p: &Percentiles| format!("{:.4} (5-95 %: {:.4} to {:.4})", p.p50, p.p5, p.p95);
        let mib = |bytes: u64| format!("{} MiB", bytes.div_ceil(1 << 20));
        let input = &self.input;
        let left_out = format!(
            "{} duplicates, {} not finite, {} withheld, {} invalid, {} of other classes, {} far away, {} outside \
             the region",
            self.duplicates,
            input.dropped_non_finite,
            input.withheld,
            input.invalid,
            input.dropped_by_class,
            input.dropped_far,
            input.dropped_by_crop
        );
        let system = match &input.crs {
            Some(crs) => crs.described(spell),
            None if input.files.iter().any(|file| file.crs.is_some()) => "different ones".into(),
            None => "not given".into(),
        };
        let rounding = if self.lattice_exact {
            "exact"
        } else {
            "rounded"
        };
        let normals = self.normals.as_ref();
        [
            (
                "points",
                format!("{} distinct of {} read", self.points, input.read),
            ),
            ("left out", left_out),
            ("columns", self.columns()),
            ("colours", self.colors()),
            (
                "normals",
                normals.map(NormalStats::to_string).unwrap_or_default(),
            ),
            ("system", system),
            ("not read", self.not_read()),
            ("lowest", three(&self.min)),
            ("highest", three(&self.max)),
            (
                "lattice",
                format!("step {} ({rounding})", self.lattice_step),
            ),
            ("spacing", spread(&self.spacing)),
            ("auto radius", spread(&self.auto_radius)),
            ("noise", self.noise_line()),
            (
                "memory",
                format!("any budget from {}", mib(self.memory_minimum)),
            ),
            ("scratch", format!("about {}", mib(self.scratch_bytes))),
            ("mesh", format!("about {}", mib(self.output_bytes))),
        ]
    }
}
