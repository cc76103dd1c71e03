//! `outcrop submit`: runs the tasks of a planned run, as processes on this machine or as jobs of Slurm.

use super::super::output::print;
use super::super::{stop, style};
use super::{After, Engine, Submit};
use crate::error::{Error, Result};
use crate::pipeline::{self, Status, default_threads};
use crate::workspace::lock;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;

/// Attempts at a shard after which it is given up: whatever failed so often fails again.
const TRIES: u32 = 8;

/// Part of a job's memory that a task may plan with; the rest is for what the program does not count.
const SHARE: f64 = 0.95;

/// Part by which more memory is asked for with each attempt that did not end: it may have been too little.
const MORE: f64 = 0.25;

/// Runs tasks.
pub fn submit(args: &Submit) -> Result<bool> {
    match args.engine {
        Engine::Local => Local::new(args)?.run(),
        Engine::Slurm => Slurm::new(args)?.run(),
    }
}

/// This program.
fn program() -> Result<PathBuf> {
    std::env::current_exe().map_err(|e| Error::io("/proc/self/exe", "find", e))
}

/// The state of the run; an error if a shard failed too often.
fn state(folder: &Path) -> Result<Status> {
    let status = pipeline::status(folder)?;
    match status.begun.iter().find(|(_, tries)| *tries >= TRIES) {
        Some((shard, tries)) => Err(Error::NotResumable {
            path: folder.to_path_buf(),
            why: format!(
                "shard {shard} of generation {} failed {tries} times; see what \
                 `outcrop work {} --shard {shard}` says",
                status.generation,
                stop::quoted(folder)
            ),
        }),
        None => Ok(status),
    }
}

/// Runs a command whose answer is JSON.
fn advance(command: &mut Command) -> Result<After> {
    let shown = format!("{command:?}");
    let failed = |e| Error::io(&shown, "run", e);
    let output = command.stderr(Stdio::inherit()).output().map_err(failed)?;
    if !output.status.success() {
        return Err(failed(std::io::Error::other(output.status.to_string())));
    }
    serde_json::from_slice(&output.stdout).map_err(|e| failed(e.into()))
}

/// Processes on this machine.
struct Local<'a> {
    args: &'a Submit,
    program: PathBuf,
    workers: usize,
}

impl<'a> Local<'a> {
    fn new(args: &'a Submit) -> Result<Self> {
        let threads = pipeline::status(&args.folder)?.task_threads as usize;
        let usual = (default_threads() / threads).max(1);
        Ok(Self {
            args,
            program: program()?,
            workers: args.workers.map_or(usual, usize::from),
        })
    }

    fn advance(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.arg("advance").arg(&self.args.folder);
        command.args(["--json", "--quiet"]);
        if let Some(report) = &self.args.report {
            command.arg("--report").arg(report);
        }
        command
    }

    fn work(&self, generation: u64, shard: u32) -> Command {
        let mut command = Command::new(&self.program);
        command.arg("work").arg(&self.args.folder).arg("--quiet");
        command.args(["--generation", &generation.to_string()]);
        command.args(["--shard", &shard.to_string()]);
        command
    }

    fn run(&self) -> Result<bool> {
        if self.args.dry_run {
            let status = state(&self.args.folder)?;
            let commands = match status.can_advance {
                true => vec![self.advance()],
                false => {
                    let missing = status.missing().into_iter();
                    missing.map(|k| self.work(status.generation, k)).collect()
                }
            };
            let lines = commands.iter().map(|c| format!("{c:?}"));
            print(&lines.collect::<Vec<_>>().join("\n"))?;
            return Ok(true);
        }
        loop {
            let status = state(&self.args.folder)?;
            if !status.can_advance {
                self.work_all(status.generation, status.missing())?;
            }
            let after = advance(&mut self.advance())?;
            print(&after.to_string())?;
            if after.finished {
                return Ok(true);
            }
        }
    }

