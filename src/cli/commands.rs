//! The commands of the program: their work, and what they print.

use super::args::{Compare, Demo, Info, Quiet, Reconstruct, Resume, Tiles, Verify};
use super::command::Command;
use super::ended::Ended;
use super::jobs::{self, memory, threads};
use super::output::{print, show, summary, write_report};
use super::{manual, shared, stop, style, view};
use crate::pipeline::{Reconstruction, Start};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_inspect::verify;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;

/// Runs a command.
pub fn run(command: Command) -> Result<Ended> {
    let yes = match command {
        Command::Work(args) => return shared::work(&args),
        Command::Advance(args) => return shared::advance(&args),
        Command::Reconstruct(args) => reconstruct(&args),
        Command::Resume(args) => resume(&args),
        Command::Info(args) => info(&args),
        Command::Verify(args) => check(&args),
        Command::Compare(args) => measure(&args),
        Command::Tiles(args) => tiles(&args),
        Command::View(args) => view::run(&args),
        Command::Demo(args) => demo(&args),
        Command::Plan(args) => shared::plan(&args),
        Command::Status(args) => shared::status(&args),
        Command::Submit(args) => shared::submit(&args),
        Command::Completions { shell } => manual::completions(shell),
        Command::Man { folder } => manual::man(&folder),
    }?;
    Ok(match yes {
        true => Ended::Yes,
        false => Ended::No,
    })
}

fn reconstruct(args: &Reconstruct) -> Result<bool> {
    let quiet = args.limits.quiet;
    tell(
        jobs::reconstruct(args, stop::watched(quiet), stop::can_end)?,
        quiet,
    )
}

fn resume(args: &Resume) -> Result<bool> {
    let quiet = args.quiet;
    tell(
        jobs::resume(args, stop::watched(quiet), stop::can_end)?,
        quiet,
    )
}

/// Prints the summary of a run on a terminal.
fn tell((report, output): jobs::Made, quiet: Quiet) -> Result<bool> {
    if quiet.tells() && std::io::stdout().is_terminal() {
        print(&summary(&report, &output))?;
    }
    Ok(true)
}

fn info(args: &Info) -> Result<bool> {
    let info = jobs::info(args, stop::watched(args.limits.quiet))?;
    show(&info, args.json)?;
    Ok(true)
}

fn check(args: &Verify) -> Result<bool> {
    let verdict = jobs::verify(args, stop::watched(args.limits.quiet))?;
    show(&verdict, args.json)?;
    Ok(verdict.manifold)
}

fn measure(args: &Compare) -> Result<bool> {
    let comparison = jobs::compare(args, stop::watched(args.limits.quiet))?;
    show(&comparison, args.json)?;
    Ok(true)
}

fn tiles(args: &Tiles) -> Result<bool> {
    let report = jobs::tiles(args, stop::watched(args.limits.quiet))?;
    show(&report, args.json)?;
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
