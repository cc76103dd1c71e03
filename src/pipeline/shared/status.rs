//! The state of a run that tasks share, for people and scripts.

use super::super::away::Copies;
use super::place;
use crate::pipeline::manifest::Manifest;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::away::Traffic;
use outcrop_disk::workspace::generations::{Attempts, Generation, Shard, SharedFolder};
use outcrop_disk::workspace::journal::{OpenStep, Took};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// An attempt whose journal was not written for so long is taken for lost. A unit takes seconds; caches of
/// network file systems show changes late by up to a minute.
const SILENCE: Duration = Duration::from_secs(300);

/// Most finished tasks of a generation whose times are read.
const SAMPLE: usize = 32;

/// Share of the stages in the processor time of a run, in per cent; measured on generated surfaces and scans,
/// which differ by up to half of it. Stages that are not asked for by default have what their work resembles.
const STAGES: [(&str, f64); 11] = [
    ("ingest", 7.0),
    ("thin", 6.0),
    ("order", 9.0),
    ("outliers", 4.0),
    ("smooth", 9.0),
    ("relax", 13.0),
    ("cells", 40.0),
    ("triples", 3.0),
    ("stitch", 14.0),
    ("repair", 11.0),
    ("export", 3.0),
];

/// The state of a run that tasks share.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Status {
    /// The folder of the run.
    pub folder: PathBuf,
    /// The mesh.
    pub output: PathBuf,
    /// Number of the generation.
    pub generation: u64,
    /// The steps whose units are open in it; the first part of a name is the stage.
    pub steps: Vec<String>,
    /// Number of shards.
    pub shards: u32,
    /// Most threads of a task.
    pub task_threads: u32,
    /// Memory of a task in bytes, as planned.
    pub task_memory: u64,
    /// Number of open units.
    pub units: u64,
    /// Numbers of finished shards.
    pub done: Vec<u32>,
    /// Shards that were begun and are not finished.
    pub begun: Vec<Begun>,
    /// Shards that nobody began.
    pub new: Vec<u32>,
    /// The attempts at the work between this generation and the next.
    pub advance: Option<Begun>,
    /// True if a process found the work of others damaged; `advance` then finds out what of it is.
    pub damaged: bool,
    /// True if the next generation can be made: all shards are finished, or damaged work is to be made again.
    pub can_advance: bool,
    /// True if the mesh is finished.
    pub finished: bool,
    /// Points of the cloud, once they are read.
    pub points: Option<u64>,
    /// Points a second of the open step.
    pub points_per_second: Option<f64>,
    /// Estimated seconds until the open step is finished.
    pub step_seconds_left: Option<f64>,
    /// Estimated seconds until the mesh is finished: the time so far, and the usual shares of the stages.
    pub seconds_left: Option<f64>,
    /// The resources that finished processes took.
    pub totals: Totals,
}

/// Work that was begun and is not finished.
#[derive(Debug, Clone, Serialize)]
pub struct Begun {
    /// The shard; none for the work between two generations.
    pub shard: Option<u32>,
    /// Number of attempts.
    pub attempts: u32,
    /// The state of the last one, as far as its journal tells.
    pub state: TaskState,
    /// Seconds since an attempt wrote to its journal.
    pub silent_seconds: u64,
    /// The reason that the last failed attempt gave.
    pub why: Option<String>,
}

/// The state of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskState {
    /// It was at work lately.
    Running,
    /// It told why it failed.
    Failed,
    /// It has been silent for minutes.
    Lost,
}

/// The resources that finished processes took.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Processor time of tasks.
    pub task_cpu_seconds: f64,
    /// Processor time of the work between generations.
    pub serial_cpu_seconds: f64,
    /// Wall-clock seconds of the work between generations.
    pub serial_seconds: f64,
    /// Largest peak of the resident memory of a task, in bytes.
    pub task_resident_bytes: u64,
    /// Largest peak of the resident memory between generations, in bytes.
    pub serial_resident_bytes: u64,
    /// Bytes that all processes read.
    pub bytes_read: u64,
    /// Bytes that all processes wrote.
    pub bytes_written: u64,
    /// What was asked of the store of a run that is in one, without the journals at the ends of processes.
    pub store: Traffic,
}

impl Totals {
    pub(super) fn of(all: &[Took]) -> Self {
        let mut totals = Self::default();
        for took in all {
            let (cpu, resident) = match took.shard {
                Some(_) => (
                    &mut totals.task_cpu_seconds,
                    &mut totals.task_resident_bytes,
                ),
                None => {
                    totals.serial_seconds += took.seconds;
                    (
                        &mut totals.serial_cpu_seconds,
                        &mut totals.serial_resident_bytes,
                    )
                }
            };
            *cpu += took.cpu_seconds;
            *resident = took.resident.max(*resident);
            totals.bytes_read += took.read;
            totals.bytes_written += took.written;
            totals.store.requests += took.traffic.requests;
            totals.store.fetched += took.traffic.fetched;
            totals.store.sent += took.traffic.sent;
        }
        totals
    }
}

