//! Jobs of Slurm: an array of tasks, and a job after it that advances the run and submits the next ones.

use super::super::Submit;
use super::{advance, advance_command, mebibytes, program, state};
use crate::cli::output::print;
use crate::cli::{stop, style};
use crate::pipeline::{Status, TaskState};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::make_folder;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A run whose tasks are jobs of Slurm.
pub struct Slurm<'a> {
    args: &'a Submit,
    program: PathBuf,
    folder: PathBuf,
}

const WORK: &str = "work.sbatch";
const ADVANCE: &str = "advance.sbatch";

impl<'a> Slurm<'a> {
    pub fn new(args: &'a Submit) -> Result<Self> {
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
        let report = self.args.how.report.as_ref().map_or(String::new(), |path| {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            format!(" --report {}", stop::quoted(&path))
        });
        let advance = match self.args.how.foreground {
            true => format!("{program} advance {folder} --quiet{report}"),
            false => {
                let site = self.args.how.site.iter();
                let site: Vec<String> = site.map(|flag| stop::quoted(Path::new(flag))).collect();
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

    pub fn run(&self) -> Result<bool> {
        let status = state(&self.folder)?;
        let scripts = self.scripts(&status);
        if self.args.dry_run {
            for (name, text) in &scripts {
                print(&format!("# {}\n{text}", self.folder.join(name).display()))?;
            }
            let first = match status.can_advance {
                true => self.sbatch(&advance_options(&status), ADVANCE, None),
                false => self.sbatch(&tasks(&status), WORK, Some(status.generation)),
            };
            print(&format!("# first\n{first:?}"))?;
            return Ok(true);
        }
        let logs = self.folder.join("logs");
        // Not the run's folder: another chain of jobs may have finished the run and removed it meanwhile.
        make_folder(&logs)?;
        for (name, text) in &scripts {
            let path = self.folder.join(name);
            std::fs::write(&path, text).map_err(|e| Error::io(&path, "write", e))?;
        }
        if self.args.how.foreground {
            return self.wait(status);
        }
        let status = match (self.args.inside, status.can_advance) {
            (true, true) => {
                let after = advance(&mut advance_command(&self.program, self.args, &self.folder))?;
                if let Some(after) = after {
                    print(&after.to_string())?;
                    if after.finished {
                        return Ok(true);
                    }
                }
                state(&self.folder)?
            }
            (false, true) => {
                let id =
                    self.submitted(&mut self.sbatch(&advance_options(&status), ADVANCE, None))?;
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
                true => {
                    let options = advance_options(&status).into_iter().chain([wait]);
                    (
                        self.sbatch(&options.collect::<Vec<_>>(), ADVANCE, None),
                        true,
                    )
                }
                false => {
                    let mut options = tasks(&status);
                    options.push(wait);
                    (self.sbatch(&options, WORK, Some(status.generation)), false)
                }
            };
            let shown = format!("{command:?}");
            let ended = command.stdout(Stdio::null()).status();
            let ended = ended.map_err(|e| Error::io(&shown, "run", e))?;
            // Tasks that failed are found missing, and run again. An advance is so if it was killed.
            if advances && !ended.success() {
                let now = state(&self.folder)?;
                let failed = now.advance.is_none_or(|a| a.state == TaskState::Failed);
                if failed && now.can_advance && !now.damaged {
                    let why = std::io::Error::other(format!(
                        "the job failed; see {}/logs",
                        self.folder.display()
                    ));
                    return Err(Error::io(&self.folder, "advance", why));
                }
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
        command
            .arg("--parsable")
            .args(more)
            .args(&self.args.how.site);
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

/// The options for a job that advances: more memory if an earlier one did not end.
fn advance_options(status: &Status) -> Vec<String> {
    let tries = status.advance.as_ref().map(|advance| advance.attempts);
    tries
        .map(|tries| format!("--mem={}M", mebibytes(status, tries)))
        .into_iter()
        .collect()
}

/// The options for an array of the missing shards.
fn tasks(status: &Status) -> Vec<String> {
    let tries = status.begun.iter().map(|begun| begun.attempts);
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
