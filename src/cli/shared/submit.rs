//! `outcrop submit`: runs the tasks of a planned run, as processes on this machine or as jobs of Slurm.

mod local;
mod slurm;

use super::super::{DAMAGED, stop};
use super::{After, Engine, Submit};
use crate::pipeline::{self, Status};
use outcrop_disk::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Attempts at a shard after which it is given up: whatever failed so often fails again.
const TRIES: u32 = 8;

/// Part of a job's memory that a task may plan with; the rest is for what the program does not count.
const SHARE: f64 = 0.95;

/// Part by which more memory is asked for with each attempt that did not end: it may have been too little.
const MORE: f64 = 0.25;

/// Runs tasks.
pub fn submit(args: &Submit) -> Result<bool> {
    let args = &Submit {
        folder: pipeline::shared_folder(&args.folder)?,
        how: args.how.clone(),
        ..*args
    };
    let is_url = args
        .folder
        .to_str()
        .is_some_and(|path| path.contains("://"));
    if args.engine == Engine::Slurm && is_url {
        return Err(Error::Parameter {
            name: "scratch",
            found: args.folder.display().to_string(),
            expected: "a folder that all machines see: jobs of Slurm have their scripts in it"
                .into(),
        });
    }
    match args.engine {
        Engine::Slurm if !args.how.within_allocation => slurm::Slurm::new(args)?.run(),
        Engine::Local | Engine::Slurm => local::Local::new(args)?.run(),
    }
}

/// This program.
fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|e| Error::io("outcrop", "find", e))
}

/// The state of the run; an error if a shard failed too often.
fn state(folder: &Path) -> Result<Status> {
    let status = pipeline::status(folder)?;
    match status.begun.iter().find(|begun| begun.attempts >= TRIES) {
        Some(begun) => {
            let (shard, folder) = (begun.shard.unwrap_or_default(), folder.to_path_buf());
            let why = match &begun.why {
                Some(why) => format!("the last time: {why}"),
                None => format!(
                    "see what `outcrop work {} --shard {shard}` says",
                    stop::quoted(&folder)
                ),
            };
            let why = format!(
                "shard {shard} of generation {} failed {} times; {why}",
                status.generation, begun.attempts
            );
            Err(Error::not_resumable(folder, why))
        }
        None => Ok(status),
    }
}

/// Runs the command that advances the run, whose answer is JSON; none if it has to be tried again.
fn advance(command: &mut Command) -> Result<Option<After>> {
    let shown = format!("{command:?}");
    let failed = |e| Error::io(&shown, "run", e);
    let output = command.stderr(Stdio::inherit()).output().map_err(failed)?;
    match output.status.code() {
        Some(0) => serde_json::from_slice(&output.stdout)
            .map(Some)
            .map_err(|e| failed(e.into())),
        // Shards turned out to be missing, or damaged.
        Some(code) if [stop::TIME_IS_UP, DAMAGED].map(i32::from).contains(&code) => Ok(None),
        _ => Err(failed(std::io::Error::other(output.status.to_string()))),
    }
}

/// The command that advances the run, with an answer in JSON.
fn advance_command(program: &Path, args: &Submit, folder: &Path) -> Command {
    let mut command = Command::new(program);
    command
        .arg("advance")
        .arg(folder)
        .args(["--json", "--quiet"]);
    if let Some(report) = &args.how.report {
        command.arg("--report").arg(report);
    }
    command
}

/// Memory of a job in MiB, after a number of attempts that did not end.
fn mebibytes(status: &Status, tries: u32) -> f64 {
    let planned = status.task_memory as f64 / SHARE / f64::from(1 << 20);
    (planned * (1.0 + MORE * f64::from(tries))).ceil()
}