impl Begun {
    fn of(shard: Option<u32>, attempts: &Attempts, now: SystemTime) -> Self {
        let silent = attempts.written.map_or(Duration::ZERO, |written| {
            // The clock of a file server may be ahead.
            now.duration_since(written).unwrap_or_default()
        });
        let state = match (attempts.all_failed(), silent > SILENCE) {
            (true, _) => TaskState::Failed,
            (false, true) => TaskState::Lost,
            (false, false) => TaskState::Running,
        };
        Self {
            shard,
            attempts: attempts.count,
            state,
            silent_seconds: silent.as_secs(),
            why: attempts
                .failed
                .as_ref()
                .map(|(_, failure)| failure.why.clone()),
        }
    }
}

impl Status {
    /// The shards that are not finished.
    #[must_use]
    pub fn missing(&self) -> Vec<u32> {
        let begun = self.begun.iter().filter_map(|begun| begun.shard);
        let mut all: Vec<u32> = begun.chain(self.new.iter().copied()).collect();
        all.sort_unstable();
        all
    }

    /// The number of shards that have work in this generation.
    #[must_use]
    pub fn open_shards(&self) -> usize {
        self.done.len() + self.begun.len() + self.new.len()
    }

    /// The stage of the open step.
    #[must_use]
    pub fn stage(&self) -> Option<&str> {
        self.steps
            .first()?
            .trim_start_matches('/')
            .split('/')
            .next()
    }

    /// Estimates the time left. `seconds` has the times of some finished tasks, `begun` the time since this
    /// generation began, and `all` since the first one did.
    fn estimate(&mut self, seconds: &[f64], begun: f64, all: f64) {
        let (done, open) = (self.done.len() as f64, self.open_shards() as f64);
        if done > 0.0 && begun > 0.0 {
            self.points_per_second = self
                .points
                .map(|points| points as f64 * done / open / begun);
            let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
            let at_once = (mean * done / begun).max(1.0);
            self.step_seconds_left = Some(mean * (open - done) / at_once);
        }
        // Steps of earlier generations of this stage are not known here: half of its share.
        let place = self
            .stage()
            .and_then(|s| STAGES.iter().position(|(name, _)| *name == s));
        let Some(place) = place else { return };
        let sum = |stages: &[(&str, f64)]| stages.iter().map(|(_, share)| share).sum::<f64>();
        let before = sum(&STAGES[..place]) + STAGES[place].1 * 0.5;
        self.seconds_left = Some(all * (sum(&STAGES) - before) / before);
    }
}

/// The state of the run in a folder.
///
/// # Errors
/// [`crate::Error::NotResumable`], [`crate::Error::Io`], [`crate::Error::Corrupt`].
pub fn status(path: &Path) -> Result<Status> {
    let folder = place::open(path, &Copies::default())?;
    let output = Manifest::from_bytes(path, &folder.manifest)?.output();
    let status = Status {
        folder: path.to_path_buf(),
        output,
        ..Status::default()
    };
    if folder.is_left_over() {
        // Its removal was interrupted, after the mesh was finished.
        return Ok(Status {
            finished: true,
            ..status
        });
    }
    let generation = folder.read(folder.newest()?)?;
    let now = SystemTime::now();
    let steps = generation.open.iter();
    let mut status = Status {
        generation: generation.number,
        steps: steps.map(|OpenStep { step, .. }| step.clone()).collect(),
        shards: generation.sharing.shards,
        task_threads: generation.sharing.threads,
        task_memory: generation.sharing.memory,
        units: generation.units(),
        damaged: folder.is_damaged(&generation)?,
        finished: generation.finished,
        totals: Totals::of(&generation.took),
        ..status
    };
    for (shard, state) in (0..).zip(folder.shards(&generation)?) {
        match state {
            Shard::Empty => {}
            Shard::New => status.new.push(shard),
            Shard::Begun(attempts) => {
                status.begun.push(Begun::of(Some(shard), &attempts, now));
            }
            Shard::Done => status.done.push(shard),
        }
    }
    let advances = folder.advances(&generation)?;
    status.advance = (advances.count > 0).then(|| Begun::of(None, &advances, now));
    status.can_advance = !status.finished && (status.damaged || status.missing().is_empty());
    add_times(&mut status, &folder, &generation, now);
    Ok(status)
}

/// Adds the points, the speed, and the time left.
fn add_times(status: &mut Status, folder: &SharedFolder, generation: &Generation, now: SystemTime) {
    let serial = generation.took.iter().filter(|took| took.shard.is_none());
    let points = serial.clone().map(|took| took.points).next_back();
    status.points = points.filter(|points| *points > 0);
    let since = |then: SystemTime| now.duration_since(then).unwrap_or_default().as_secs_f64();
    let begun = folder.begun(generation.number).map_or(0.0, since);
    let first = serial.clone().map(|took| took.ended).next();
    let all = first.map_or(0.0, |seconds| {
        since(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds))
    });
    let last = status.done.len().saturating_sub(SAMPLE);
    let seconds = folder.seconds(generation, &status.done[last..]);
    status.estimate(&seconds, begun, all);
}