    /// Runs the tasks of `shards`, some at the same time; one that was killed is run again.
    fn work_all(&self, generation: u64, shards: Vec<u32>) -> Result<()> {
        let left = Mutex::new(VecDeque::from(shards));
        let tries: Mutex<BTreeMap<u32, u32>> = Mutex::default();
        let failed: Mutex<Option<Error>> = Mutex::default();
        let worker = || {
            loop {
                let shard = lock(&left).pop_front();
                let (Some(shard), true) = (shard, lock(&failed).is_none()) else {
                    return;
                };
                // An error that a task reports itself remains one; a signal may not come again.
                let (problem, lost) = match self.work(generation, shard).status() {
                    Ok(status) if status.success() => continue,
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

/// Jobs of Slurm: an array of tasks, and a job after it that advances the run and submits the next ones.
struct Slurm<'a> {
    args: &'a Submit,
    program: PathBuf,
    folder: PathBuf,
}

const WORK: &str = "work.sbatch";
const ADVANCE: &str = "advance.sbatch";

impl<'a> Slurm<'a> {
    fn new(args: &'a Submit) -> Result<Self> {
        let folder = std::path::absolute(&args.folder);
        Ok(Self {
            args,
            program: program()?,
            folder: folder.map_err(|e| Error::io(&args.folder, "find", e))?,
        })
    }

    /// A job script with these resources that ends with `command`.
    fn script(&self, name: &str, status: &Status, log: &str, command: &str) -> String {
        let memory = mebibytes(status, 0);
        let folder = self.folder.display();
        format!(
            "#!/bin/bash\n\
             #SBATCH --job-name=outcrop-{name}\n\
             #SBATCH --ntasks=1\n\
             #SBATCH --cpus-per-task={}\n\
             #SBATCH --mem={memory}M\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             #SBATCH --signal=B:TERM@60\n\
             #SBATCH --output={folder}/logs/{log}.log\n\
             exec {command}\n",
            status.task_threads,
        )
    }

    /// The scripts by name.
    fn scripts(&self, status: &Status) -> [(&'static str, String); 2] {
        let (program, folder) = (stop::quoted(&self.program), stop::quoted(&self.folder));
        let work = format!("{program} work {folder} --quiet --generation \"$1\"");
        let report = self.args.report.as_ref().map_or(String::new(), |path| {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            format!(" --report {}", stop::quoted(&path))
        });
        let advance = match self.args.foreground {
            true => format!("{program} advance {folder} --quiet{report}"),
            false => {
                let site = self
                    .args
                    .site
                    .iter()
                    .map(|flag| stop::quoted(Path::new(flag)));
                let site: Vec<String> = site.collect();
                let site = match site.is_empty() {
                    true => String::new(),
                    false => format!(" -- {}", site.join(" ")),
                };
                format!("{program} submit {folder} --engine slurm --inside{report}{site}")
            }
        };
        [
            (WORK, self.script("work", status, "work-%A_%a", &work)),
            (
                ADVANCE,
                self.script("advance", status, "advance-%j", &advance),
            ),
        ]
    }

    fn run(&self) -> Result<bool> {
        let status = state(&self.folder)?;
        let scripts = self.scripts(&status);
        if self.args.dry_run {
            for (name, text) in &scripts {
                print(&format!("# {}\n{text}", self.folder.join(name).display()))?;
            }
            let first = match status.can_advance {
                true => self.sbatch(&[], ADVANCE, None),
                false => self.sbatch(&tasks(&status), WORK, Some(status.generation)),
            };
            print(&format!("# first\n{first:?}"))?;
            return Ok(true);
        }
        let logs = self.folder.join("logs");
        std::fs::create_dir_all(&logs).map_err(|e| Error::io(&logs, "make the folder", e))?;
        for (name, text) in &scripts {
            let path = self.folder.join(name);
            std::fs::write(&path, text).map_err(|e| Error::io(&path, "write", e))?;
        }
        if self.args.foreground {
            return self.wait(status);
        }
        let status = match (self.args.inside, status.can_advance) {
            (true, true) => {
                let mut command = Command::new(&self.program);
                command
                    .arg("advance")
                    .arg(&self.folder)
                    .args(["--json", "--quiet"]);
                if let Some(report) = &self.args.report {
                    command.arg("--report").arg(report);
                }
                let after = advance(&mut command)?;
                print(&after.to_string())?;
                if after.finished {
                    return Ok(true);
                }
                state(&self.folder)?
            }
            (false, true) => {
                let id = self.submitted(&mut self.sbatch(&[], ADVANCE, None))?;
                print(&format!(
                    "submitted job {id}; see: outcrop status {}",
                    stop::quoted(&self.folder)
                ))?;
                return Ok(true);
            }
            _ => status,
        };
        let missing = status.missing();
        let generation = Some(status.generation);
        let job = self.submitted(&mut self.sbatch(&tasks(&status), WORK, generation))?;
        let after = format!("--dependency=afterany:{job}");
        let next = self.submitted(&mut self.sbatch(&[after], ADVANCE, None))?;
        print(&format!(
            "generation {}: submitted {} as job {job}, and job {next} after it",
            status.generation,
            style::counted(missing.len() as u64, "task"),
        ))?;
        Ok(true)
    }

    /// Submits one job after another and waits for each.
    fn wait(&self, mut status: Status) -> Result<bool> {
        loop {
            let wait = "--wait".to_owned();
            let (mut command, advances) = match status.can_advance {
                true => (self.sbatch(&[wait], ADVANCE, None), true),
                false => {
                    let mut options = tasks(&status);
                    options.push(wait);
                    (self.sbatch(&options, WORK, Some(status.generation)), false)
                }
            };
            let shown = format!("{command:?}");
            let ended = command.stdout(Stdio::null()).status();
            let ended = ended.map_err(|e| Error::io(&shown, "run", e))?;
            // Tasks that failed are found missing, and run again.
            if advances && !ended.success() {
                let why = std::io::Error::other(format!(
                    "the job failed; see {}/logs",
                    self.folder.display()
                ));
                return Err(Error::io(&self.folder, "advance", why));
            }
            if advances && !self.folder.exists() {
                print("the mesh is finished")?;
                return Ok(true);
            }
            status = state(&self.folder)?;
        }
    }

    /// The command that submits a script.
    fn sbatch(&self, more: &[String], script: &str, generation: Option<u64>) -> Command {
        let mut command = Command::new("sbatch");
        command.arg("--parsable").args(more).args(&self.args.site);
        command.arg(self.folder.join(script));
        command.args(generation.map(|n| n.to_string()));
        command
    }

    /// Submits a script; returns the number of the job.
    fn submitted(&self, command: &mut Command) -> Result<String> {
        let shown = format!("{command:?}");
        let failed = |e| Error::io(&shown, "run", e);
        let output = command.stderr(Stdio::inherit()).output().map_err(failed)?;
        if !output.status.success() {
            return Err(failed(std::io::Error::other(output.status.to_string())));
        }
        let text = String::from_utf8_lossy(&output.stdout);
        // With several clusters the name of one follows.
        let id = text.trim().split(';').next().unwrap_or_default();
        Ok(id.to_owned())
    }
}

/// Memory of a job in MiB, after a number of attempts that did not end.
fn mebibytes(status: &Status, tries: u32) -> f64 {
    let planned = status.task_memory as f64 / SHARE / f64::from(1 << 20);
    (planned * (1.0 + MORE * f64::from(tries))).ceil()
}

/// The options for an array of the missing shards.
fn tasks(status: &Status) -> Vec<String> {
    let tries = status.begun.iter().map(|(_, tries)| *tries);
    let more = tries
        .max()
        .map(|tries| format!("--mem={}M", mebibytes(status, tries)));
    more.into_iter().chain([array(&status.missing())]).collect()
}

/// The option for an array of these shards: `0-4,7`.
fn array(shards: &[u32]) -> String {
    let runs = shards.chunk_by(|a, b| a + 1 == *b);
    let runs = runs.map(|run| match run {
        [one] => one.to_string(),
        run => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    format!("--array={}", runs.collect::<Vec<_>>().join(","))
}

#[cfg(test)]
mod tests {
    use super::array;

    #[test]
    fn shards_are_ranges_of_an_array() {
        assert_eq!(array(&[3]), "--array=3");
        assert_eq!(array(&[0, 1, 2, 5, 7, 8]), "--array=0-2,5,7-8");
    }
}
