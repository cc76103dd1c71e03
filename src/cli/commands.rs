//! The commands.

use super::args::{Command, Compare, Demo, Ends, Info, Limits, Reconstruct, Resume, Verify};
use super::progress::{Bars, Warnings};
use super::{stop, style};
use crate::error::{Error, Result};
use crate::inspect::{compare, info, verify};
use crate::pipeline::{Builder, Reconstruction, Start, default_memory, default_threads};
use crate::report::Report;
use crate::workspace::Workspace;
use crate::workspace::memory::MemoryPool;
use crate::workspace::progress::{Cancel, Observer, Silent};
use serde::Serialize;
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;

/// Runs a command; `false` for a negative answer.
pub fn run(command: Command) -> Result<bool> {
    match command {
        Command::Reconstruct(args) => reconstruct(&args),
        Command::Resume(args) => resume(&args),
        Command::Info(args) => info(&args),
        Command::Verify(args) => check(&args),
        Command::Compare(args) => measure(&args),
        Command::Demo(args) => demo(&args),
    }
}

/// The receiver of the progress, and the flag that signals raise.
fn watched(quiet: bool) -> (Arc<dyn Observer>, Cancel) {
    if quiet {
        (Arc::new(Silent), stop::watch(None))
    } else if std::io::stderr().is_terminal() {
        let bars = Arc::new(Bars::default());
        (bars.clone(), stop::watch(Some(bars)))
    } else {
        (Arc::new(Warnings), stop::watch(None))
    }
}

fn threads(limits: &Limits) -> usize {
    limits.threads.map_or_else(default_threads, usize::from)
}

fn memory(limits: &Limits) -> u64 {
    limits.memory.unwrap_or_else(default_memory)
}

fn workspace(limits: &Limits, beside: &Path) -> Result<Workspace> {
    let memory = MemoryPool::new(memory(limits))?;
    let scratch = limits.scratch.as_deref().unwrap_or(beside);
    let (observer, cancel) = watched(limits.quiet);
    let workspace = Workspace::new(scratch, memory, threads(limits), observer, cancel)?;
    workspace.set_storage(limits.storing.storage())?;
    Ok(workspace)
}

fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").map_err(|e| Error::io("standard output", "write", e))
}

fn json<T: Serialize>(value: &T) -> Result<String> {
    serde_json::to_string_pretty(value)
        .map_err(|e| Error::io("standard output", "write JSON", e.into()))
}

/// Prints a value as JSON or as text.
fn show<T: Serialize + Display>(value: &T, as_json: bool) -> Result<()> {
    print(&if as_json {
        json(value)?
    } else {
        value.to_string()
    })
}

fn write_report(path: &Path, report: &Report) -> Result<()> {
    std::fs::write(path, json(report)? + "\n").map_err(|e| Error::io(path, "write the report", e))
}

fn reconstruct(args: &Reconstruct) -> Result<bool> {
    let mut builder = Reconstruction::builder()
        .output(&args.output)
        .params(args.params())
        .threads(threads(&args.limits))
        .memory(memory(&args.limits))
        .storage(args.limits.storing.storage())
        .tile_points(args.tile_points.unwrap_or(args.block_points))
        .start(args.again.start());
    for input in &args.inputs {
        builder = builder.input(input);
    }
    if let Some(scratch) = &args.limits.scratch {
        builder = builder.scratch(scratch);
    }
    run_reconstruction(builder, &args.ends, args.limits.quiet)
}

fn resume(args: &Resume) -> Result<bool> {
    let mut builder = Reconstruction::resume(&args.folder)?;
    if let Some(memory) = args.memory {
        builder = builder.memory(memory);
    }
    if let Some(threads) = args.threads {
        builder = builder.threads(threads.into());
    }
    let builder = builder.storage(args.storing.storage());
    run_reconstruction(builder, &args.ends, args.quiet)
}

