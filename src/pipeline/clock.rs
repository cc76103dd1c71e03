//! Stages as steps of a run, with their time.

use crate::report::{PartReport, StageReport};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::limits::cpu_seconds;
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
    /// Processor time of all threads.
    cpu: f64,
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
            let (start, cpu) = (Instant::now(), cpu_seconds());
            let (read, written) = (io.read(), io.written());
            io.begin_stage();
            // Usage before the stage does not count for it.
            let _ = workspace.memory.take_held();
            workspace.observer.begin(name, unit, total);
            let outcome = work();
            workspace.observer.end();
            let parts = workspace.take_parts().into_iter();
            let took = Took {
                seconds: start.elapsed().as_secs_f64(),
                cpu: cpu_seconds() - cpu,
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
            cpu_seconds: took.cpu,
            serial_seconds: serial(took.seconds, took.cpu, workspace.threads),
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

/// Seconds in which one thread worked while the others waited, if in all other seconds all of them worked: by Amdahl's
/// law, more threads do not make this part shorter. Waiting for the disk counts as well.
fn serial(seconds: f64, cpu: f64, threads: usize) -> f64 {
    let threads = threads as f64;
    match threads > 1.0 {
        true => ((threads * seconds - cpu) / (threads - 1.0)).clamp(0.0, seconds),
        false => seconds,
    }
}

#[cfg(test)]
mod tests {
    use super::serial;

    #[test]
    fn what_one_thread_does_is_serial() {
        // Two seconds by one thread, and eight seconds of four.
        assert_eq!(serial(10.0, 2.0 + 4.0 * 8.0, 4), 2.0);
        assert_eq!(serial(10.0, 20.0, 2), 0.0);
        assert_eq!(serial(10.0, 10.0, 2), 10.0);
        assert_eq!(serial(10.0, 25.0, 2), 0.0);
        assert_eq!(serial(10.0, 9.0, 1), 10.0);
    }
}
