//! One reconstruction, from cloud to mesh, in a process of its own: so its peak memory is its own, and its
//! time includes all that a user waits for.

use crate::{Result, cpu};
use outcrop::Reconstruction;
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;

/// A reconstruction with its resources.
#[derive(Debug, Clone, clap::Args)]
pub struct Job {
    /// The cloud
    pub input: PathBuf,
    /// The mesh
    pub output: PathBuf,
    /// Worker threads
    #[arg(long)]
    pub threads: usize,
    /// Memory budget in bytes
    #[arg(long)]
    pub memory: u64,
}

/// The child process: reconstructs and prints the report.
pub fn work(job: &Job) -> Result<()> {
    let report = Reconstruction::builder()
        .input(&job.input)
        .output(&job.output)
        .threads(job.threads)
        .memory(job.memory)
        .build()?
        .run()?;
    println!("{}", serde_json::to_string(&report)?);
    Ok(())
}

/// Measurements of the parent process.
#[derive(Debug)]
pub struct Outcome {
    /// Wall-clock seconds of the whole process.
    pub seconds: f64,
    /// Its processor time in seconds.
    pub cpu: f64,
    /// Its report.
    pub report: Value,
}

/// The parent process: starts the child and waits for it.
pub fn time(job: &Job) -> Result<Outcome> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("pipeline").arg(&job.input).arg(&job.output);
    command.arg("--threads").arg(job.threads.to_string());
    command.arg("--memory").arg(job.memory.to_string());
    let (start, cpu) = (Instant::now(), cpu::children()?);
    let output = command.stderr(Stdio::inherit()).output()?;
    let seconds = start.elapsed().as_secs_f64();
    let cpu = cpu::children()? - cpu;
    if !output.status.success() {
        return Err(format!("the reconstruction failed: {}", output.status).into());
    }
    Ok(Outcome {
        seconds,
        cpu,
        report: serde_json::from_slice(&output.stdout)?,
    })
}