fn run_reconstruction(builder: Builder, ends: &Ends, quiet: bool) -> Result<bool> {
    let (observer, cancel) = watched(quiet);
    let mut builder = builder.observer(observer).cancel(cancel);
    if let Some(limit) = ends.time_limit {
        builder = builder.time_limit(limit);
    }
    let run = builder.build()?;
    if ends.report.as_deref() == Some(run.output()) {
        return Err(Error::Parameter {
            name: "--report",
            found: run.output().display().to_string(),
            expected: "a file other than the mesh".into(),
        });
    }
    let new_report = ends.report.as_ref().is_some_and(|path| !path.exists());
    if let Some(path) = &ends.report {
        // An unwritable report is an error before the work, not after it.
        let opened = std::fs::File::options()
            .append(true)
            .create(true)
            .open(path);
        opened.map_err(|e| Error::io(path, "write the report", e))?;
    }
    stop::can_end(&run);
    let outcome = run.run();
    match (&outcome, &ends.report) {
        (Ok(report), Some(path)) => write_report(path, report)?,
        // No empty report of a failed run.
        (Err(_), Some(path)) if new_report => drop(std::fs::remove_file(path)),
        _ => {}
    }
    let report = outcome?;
    if !quiet && std::io::stdout().is_terminal() {
        print(&summary(&report, run.output()))?;
    }
    Ok(true)
}

fn summary(report: &Report, output: &Path) -> String {
    let mesh = &report.mesh;
    format!(
        "{}: {} triangles, {} vertices from {} points; {}, {} boundary edges\n\
         {} in all, at most {} of memory and {} of scratch",
        output.display(),
        style::grouped(mesh.triangles),
        style::grouped(mesh.vertices),
        style::grouped(report.points),
        style::counted(
            report.repair.components_found - report.repair.components_removed,
            "component"
        ),
        style::grouped(mesh.boundary_edges),
        style::seconds(report.seconds),
        style::bytes(report.peak_resident_bytes),
        style::bytes(report.peak_scratch_bytes),
    ) + &left_out(report)
}

/// A line about the points left out by options, if there are any.
fn left_out(report: &Report) -> String {
    let reasons: Vec<String> = [
        (report.input.dropped_by_class, "of other classes"),
        (report.thin.dropped, "by thinning"),
        (report.outliers.dropped, "outliers"),
    ]
    .iter()
    .filter(|(count, _)| *count > 0)
    .map(|(count, why)| format!("{} {why}", style::grouped(*count)))
    .collect();
    if reasons.is_empty() {
        return String::new();
    }
    format!("\npoints left out: {}", reasons.join(", "))
}

fn info(args: &Info) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let info = info::info(&args.inputs, &args.points.classes(), &workspace)?;
    show(&info, args.json)?;
    Ok(true)
}

fn check(args: &Verify) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let options = verify::Options {
        allow_unreferenced: args.allow_unreferenced,
        range: None,
    };
    let verdict = verify::verify_with(&args.mesh, &options, &workspace)?;
    show(&verdict, args.json)?;
    Ok(verdict.manifold)
}

fn measure(args: &Compare) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let (samples, seed) = (args.samples, args.seed);
    let options = compare::Options { samples, seed };
    let comparison = compare::compare(&args.a, &args.b, &options, &workspace)?;
    show(&comparison, args.json)?;
    Ok(true)
}

fn demo(args: &Demo) -> Result<bool> {
    use outcrop_cloudgen::{Cloud, Format, Kind};
    let folder = &args.folder;
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make the folder", e))?;
    let cloud = folder.join("bumpy.laz");
    let format = Format::from_path(&cloud).map_err(|e| generator_error(&cloud, &e))?;
    print(&format!(
        "making {} points on a closed surface",
        style::grouped(args.points)
    ))?;
    Cloud::new(Kind::Bumpy)
        .points(args.points)
        .write(&cloud, format)
        .map_err(|e| generator_error(&cloud, &e))?;
    let mesh = folder.join("bumpy.ply");
    let (observer, cancel) = watched(args.limits.quiet);
    let report = Reconstruction::builder()
        .input(&cloud)
        .output(&mesh)
        .threads(threads(&args.limits))
        .memory(memory(&args.limits))
        .observer(observer)
        .start(Start::Restart)
        .cancel(cancel)
        .build()?
        .run()?;
    let path = folder.join("report.json");
    write_report(&path, &report)?;
    print(&summary(&report, &mesh))?;
    let memory = MemoryPool::new(memory(&args.limits))?;
    let threads = threads(&args.limits);
    let workspace = Workspace::new(folder, memory, threads, Arc::new(Silent), Cancel::new())?;
    let verdict = verify::verify(&mesh, &workspace)?;
    print(&verdict.to_string())?;
    print(&format!(
        "the cloud is {}, the mesh {} (open it in MeshLab, CloudCompare or Blender), the report {}",
        cloud.display(),
        mesh.display(),
        path.display()
    ))?;
    Ok(verdict.manifold)
}

fn generator_error(path: &Path, error: &outcrop_cloudgen::Error) -> Error {
    let error = std::io::Error::other(error.to_string());
    Error::io(path, "make the demo cloud", error)
}
