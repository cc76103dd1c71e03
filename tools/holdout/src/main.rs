//! The error of a reconstruction without known ground truth: some points of a scan are left out, a mesh is
//! made from the others, and the distances of the left-out points to it are measured.
//!
//! `split` draws the points, `measure` takes the distances, `row` prints the result as a line of a Markdown
//! table. All three hold their points in memory.

mod error;
mod measure;
mod ply;
mod read;
mod row;
mod split;

use bytesize::ByteSize;
use clap::{Args, Parser, Subcommand};
use error::{Error, Result};
use outcrop::{default_memory, default_threads};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Measures a reconstruction by points that were left out of it.
#[derive(Debug, Parser)]
#[command(name = "holdout", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Leave out random points of a scan
    Split(split::Split),
    /// Distance of the points left out to the mesh of the others, in units of the local spacing
    ///
    /// The local spacing at a left-out point is the mean, over the 8 remaining points nearest to it, of the
    /// distance from each to the nearest other remaining point. A percentile is the smallest value that this
    /// share of the points does not exceed.
    Measure(measure::Measure),
    /// Print a row of a Markdown table from the JSON files of one run
    Row(row::Row),
}

/// Resources of the library.
#[derive(Debug, Args)]
struct Limits {
    /// Memory budget of outcrop's part, e.g. 1GiB, without the points [default: half of what machine and
    /// cgroup allow]
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,
    /// Worker threads [default: all available]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Folder for scratch files [default: the system's]
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
}

impl Limits {
    fn workspace(&self) -> Result<Workspace> {
        let memory = self.memory.map_or_else(default_memory, |m| m.as_u64());
        let threads = self.threads.map_or_else(default_threads, usize::from);
        let scratch = self.scratch.clone().unwrap_or_else(std::env::temp_dir);
        let pool = MemoryPool::new(memory)?;
        let silent = Arc::new(Silent);
        Ok(Workspace::new(
            &scratch,
            pool,
            threads,
            silent,
            Cancel::new(),
        )?)
    }
}

fn run(args: &Arguments) -> Result<()> {
    let text = match &args.command {
        Command::Split(split) => split::run(split)?,
        Command::Measure(measure) => measure::run(measure)?,
        Command::Row(row) => row::run(row)?,
    };
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").map_err(|e| Error::io("standard output", "write", e))
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}
