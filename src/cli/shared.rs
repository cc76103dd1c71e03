//! The commands for runs that tasks share: plan, work, advance, status, submit.

pub mod jobs;
mod shard;
mod status;
mod submit;

pub use status::status;
pub use submit::submit;

use super::args::{Again, Job, Quiet, Storing};
use super::ended::Ended;
use super::output::{json, print, summary};
use super::parse::size;
use super::{stop, style};
use crate::pipeline::{Totals, Worked};
use clap::{Args as ClapArgs, ValueEnum};
use jobs::Step;
use outcrop_disk::error::Result;
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};
use std::path::PathBuf;

/// `outcrop plan`
#[derive(Debug, ClapArgs)]
#[command(after_help = PLAN)]
pub struct Plan {
    #[command(flatten)]
    pub job: Job,
    /// Folder in which the folder of the run is made, which all tasks must see under the same path, or a URL such as
    /// s3://bucket/runs [default: beside the output]
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,
    /// Number of parts into which each step is divided, at most 1000; several for each task that can run at
    /// the same time
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub shards: u32,
    /// Memory of each task, e.g. 2GiB; of a batch job give 5 % less than it has
    #[arg(long, value_name = "SIZE", value_parser = size, default_value = "2GiB")]
    pub task_memory: u64,
    /// Threads of each task
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub task_threads: u16,
    /// Submit the tasks at once, as `outcrop submit` does; SITE FLAGS are for it
    #[arg(long, value_name = "ENGINE", value_enum)]
    pub submit: Option<Engine>,
    #[command(flatten)]
    pub again: Again,
    #[command(flatten)]
    pub how: How,
}

const PLAN: &str = "The run alternates between two commands:

  outcrop advance FOLDER            one process; opens the next step for tasks
  outcrop work FOLDER --shard K     one for each shard 0, 1 ...; in any order, on any machine

`outcrop submit FOLDER` runs them all. A task that is lost, killed or done twice does no harm.";

/// `outcrop work`
#[derive(Debug, ClapArgs)]
#[command(after_help = WORK)]
pub struct Work {
    /// The folder of the run, its mesh, or the folder that was given as --scratch
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// The generation to work for; nothing is done if it is over [default: the newest]
    #[arg(long, value_name = "N")]
    pub generation: Option<u64>,
    /// The shard, from 0, also as 17/200 [default: the index of the array job]
    #[arg(long, value_name = "K[/N]")]
    pub shard: Option<shard::Wanted>,
    /// A file with the number of a shard in each line; the index selects the line
    #[arg(long, value_name = "FILE")]
    pub shards_file: Option<PathBuf>,
    /// Numbers of shards, such as 3,7,12-15; the index selects one
    #[arg(long, value_name = "LIST", conflicts_with = "shards_file")]
    pub shards: Option<String>,
    #[command(flatten)]
    pub process: Process,
}

const WORK: &str = "The index is taken from SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX (Kubernetes),
AWS_BATCH_JOB_ARRAY_INDEX or BATCH_TASK_INDEX (Google).

Exit codes: 0 done, also if there is nothing to do any more; 2 it cannot be done; 75 try again later.";

/// Resources of a process.
#[derive(Debug, ClapArgs)]
pub struct Process {
    /// Memory budget [default: as planned]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub memory: Option<u64>,
    /// Worker threads, at most as many as planned [default: as planned]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Of a run in a store: folder for copies of scratch files [default: that of temporary files]
    #[arg(long, value_name = "DIR")]
    pub copies: Option<PathBuf>,
    /// Most bytes of these copies [default: 4GiB]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub copies_limit: Option<u64>,
    #[command(flatten)]
    pub storing: Storing,
    #[command(flatten)]
    pub quiet: Quiet,
}

