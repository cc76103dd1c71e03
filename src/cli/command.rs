//! The commands and their help.

use super::args::{
    Change, Close, Compare, Demo, Info, Raster, Reconstruct, Resume, Simplify, Tiles, Verify, View,
    Volume,
};
use super::shared::{Advance, Plan, Status, Submit, Work};
use crate::features;
use clap::{Parser, Subcommand};
use clap_complete::Shell;
use outcrop_paper::method::method_version;
use std::path::PathBuf;

/// Turns point clouds of any size into clean triangle meshes within a memory budget.
#[derive(Debug, Parser)]
#[command(version, long_version = version(), about, long_about = LONG_ABOUT, max_term_width = 100, after_help = after_help())]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

/// The versions of the program and of its method, the commit, and the features.
fn version() -> String {
    format!(
        "{} (method {}, commit {}, {})",
        env!("CARGO_PKG_VERSION"),
        method_version!(),
        env!("OUTCROP_COMMIT"),
        features::built(),
    )
}

const LONG_ABOUT: &str = "Turns point clouds of any size into clean triangle meshes, inside the \
memory you give it.

Points are kept where they are consistent, and smoothed where they are noisy (not with --smooth 0). Every edge has at most two \
triangles, every vertex is a disk or a half-disk, and triangles run consistently. The same cloud \
and parameters give the same file, byte for byte, whatever memory, threads and order of inputs.";

/// Commands as they are typed, one a line.
pub const EXAMPLES: &str = "  outcrop reconstruct scan.laz -o mesh.ply
  outcrop reconstruct tiles/ -o town.ply --memory 4GiB --report town.html
  outcrop reconstruct scan.las -o measured.ply --smooth 0
  outcrop reconstruct scan.laz -o mesh.ply --resume --time-limit 7h30m
  outcrop resume mesh.ply.outcrop-scratch
  outcrop info scan.laz
  outcrop verify mesh.ply && echo manifold
  outcrop compare mesh.ply scan.laz --html distances.html
  outcrop change may.ply june.ply -o map.ply --registration 0.02
  outcrop volume pit.ply --above 412.5 --crop claim.geojson
  outcrop raster mesh.ply -o dem.tif --cell 0.5 --contours 1
  outcrop simplify mesh.ply -o small.ply --triangles 2e6
  outcrop close mesh.ply -o print.stl
  outcrop tiles mesh.ply -o town
  outcrop view mesh.ply
  outcrop demo
  outcrop plan tiles/ -o town.ply --shards 200 --task-memory 4GiB --task-threads 8
  outcrop submit town.ply.outcrop-scratch --engine slurm -- --partition=long";

/// Meaning of the exit codes.
pub const EXIT_CODES: &str = "\
0 fine, 1 the answer is no (verify), 2 error. A run that was stopped can be resumed: 75 its \
time limit was reached (of work, advance: try again later), 130 Ctrl-C, 143 SIGTERM, 129 SIGHUP.";

fn after_help() -> String {
    format!("Examples:\n{EXAMPLES}\n\nExit codes: {EXIT_CODES}")
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make a mesh from points
    Reconstruct(Box<Reconstruct>),
    /// Continue a run that was stopped, killed, or ran out of disk
    Resume(Resume),
    /// Describe a cloud and estimate what a run needs
    Info(Info),
    /// Check that a mesh is a manifold (exit code 0 if it is, 1 if not)
    Verify(Verify),
    /// Make a mesh with fewer triangles
    Simplify(Simplify),
    /// Close the boundary of a mesh: smoothly, by lids, or by a base
    Close(Close),
    /// Cut a mesh into levels of detail for 3D Tiles viewers
    Tiles(Tiles),
    /// Measure the distance between two meshes or clouds
    Compare(Compare),
    /// Measure what changed from one surface to another, and whether more than noise
    Change(Change),
    /// Measure volumes: what a mesh encloses, or what lies above and below a level or another mesh
    Volume(Volume),
    /// Make a raster of heights, with contours and colours if you like
    Raster(Raster),
    /// Show a mesh of any size in the browser
    View(View),
    /// Generate a cloud, reconstruct it and verify the mesh
    Demo(Demo),
    /// Plan a run for many tasks, on a cluster or on this machine; makes its folder
    Plan(Box<Plan>),
    /// Do the units of one shard of a planned run
    Work(Work),
    /// Do what lies between two generations of tasks of a planned run
    Advance(Advance),
    /// Tell how far a planned run is, and which command goes on
    Status(Status),
    /// Run the tasks of a planned run, by Slurm or as processes on this machine
    Submit(Submit),
    /// Print a script that completes commands and options in a shell
    Completions {
        /// The shell
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },
    /// Write manual pages
    Man {
        /// Folder for the pages: outcrop.1, and outcrop-COMMAND.1 for each command
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_well_formed() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }
}
