//! The work of the commands: from arguments to results, without a word on the screen.

use super::args::{
    Change, Close, Compare, Ends, Info, Limits, Raster, Reconstruct, Resume, Simplify,
    Tiles as TilesArgs, Verify, Volume,
};
use super::new_file::{NewFile, is_page};
use super::output::report_text;
use super::{areas, pages};
#[cfg(not(feature = "levels"))]
use crate::features::LEVELS;
use crate::info;
use crate::params::Params;
use crate::pipeline::{
    Builder, ChangeDetection, Rasterization, Reconstruction, compare, default_memory,
    default_threads, temporary,
};
#[cfg(feature = "levels")]
use crate::pipeline::{Closing, Simplification, Tiles};
use crate::report::{CloseReport, Report, SimplifyReport, TilesReport};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_inspect::{change, verify};
use outcrop_points::is_remote;
use outcrop_survey::raster;
use outcrop_survey::volume::{self, Volumes};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The receiver of the progress, and the flag that stops the work.
pub type Watch = (Arc<dyn Observer>, Cancel);

/// A mesh that was made, and the report of the run.
pub type Made = (Report, PathBuf);

pub fn threads(limits: &Limits) -> usize {
    limits.threads.map_or_else(default_threads, usize::from)
}

pub fn memory(limits: &Limits) -> u64 {
    limits.memory.unwrap_or_else(default_memory)
}

fn workspace(limits: &Limits, watch: Watch) -> Result<Workspace> {
    let places = (limits.scratch.as_deref(), limits.storing.storage());
    temporary(places, (memory(limits), threads(limits)), watch)
}

/// Makes a mesh; `begins` is called when all checks are done.
pub fn reconstruct(
    args: &Reconstruct,
    watch: Watch,
    begins: impl FnOnce(&Reconstruction),
) -> Result<Made> {
    let mut builder = args
        .job
        .builder()
        .threads(threads(&args.limits))
        .memory(memory(&args.limits))
        .storage(args.limits.storing.storage())
        .start(args.again.start());
    if let Some(scratch) = &args.limits.scratch {
        builder = builder.scratch(scratch);
    }
    run(builder, &args.ends, watch, begins)
}

/// Goes on with an unfinished run; `begins` is called when all checks are done.
pub fn resume(args: &Resume, watch: Watch, begins: impl FnOnce(&Reconstruction)) -> Result<Made> {
    let (observer, cancel) = &watch;
    let mut builder = Reconstruction::resume_when_free(&args.folder, &**observer, cancel)?;
    if let Some(memory) = args.memory {
        builder = builder.memory(memory);
    }
    if let Some(threads) = args.threads {
        builder = builder.threads(threads.into());
    }
    if let Some(output) = &args.output {
        builder = builder.output(output);
    }
    let builder = builder.storage(args.storing.storage());
    run(builder, &args.ends, watch, begins)
}

fn run(
    builder: Builder,
    ends: &Ends,
    (observer, cancel): Watch,
    begins: impl FnOnce(&Reconstruction),
) -> Result<Made> {
    let mut builder = builder.observer(observer).cancel(cancel);
    if let Some(limit) = ends.time_limit {
        builder = builder.time_limit(limit);
    }
    let page = ends.report.iter().any(|path| is_page(path));
    let run = builder.pictures(page).build()?;
    if let Some(path) = ends.report.iter().find(|path| **path == run.output()) {
        return Err(Error::Parameter {
            name: "report",
            found: path.display().to_string(),
            expected: "a file other than the mesh".into(),
        });
    }
    let reports = ends.report.iter().map(|path| NewFile::open(path));
    let reports = reports.collect::<Result<Vec<_>>>()?;
    begins(&run);
    let report = run.run()?;
    for file in reports {
        let text = report_text(file.path(), &report, run.output())?;
        file.write(&text)?;
    }
    Ok((report, run.output().to_path_buf()))
}

/// The headers of a cloud and what a run would read of it, if no more is wanted: of files behind URLs nothing else is
/// read, unless that is asked for.
pub fn headers(args: &Info) -> Result<Option<info::Headers>> {
    let remote = args.inputs.iter().any(|input| is_remote(input));
    if !args.headers && (!remote || args.all_points || args.html.is_some()) {
        return Ok(None);
    }
    let memory = MemoryPool::new(memory(&args.limits))?;
    let selection = args.points.params().selection();
    info::headers(&args.inputs, &selection, &memory, &Cancel::new()).map(Some)
}

/// Describes a cloud.
pub fn info(args: &Info, watch: Watch) -> Result<info::Info> {
    let workspace = workspace(&args.limits, watch)?;
    let params = Params {
        crs: args.crs.clone(),
        ..args.points.params()
    };
    let Some(path) = &args.html else {
        return info::info(&args.inputs, &params, &workspace);
    };
    let page = NewFile::page(path)?;
    pages::info(page, &args.inputs, &params, &workspace)
}

/// Refuses a mesh behind a URL.
pub fn local(mesh: &Path) -> Result<()> {
    match is_remote(mesh) {
        true => Err(Error::Parameter {
            name: "MESH",
            found: "a URL".into(),
            expected: "a path: clouds are read from servers, meshes from this machine".into(),
        }),
        false => Ok(()),
    }
}

