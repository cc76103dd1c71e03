//! A measurement: pairs of K and pipeline, medians.

use crate::{Result, Run, cloud, knn, neighbors, pipeline, show};
use outcrop::{default_memory, default_threads};
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_disk::workspace::{Workspace, limits};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// A measurement; the content of the JSON file.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measurement {
    /// Name of the cloud's file.
    pub cloud: String,
    /// Distinct points.
    pub points: u64,
    /// Threads, for K and pipeline.
    pub threads: usize,
    /// Memory budget of the pipeline in bytes.
    pub memory_budget: u64,
    /// The machine.
    pub machine: Machine,
    /// Median of K in seconds.
    pub k_seconds: f64,
    /// Median of the pipeline's wall-clock seconds, start to end of its process.
    pub pipeline_seconds: f64,
    /// Median over the pairs of pipeline / K.
    pub ratio: f64,
    /// Median over the pairs of the pipeline's own neighbour search alone / K.
    pub neighbors_ratio: f64,
    /// The same as `ratio`, of processor times, which a busy machine affects least.
    pub cpu_ratio: f64,
    /// Share of the threads' wall-clock time that the pipeline spent computing, median.
    pub utilisation: f64,
    /// Stages in order, median seconds.
    pub stages: Vec<Stage>,
    /// Largest resident memory of the pipeline's process in bytes.
    pub peak_resident_bytes: u64,
    /// Scratch space at peak in bytes.
    pub peak_scratch_bytes: u64,
    /// Median of the seconds that building the k-d tree takes; not part of K.
    pub tree_build_seconds: f64,
    /// Every pair.
    pub pairs: Vec<Pair>,
    /// The report of the last reconstruction.
    pub report: Value,
}

/// One pair, in the order of measurement.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Pair {
    /// Seconds of all queries.
    pub k_seconds: f64,
    /// Seconds of the pipeline, directly after.
    pub pipeline_seconds: f64,
    /// Seconds of the pipeline's own neighbour search alone, between the two.
    pub neighbors_seconds: f64,
    /// Processor time of all queries.
    pub k_cpu_seconds: f64,
    /// Processor time of the pipeline.
    pub pipeline_cpu_seconds: f64,
}

/// Time and bytes of a stage.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Median wall-clock seconds.
    pub seconds: f64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Bytes written.
    pub bytes_written: u64,
}

/// The machine of the measurement.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor's name.
    pub model: String,
    /// Threads it offers.
    pub cores: usize,
    /// Memory available to this process, in bytes.
    pub memory: u64,
}

impl Machine {
    fn here() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let named = info.lines().find(|l| l.starts_with("model name"));
        let model = named
            .and_then(|l| l.split_once(':'))
            .map_or("unknown", |(_, m)| m.trim());
        let memory = limits::memory_allowed();
        Self {
            model: model.to_owned(),
            cores: default_threads(),
            memory,
        }
    }
}

/// The middle value, or the mean of the two middle ones.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n => (values[(n - 1) / 2] + values[n / 2]) / 2.0,
    }
}

/// `yardstick run`
pub fn run(options: &Run) -> Result<()> {
    let parent = options.scratch.clone().unwrap_or_else(std::env::temp_dir);
    let folder = tempfile::Builder::new()
        .prefix("yardstick-")
        .tempdir_in(parent)?;
    let measured = measure(options, folder.path())?;
    print!("{}", show::text(&measured));
    if let Some(path) = &options.json {
        std::fs::write(path, serde_json::to_string_pretty(&measured)? + "\n")?;
    }
    Ok(())
}

fn measure(options: &Run, folder: &Path) -> Result<Measurement> {
    let threads = options.threads.unwrap_or_else(default_threads);
    let input = match &options.input {
        Some(path) => path.clone(),
        None => options.sample.write(folder)?,
    };
    // K has all available memory; only the pipeline has a budget.
    let all = MemoryPool::new(limits::memory_allowed())?;
    let workspace = Workspace::new(folder, all, threads, Arc::new(Silent), Cancel::new())?;
    let (store, step) = cloud::ordered(&input, &workspace)?;
    let points = cloud::points(&store, step)?;
    let job = pipeline::Job {
        input: input.clone(),
        output: folder.join("mesh.ply"),
        threads,
        memory: options
            .memory
            .map_or_else(default_memory, |size| size.as_u64()),
    };
    let (mut pairs, mut builds, mut reports) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..options.repeat.max(1) {
        let tree = knn::time(&points, &workspace)?;
        let near = neighbors::time(&store, &workspace)?;
        let outcome = pipeline::time(&job)?;
        pairs.push(Pair {
            k_seconds: tree.queries,
            pipeline_seconds: outcome.seconds,
            neighbors_seconds: near,
            k_cpu_seconds: tree.cpu,
            pipeline_cpu_seconds: outcome.cpu,
        });
        builds.push(tree.build);
        reports.push(outcome.report);
    }
    let most = |key: &str| {
        reports
            .iter()
            .filter_map(|r| r[key].as_u64())
            .max()
            .unwrap_or(0)
    };
    Ok(Measurement {
        cloud: input
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        points: points.len() as u64,
        threads,
        memory_budget: job.memory,
        machine: Machine::here(),
        k_seconds: median(pairs.iter().map(|p| p.k_seconds)),
        pipeline_seconds: median(pairs.iter().map(|p| p.pipeline_seconds)),
        ratio: median(pairs.iter().map(|p| p.pipeline_seconds / p.k_seconds)),
        neighbors_ratio: median(pairs.iter().map(|p| p.neighbors_seconds / p.k_seconds)),
        cpu_ratio: median(
            pairs
                .iter()
                .map(|p| p.pipeline_cpu_seconds / p.k_cpu_seconds),
        ),
        utilisation: median(
            pairs
                .iter()
                .map(|p| p.pipeline_cpu_seconds / p.pipeline_seconds / threads as f64),
        ),
        stages: stages(&reports),
        peak_resident_bytes: most("peak_resident_bytes"),
        peak_scratch_bytes: most("peak_scratch_bytes"),
        tree_build_seconds: median(builds),
        pairs,
        report: reports.pop().unwrap_or_default(),
    })
}

/// The stages of several reports of the same run.
fn stages(reports: &[Value]) -> Vec<Stage> {
    let of = |report: &Value| report["stages"].as_array().cloned().unwrap_or_default();
    let first = reports.first().map(of).unwrap_or_default();
    let seconds = |number: usize| {
        let of_one = move |r: &Value| r["stages"][number]["seconds"].as_f64();
        median(reports.iter().filter_map(of_one))
    };
    let stage = |(number, s): (usize, &Value)| Stage {
        name: s["name"].as_str().unwrap_or("?").to_owned(),
        seconds: seconds(number),
        bytes_read: s["bytes_read"].as_u64().unwrap_or(0),
        bytes_written: s["bytes_written"].as_u64().unwrap_or(0),
    };
    first.iter().enumerate().map(stage).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median([]).is_nan());
    }

    #[test]
    fn stages_are_taken_by_number() {
        let report = |a: f64, b: f64| {
            serde_json::json!({"stages": [
                {"name": "smooth", "seconds": a, "bytes_read": 1, "bytes_written": 2},
                {"name": "smooth", "seconds": b, "bytes_read": 3, "bytes_written": 4},
            ]})
        };
        let got = stages(&[report(1.0, 5.0), report(3.0, 7.0), report(2.0, 6.0)]);
        assert_eq!(
            got.iter().map(|s| s.seconds).collect::<Vec<_>>(),
            [2.0, 6.0]
        );
        assert_eq!(got[1].bytes_read, 3);
    }
}
