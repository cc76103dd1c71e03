//! `outcrop status`: the state of a run that tasks share, in words.

use super::Status;
use crate::cli::output::{print, show};
use crate::cli::{stop, style};
use crate::pipeline::{self, Begun, TaskState};
use outcrop_disk::error::Result;
use std::fmt::{Display, Formatter};

/// Most shards of one kind that are listed.
const LISTED: usize = 8;

/// Seconds of a run before the time left is told.
const EARLY: f64 = 5.0;

/// Shows the state of a run.
pub fn status(args: &Status) -> Result<bool> {
    let status = pipeline::status(&pipeline::shared_folder(&args.folder)?)?;
    if args.missing {
        // While damaged work is not open again, tasks cannot finish.
        let missing = match status.damaged {
            true => Vec::new(),
            false => status.missing(),
        };
        let lines = missing.into_iter().map(|shard| shard.to_string());
        let lines: Vec<String> = lines.collect();
        if !lines.is_empty() {
            print(&lines.join("\n"))?;
        }
        return Ok(true);
    }
    show(&status, args.json)?;
    Ok(true)
}

impl Display for pipeline::Status {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let folder = stop::quoted(&self.folder);
        writeln!(f, "mesh          {}", self.output.display())?;
        let steps = match &self.steps[..] {
            [] => "not begun".to_owned(),
            [one] => one.trim_start_matches('/').to_owned(),
            [first, ..] => format!(
                "{} and {} more",
                first.trim_start_matches('/'),
                self.steps.len() - 1
            ),
        };
        writeln!(f, "generation    {}: {steps}", self.generation)?;
        let count = |state| self.begun.iter().filter(|b| b.state == state).count();
        writeln!(
            f,
            "shards        {} of {} done, {} running, {} failed, {} lost, {} not begun; {} of work",
            self.done.len(),
            self.open_shards(),
            count(TaskState::Running),
            count(TaskState::Failed),
            count(TaskState::Lost),
            self.new.len(),
            style::counted(self.units, "unit"),
        )?;
        let pieces = self.begun.iter().chain(&self.advance);
        let troubled = pieces.filter(|b| b.state != TaskState::Running || b.why.is_some());
        for begun in troubled.take(LISTED) {
            writeln!(f, "{:<13} {begun}", begun.label())?;
        }
        if let Some(points) = self.points {
            write!(f, "points        {}", style::grouped(points))?;
            if let Some(rate) = self.points_per_second {
                write!(f, ", {} a second in this step", style::grouped(rate as u64))?;
            }
            writeln!(f)?;
        }
        let step = self
            .step_seconds_left
            .map(|s| format!("{} for this step", style::seconds(s)));
        let early = self.step_seconds_left.is_none() && self.seconds_left.is_none_or(|s| s < EARLY);
        let all = self.seconds_left.filter(|_| !early);
        let all = all.map(|s| format!("{} until the mesh is finished", style::seconds(s)));
        let left: Vec<String> = step.into_iter().chain(all).collect();
        if !left.is_empty() {
            writeln!(f, "time left     about {}", left.join(", "))?;
        }
        writeln!(f, "so far        {}", self.totals)?;
        match self.can_advance {
            true => write!(f, "go on with    outcrop advance {folder}"),
            false => write!(f, "go on with    outcrop submit {folder}"),
        }
    }
}

impl Begun {
    fn label(&self) -> &'static str {
        match self.state {
            TaskState::Running => "again",
            TaskState::Failed => "failed",
            TaskState::Lost => "lost",
        }
    }
}

impl Display for Begun {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self.shard {
            Some(shard) => write!(f, "shard {shard}")?,
            None => write!(f, "advance")?,
        }
        if self.attempts > 1 {
            write!(f, ", {} attempts", self.attempts)?;
        }
        if self.state == TaskState::Lost {
            write!(
                f,
                ", silent for {}",
                style::seconds(self.silent_seconds as f64)
            )?;
        }
        match &self.why {
            Some(why) => write!(f, ": {why}"),
            None => Ok(()),
        }
    }
}