/// Checks a mesh.
pub fn verify(args: &Verify, watch: Watch) -> Result<verify::Verdict> {
    local(&args.mesh)?;
    let workspace = workspace(&args.limits, watch)?;
    let options = verify::Options {
        allow_unreferenced: args.allow_unreferenced,
        range: None,
    };
    let Some(path) = &args.html else {
        return verify::verify_with(&args.mesh, &options, &workspace);
    };
    let page = NewFile::page(path)?;
    pages::verify(page, &args.mesh, &options, &workspace)
}

/// Measures the distance between two shapes.
pub fn compare(args: &Compare, watch: Watch) -> Result<compare::Comparison> {
    let workspace = workspace(&args.limits, watch)?;
    let (samples, seed) = (args.samples, args.seed);
    let options = compare::Options { samples, seed };
    let (a, b) = (&args.a, &args.b);
    let Some(path) = &args.html else {
        return compare::compare(a, b, &options, &workspace);
    };
    let page = NewFile::page(path)?;
    pages::compare(page, [a, b], &options, &workspace)
}

/// Measures volumes.
pub fn volume(args: &Volume, watch: Watch) -> Result<Volumes> {
    local(&args.mesh)?;
    let workspace = workspace(&args.limits, watch)?;
    volume::volume(&args.mesh, &args.options(), &workspace)
}

/// A job on meshes or clouds within the limits of the command line.
macro_rules! within {
    ($job:ident, $args:ident, $observer:ident, $cancel:ident) => {{
        let job = $job
            .memory(memory(&$args.limits))
            .threads(threads(&$args.limits))
            .storage($args.limits.storing.storage())
            .start($args.again.start())
            .observer($observer)
            .cancel($cancel);
        match &$args.limits.scratch {
            Some(scratch) => job.scratch(scratch),
            None => job,
        }
    }};
}

/// Measures what changed from one surface to another.
pub fn change(args: &Change, (observer, cancel): Watch) -> Result<change::Change> {
    local(&args.new)?;
    let options = change::Options {
        radius: args.radius,
        farthest: args.farthest,
        registration: args.registration,
    };
    let areas = args.areas.as_deref().map(areas::File::new).transpose()?;
    let page = args.html.as_deref().map(NewFile::page).transpose()?;
    let job = ChangeDetection::new(&args.old, &args.new, options);
    let job = match &args.output {
        Some(output) => job.output(output),
        None => job,
    };
    let job = within!(job, args, observer, cancel);
    let found = match page {
        None => job.run()?,
        Some(page) => pages::change(page, &job)?,
    };
    if let Some(areas) = areas {
        areas.write(&found)?;
    }
    Ok(found)
}

/// Makes a raster of heights.
pub fn raster(args: &Raster, (observer, cancel): Watch) -> Result<raster::Raster> {
    let job = Rasterization::new(&args.source, args.options());
    within!(job, args, observer, cancel).run()
}

/// Makes a mesh with fewer triangles.
#[cfg(feature = "levels")]
pub fn simplify(args: &Simplify, (observer, cancel): Watch) -> Result<SimplifyReport> {
    use outcrop_levels::single::{Goal, Options};
    local(&args.mesh)?;
    let goal = &args.goal;
    let goal = match (goal.triangles, goal.ratio, goal.error) {
        (Some(number), ..) => Goal::Triangles(number),
        (_, Some(ratio), _) => Goal::Ratio(ratio),
        // The command line takes one of the three.
        (.., error) => Goal::Error(error.unwrap_or(0.0)),
    };
    let options = Options {
        goal,
        keep_boundary: args.keep_boundary,
        most_triangles: args.most_triangles,
    };
    let job = Simplification::new(&args.mesh, &args.output, goal)
        .options(options)
        .samples(args.samples)
        .close(args.close);
    within!(job, args, observer, cancel).run()
}

/// The answer of a build without levels of detail.
#[cfg(not(feature = "levels"))]
pub fn simplify(_: &Simplify, _: Watch) -> Result<SimplifyReport> {
    Err(LEVELS.missing())
}

/// Closes a mesh.
#[cfg(feature = "levels")]
pub fn close(args: &Close, (observer, cancel): Watch) -> Result<CloseReport> {
    local(&args.mesh)?;
    let job = Closing::new(&args.mesh, &args.output).kind(args.kind);
    within!(job, args, observer, cancel).run()
}

/// The answer of a build without levels of detail.
#[cfg(not(feature = "levels"))]
pub fn close(_: &Close, _: Watch) -> Result<CloseReport> {
    Err(LEVELS.missing())
}

/// Makes levels of detail.
#[cfg(feature = "levels")]
pub fn tiles(args: &TilesArgs, (observer, cancel): Watch) -> Result<TilesReport> {
    local(&args.mesh)?;
    let options = outcrop_levels::Options {
        geo: args.geo,
        crs: args.crs.clone(),
        lossy: args.lossy,
        most_triangles: args.most_triangles,
    };
    let tiles = Tiles::new(&args.mesh, &args.output).options(options);
    within!(tiles, args, observer, cancel).run()
}

#[cfg(not(feature = "levels"))]
pub fn tiles(_: &TilesArgs, _: Watch) -> Result<TilesReport> {
    Err(LEVELS.missing())
}
