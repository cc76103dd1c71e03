//! Stages as steps of a run, with their time.

use crate::report::{PartReport, StageReport};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Runs stages and measures them.
pub(crate) struct Clock<'a> {
    workspace: &'a Workspace,
    /// Measurements of the stages, with those of earlier attempts.
    pub stages: Vec<StageReport>,
    /// When the stages of this attempt began.
    pub begun: Vec<PartReport>,
    begin: Instant,
    /// Seconds of the stages that an earlier attempt finished.
    pub earlier: f64,
}

/// Measurements of a stage.
#[derive(Serialize, Deserialize)]
struct Took {
    seconds: f64,
    read: u64,
    written: u64,
    scratch: u64,
    held: u64,
    parts: Vec<(String, f64)>,
}

impl<'a> Clock<'a> {
    pub(crate) fn new(workspace: &'a Workspace) -> Self {
        Self {
            workspace,
            stages: Vec::new(),
            begun: Vec::new(),
            begin: Instant::now(),
            earlier: 0.0,
        }
    }

    pub(crate) fn stage<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &'static str,
        unit: &'static str,
        total: u64,
        work: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        self.round(name, name, unit, total, work)
    }

    /// A stage with the name `step` among the steps of the run: one of several rounds of stage `name`.
    pub(crate) fn round<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &'static str,
        step: &str,
        unit: &'static str,
        total: u64,
        work: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        let workspace = self.workspace;
        let (mut now, since) = (false, self.begin.elapsed().as_secs_f64());
        let (value, took) = workspace.once(step, |_| {
            now = true;
            let io = &workspace.io;
            let (start, read, written) = (Instant::now(), io.read(), io.written());
            io.begin_stage();
            // Usage before the stage does not count for it.
            let _ = workspace.memory.take_held();
            workspace.observer.begin(name, unit, total);
            let outcome = work();
            workspace.observer.end();
            let parts = workspace.take_parts().into_iter();
            let took = Took {
                seconds: start.elapsed().as_secs_f64(),
                read: io.read() - read,
                written: io.written() - written,
                scratch: io.stage_peak(),
                held: workspace.memory.take_held(),
                parts: parts.map(|(name, s)| (name.to_owned(), s)).collect(),
            };
            Ok((outcome?, took))
        })?;
        match now {
            true => self.begun.push(PartReport {
                name: name.to_owned(),
                seconds: since,
            }),
            false => self.earlier += took.seconds,
        }
        let parts = took.parts.into_iter();
        self.stages.push(StageReport {
            name,
            seconds: took.seconds,
            bytes_read: took.read,
            bytes_written: took.written,
            scratch_bytes: took.scratch,
            held_bytes: took.held,
            parts: parts
                .map(|(name, seconds)| PartReport { name, seconds })
                .collect(),
        });
        Ok(value)
    }
}
