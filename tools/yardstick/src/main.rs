//! Measures whole reconstructions in units of a yardstick that is measured with them.
//!
//! **K** is the time of `nearest_n(30)` for all points in kiddo's `ImmutableKdTree<f32, 3>`, over points
//! sorted along a curve, on the same number of threads and in the same run. Machines differ and drift; the
//! ratio of a reconstruction to K does so much less.

mod cloud;
mod cpu;
mod knn;
mod measure;
mod neighbors;
mod pipeline;
mod show;

use bytesize::ByteSize;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Result with an error in words.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Measures whole reconstructions in units of K, the time of a k-d tree's 30-NN for the same points.
#[derive(Debug, Parser)]
#[command(name = "yardstick", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Measure K and the whole pipeline, alternately
    Run(Run),
    /// Print measurements, written by `run --json`, as Markdown tables
    Table {
        /// Files written by `run --json`
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
    /// One reconstruction in a process of its own; the report goes to standard output
    #[command(hide = true)]
    Pipeline(pipeline::Job),
}

/// `yardstick run`
#[derive(Debug, Args)]
struct Run {
    /// Cloud to use instead of a generated one: any file that outcrop reads
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    #[command(flatten)]
    sample: cloud::Sample,
    /// Threads, for K and for the pipeline [default: all available]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Memory budget of the pipeline, e.g. 512MiB [default: outcrop's]
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,
    /// Pairs of K and pipeline to measure; results are medians
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: usize,
    /// Folder for the cloud, scratch files and the mesh, all removed at the end
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
    /// Also write the measurement as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn run(args: &Arguments) -> Result<()> {
    match &args.command {
        Command::Run(run) => measure::run(run),
        Command::Table { files } => show::table(files),
        Command::Pipeline(job) => pipeline::work(job),
    }
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}
