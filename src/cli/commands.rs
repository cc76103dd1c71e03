//! The commands.

use super::args::{
    Compare, Demo, Ends, Info, Limits, Reconstruct, Resume, Tiles as TilesArgs, Verify,
};
use super::command::Command;
use super::output::{NewFile, is_page, print, report_text, show, summary, write_report};
use super::{manual, shared, stop, style, view};
use crate::error::{Error, Result};
use crate::inspect::{compare, info, verify};
use crate::levels;
use crate::page;
use crate::pipeline::{Builder, Reconstruction, Start, Tiles, default_memory, default_threads};
use crate::workspace::Workspace;
use crate::workspace::memory::MemoryPool;
use crate::workspace::progress::{Cancel, Silent};
use std::io::IsTerminal;
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
        Command::Tiles(args) => tiles(&args),
        Command::View(args) => view::run(&args),
        Command::Demo(args) => demo(&args),
        Command::Plan(args) => shared::plan(&args),
        Command::Work(args) => shared::work(&args),
        Command::Advance(args) => shared::advance(&args),
        Command::Status(args) => shared::status(&args),
        Command::Submit(args) => shared::submit(&args),
        Command::Completions { shell } => manual::completions(shell),
        Command::Man { folder } => manual::man(&folder),
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
    let (observer, cancel) = stop::watched(limits.quiet);
    let workspace = Workspace::new(scratch, memory, threads(limits), observer, cancel)?;
    workspace.set_storage(limits.storing.storage())?;
    Ok(workspace)
}

fn reconstruct(args: &Reconstruct) -> Result<bool> {
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
    let (observer, cancel) = stop::watched(quiet);
    let mut builder = builder.observer(observer).cancel(cancel);
    if let Some(limit) = ends.time_limit {
        builder = builder.time_limit(limit);
    }
    let page = ends.report.iter().any(|path| is_page(path));
    let run = builder.pictures(page).build()?;
    if let Some(path) = ends.report.iter().find(|path| **path == run.output()) {
        return Err(Error::Parameter {
            name: "--report",
            found: path.display().to_string(),
            expected: "a file other than the mesh".into(),
        });
    }
    let reports = ends.report.iter().map(|path| NewFile::open(path));
    let reports = reports.collect::<Result<Vec<_>>>()?;
    stop::can_end(&run);
    let report = run.run()?;
    for file in reports {
        let text = report_text(file.path(), &report, run.output())?;
        file.write(&text)?;
    }
    if !quiet && std::io::stdout().is_terminal() {
        print(&summary(&report, run.output()))?;
    }
    Ok(true)
}

fn info(args: &Info) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let params = args.points.params();
    let info = match &args.html {
        None => info::info(&args.inputs, &params, &workspace)?,
        Some(path) => {
            let page = NewFile::page(path)?;
            let (info, drawn) = info::illustrated(&args.inputs, &params, &workspace)?;
            page.write(&page::cloud(&args.inputs, &info, &drawn))?;
            info
        }
    };
    show(&info, args.json)?;
    Ok(true)
}

fn check(args: &Verify) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let options = verify::Options {
        allow_unreferenced: args.allow_unreferenced,
        range: None,
    };
    let verdict = match &args.html {
        None => verify::verify_with(&args.mesh, &options, &workspace)?,
        Some(path) => {
            let page = NewFile::page(path)?;
            let (verdict, drawn) = verify::illustrated(&args.mesh, &options, &workspace)?;
            page.write(&page::verdict(&args.mesh, &verdict, &drawn))?;
            verdict
        }
    };
    show(&verdict, args.json)?;
    Ok(verdict.manifold)
}

fn measure(args: &Compare) -> Result<bool> {
    let workspace = workspace(&args.limits, &std::env::temp_dir())?;
    let (samples, seed) = (args.samples, args.seed);
    let options = compare::Options { samples, seed };
    let (a, b) = (&args.a, &args.b);
    let comparison = match &args.html {
        None => compare::compare(a, b, &options, &workspace)?,
        Some(path) => {
            let page = NewFile::page(path)?;
            let (comparison, drawn) = compare::illustrated(a, b, &options, &workspace)?;
            page.write(&page::comparison(&comparison, &drawn))?;
            comparison
        }
    };
    show(&comparison, args.json)?;
    Ok(true)
}

fn tiles(args: &TilesArgs) -> Result<bool> {
    let (observer, cancel) = stop::watched(args.limits.quiet);
    let options = levels::Options {
        geo: args.geo,
        most_triangles: args.most_triangles,
    };
    let mut tiles = Tiles::new(&args.mesh, &args.output)
        .options(options)
        .memory(memory(&args.limits))
        .threads(threads(&args.limits))
        .storage(args.limits.storing.storage())
        .start(args.again.start())
        .observer(observer)
        .cancel(cancel);
    if let Some(scratch) = &args.limits.scratch {
        tiles = tiles.scratch(scratch);
    }
    show(&tiles.run()?, args.json)?;
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
    let (observer, cancel) = stop::watched(args.limits.quiet);
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
    write_report(&path, &report, &mesh)?;
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