/// `outcrop advance`
#[derive(Debug, ClapArgs)]
#[command(after_help = ADVANCE)]
pub struct Advance {
    /// The folder of the run, its mesh, or the folder that was given as --scratch
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    #[command(flatten)]
    pub process: Process,
    /// Write a report when the mesh is finished: as a page if its name ends in .html, else as JSON
    #[arg(long, value_name = "FILE.html|FILE.json")]
    pub report: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

const ADVANCE: &str =
    "Exit codes: 0 the next step is open, or the mesh is finished; 2 it cannot be done;
75 shards are missing.";

/// `outcrop status`
#[derive(Debug, ClapArgs)]
pub struct Status {
    /// The folder of the run, its mesh, or the folder that was given as --scratch
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print only the numbers of the shards that are not finished, one in each line
    #[arg(long, conflicts_with = "json")]
    pub missing: bool,
}

/// `outcrop submit`
#[derive(Debug, ClapArgs)]
#[command(after_help = SUBMIT)]
pub struct Submit {
    /// The folder of the run, its mesh, or the folder that was given as --scratch
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Who runs the tasks
    #[arg(long, value_enum, default_value_t = Engine::Local)]
    pub engine: Engine,
    /// Only show what would be run
    #[arg(long)]
    pub dry_run: bool,
    /// In a job: advance the run before the next jobs are submitted
    #[arg(long, hide = true)]
    pub inside: bool,
    #[command(flatten)]
    pub how: How,
}

/// How tasks are run.
#[derive(Debug, Clone, ClapArgs)]
pub struct How {
    /// Tasks at the same time, as processes [default: as many as there are processors, or tasks in the
    /// allocation]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub workers: Option<u16>,
    /// With Slurm: wait here for each step, where jobs may not submit jobs
    #[arg(long)]
    pub foreground: bool,
    /// With Slurm, inside sbatch or salloc: run tasks by srun, so that no step waits in a queue
    #[arg(long, conflicts_with = "foreground")]
    pub within_allocation: bool,
    /// Write a report when the mesh is finished: as a page if its name ends in .html, else as JSON
    #[arg(long, value_name = "FILE.html|FILE.json")]
    pub report: Option<PathBuf>,
    /// Options for sbatch or srun, like --partition=long
    #[arg(last = true, value_name = "SITE FLAGS")]
    pub site: Vec<String>,
}

const SUBMIT: &str =
    "It may be interrupted, and run again at any time; it goes on where the run is.";

/// Who runs tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// Processes on this machine
    Local,
    /// Array jobs of Slurm
    Slurm,
}

/// The state after the work between two generations.
#[derive(Debug, Serialize, Deserialize)]
pub struct After {
    /// True if the mesh is finished.
    pub finished: bool,
    /// The newest generation, unless the mesh is finished.
    pub generation: Option<u64>,
    /// Its shards that are not finished.
    pub missing: Vec<u32>,
    /// The resources that finished processes took; none if another process finished the mesh.
    pub totals: Option<Totals>,
    /// Warnings of the finished run, one line each.
    pub warnings: Vec<String>,
}

impl Display for After {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self.generation {
            Some(generation) => write!(
                f,
                "generation {generation} is open: {} to do",
                style::counted(self.missing.len() as u64, "shard")
            )?,
            None => write!(f, "the mesh is finished")?,
        }
        if let Some(totals) = &self.totals {
            write!(f, "; so far {totals}")?;
        }
        let mut warnings = self.warnings.iter();
        warnings.try_for_each(|warning| write!(f, "\nwarning: {warning}"))
    }
}

impl Display for Totals {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of processor time in tasks, {} between them; at most {} resident",
            style::seconds(self.task_cpu_seconds),
            style::seconds(self.serial_cpu_seconds),
            style::bytes(self.task_resident_bytes.max(self.serial_resident_bytes)),
        )
    }
}

/// Plans a run.
pub fn plan(args: &Plan) -> Result<bool> {
    let folder = jobs::plan(args)?;
    if let Some(engine) = args.submit {
        print(&format!("planned in {}", folder.display()))?;
        return submit(&Submit {
            folder,
            engine,
            dry_run: false,
            inside: false,
            how: args.how.clone(),
        });
    }
    print(&format!(
        "planned in {}; go on with: outcrop submit {}",
        folder.display(),
        stop::quoted(&folder)
    ))?;
    Ok(true)
}

/// Does the units of a shard.
pub fn work(args: &Work) -> Result<Ended> {
    let watch = stop::watched(args.process.quiet);
    Ok(match jobs::work(args, watch, stop::can_end)? {
        Worked::Done | Worked::Superseded => Ended::Yes,
        Worked::TooEarly => Ended::TooEarly(format!(
            "{}: generation {} has not begun",
            args.folder.display(),
            args.generation.unwrap_or_default()
        )),
        Worked::Damaged(error) => Ended::Damaged(error),
    })
}

/// Does the work between two generations.
pub fn advance(args: &Advance) -> Result<Ended> {
    let watch = stop::watched(args.process.quiet);
    let (mut after, output, report) = match jobs::advance(args, watch, stop::can_end)? {
        Step::Done(done) => (done.after, done.output, done.report),
        Step::Missing(what) => return Ok(Ended::TooEarly(what)),
        Step::Damaged(error) => return Ok(Ended::Damaged(error)),
    };
    match (&report, args.json) {
        (Some(report), true) => after.warnings.clone_from(&report.warnings),
        (Some(report), false) => print(&summary(report, &output))?,
        (None, _) => {}
    }
    match args.json {
        true => print(&json(&after)?)?,
        false => print(&after.to_string())?,
    }
    Ok(Ended::Yes)
}
