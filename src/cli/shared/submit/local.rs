//! Tasks as processes on this machine, or as steps inside an allocation of Slurm.

use super::super::Submit;
use super::{TRIES, advance, advance_command, mebibytes, program, state};
use crate::cli::DAMAGED;
use crate::cli::output::print;
use crate::pipeline::{self, Status, default_threads};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::lock;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;

/// Number of tasks of an allocation of Slurm.
const ALLOCATED: &str = "SLURM_NTASKS";

/// The number of tasks for which this process was given room.
fn allocated() -> Result<usize> {
    let found = std::env::var(ALLOCATED).unwrap_or_else(|_| "nothing".into());
    found.parse().map_err(|_| Error::Parameter {
        name: ALLOCATED,
        found,
        expected: "a number: run it inside `sbatch --ntasks=N` or `salloc --ntasks=N`".into(),
    })
}

/// Processes on this machine.
pub struct Local<'a> {
    args: &'a Submit,
    program: PathBuf,
    workers: usize,
}

impl<'a> Local<'a> {
    pub fn new(args: &'a Submit) -> Result<Self> {
        let threads = pipeline::status(&args.folder)?.task_threads as usize;
        let usual = match args.how.within_allocation {
            true => allocated()?,
            false => (default_threads() / threads).max(1),
        };
        Ok(Self {
            args,
            program: program()?,
            workers: args.how.workers.map_or(usual, usize::from),
        })
    }

    /// Command for the `tries`th time at a shard.
    fn work(&self, status: &Status, shard: u32, tries: u32) -> Command {
        let mut command = match self.args.how.within_allocation {
            false => Command::new(&self.program),
            true => {
                let mut command = Command::new("srun");
                command.args(["--nodes=1", "--ntasks=1", "--exact"]);
                command.arg(format!("--cpus-per-task={}", status.task_threads));
                command.arg(format!("--mem={}M", mebibytes(status, tries)));
                command.args(&self.args.how.site).arg(&self.program);
                command
            }
        };
        command.arg("work").arg(&self.args.folder).arg("--quiet");
        command.args(["--generation", &status.generation.to_string()]);
        command.args(["--shard", &shard.to_string()]);
        command
    }

    fn advance(&self) -> Command {
        advance_command(&self.program, self.args, &self.args.folder)
    }

    pub fn run(&self) -> Result<bool> {
        if self.args.dry_run {
            let status = state(&self.args.folder)?;
            let commands = match status.can_advance {
                true => vec![self.advance()],
                false => {
                    let missing = status.missing().into_iter();
                    missing.map(|k| self.work(&status, k, 0)).collect()
                }
            };
            let lines = commands.iter().map(|c| format!("{c:?}"));
            print(&lines.collect::<Vec<_>>().join("\n"))?;
            return Ok(true);
        }
        loop {
            let status = state(&self.args.folder)?;
            if !status.can_advance {
                self.work_all(&status)?;
            }
            if let Some(after) = advance(&mut self.advance())? {
                print(&after.to_string())?;
                if after.finished {
                    return Ok(true);
                }
            }
        }
    }

    /// Runs the tasks of `shards`, some at the same time; one that was killed is run again.
    fn work_all(&self, status: &Status) -> Result<()> {
        let left = Mutex::new(VecDeque::from(status.missing()));
        let tries: Mutex<BTreeMap<u32, u32>> = Mutex::default();
        let failed: Mutex<Option<Error>> = Mutex::default();
        let worker = || {
            loop {
                let shard = lock(&left).pop_front();
                let (Some(shard), true) = (shard, lock(&failed).is_none()) else {
                    return;
                };
                // An error that a task reports itself remains one; a signal may not come again.
                let before = lock(&tries).get(&shard).copied().unwrap_or_default();
                let (problem, lost) = match self.work(status, shard, before).status() {
                    Ok(status) if status.success() => continue,
                    // The next advance makes it good.
                    Ok(status) if status.code() == Some(DAMAGED.into()) => continue,
                    Ok(status) => {
                        let problem = std::io::Error::other(format!("shard {shard}: {status}"));
                        (problem, status.code() != Some(2))
                    }
                    Err(e) => (e, false),
                };
                let mut tries = lock(&tries);
                let count = tries.entry(shard).or_default();
                *count += 1;
                if lost && *count < TRIES {
                    lock(&left).push_back(shard);
                } else {
                    let error = Error::io(&self.args.folder, "do the work of a task in", problem);
                    lock(&failed).get_or_insert(error);
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.workers {
                scope.spawn(worker);
            }
        });
        failed.into_inner().unwrap_or_default().map_or(Ok(()), Err)
    }
}
