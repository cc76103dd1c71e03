//! The commands of the program: their work, and what they print.

use super::args::{
    Change, Close, Compare, Info, Quiet, Raster, Reconstruct, Resume, Simplify, Tiles, Verify,
    Volume,
};
use super::command::Command;
#[cfg(feature = "demo")]
use super::demo;
use super::ended::Ended;
use super::jobs;
use super::output::{print, show, show_told, spelled, summary};
#[cfg(feature = "view")]
use super::view;
use super::{manual, shared, stop};
use outcrop_disk::error::Result;
use std::io::IsTerminal;

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
        Command::Change(args) => changes(&args),
        Command::Volume(args) => volume(&args),
        Command::Raster(args) => raster(&args),
        Command::Simplify(args) => simplify(&args),
        Command::Close(args) => close(&args),
        Command::Tiles(args) => tiles(&args),
        Command::View(args) => view::run(&args),
        Command::Demo(args) => demo::run(&args),
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
    if let Some(headers) = jobs::headers(args)? {
        show(&headers, args.json)?;
        return Ok(true);
    }
    let info = jobs::info(args, stop::watched(args.limits.quiet))?;
    show_told(&info, args.json, |info| info.told(spelled))?;
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

fn changes(args: &Change) -> Result<bool> {
    let change = jobs::change(args, stop::watched(args.limits.quiet))?;
    show(&change, args.json)?;
    Ok(true)
}

fn volume(args: &Volume) -> Result<bool> {
    let volumes = jobs::volume(args, stop::watched(args.limits.quiet))?;
    show(&volumes, args.json)?;
    Ok(true)
}

fn raster(args: &Raster) -> Result<bool> {
    let raster = jobs::raster(args, stop::watched(args.limits.quiet))?;
    show(&raster, args.json)?;
    Ok(true)
}

fn simplify(args: &Simplify) -> Result<bool> {
    let report = jobs::simplify(args, stop::watched(args.limits.quiet))?;
    show(&report, args.json)?;
    Ok(true)
}

fn close(args: &Close) -> Result<bool> {
    let report = jobs::close(args, stop::watched(args.limits.quiet))?;
    show(&report, args.json)?;
    Ok(true)
}

fn tiles(args: &Tiles) -> Result<bool> {
    let report = jobs::tiles(args, stop::watched(args.limits.quiet))?;
    show_told(&report, args.json, |report| report.told(spelled))?;
    Ok(true)
}

#[cfg(not(feature = "demo"))]
mod demo {
    use super::super::args::Demo;
    use outcrop_disk::error::Result;

    pub fn run(_: &Demo) -> Result<bool> {
        Err(crate::features::DEMO.missing())
    }
}

#[cfg(not(feature = "view"))]
mod view {
    use super::super::args::View;
    use outcrop_disk::error::Result;

    pub fn run(_: &View) -> Result<bool> {
        Err(crate::features::VIEW.missing())
    }
}
