//! Command-line arguments.

mod job;
mod survey;

use super::parse::{count, samples, size, system, time};
use crate::params::Close as Closed;
use crate::pipeline::Start;
use clap::{ArgAction, Args as ClapArgs};
pub use job::{Job, Points};
use outcrop_disk::workspace::mapped::Io;
use outcrop_disk::workspace::{Compression, Storage};
use outcrop_points::GivenCrs;
use std::path::PathBuf;
use std::time::Duration;
pub use survey::{Change, Raster, Volume};

/// Resources of a run.
#[derive(Debug, ClapArgs)]
pub struct Limits {
    /// Memory budget, e.g. 512MiB or 4GiB [default: half of what machine and cgroup allow, or 192MiB]
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub memory: Option<u64>,
    /// Worker threads [default: all available]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Folder for scratch files, which are removed at the end [default: beside the output]
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,
    #[command(flatten)]
    pub storing: Storing,
    #[command(flatten)]
    pub quiet: Quiet,
}

/// How much is said.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub struct Quiet {
    /// Show no progress and no summary, even on a terminal; warnings stay. Twice (-qq): no warnings either
    #[arg(long = "quiet", short = 'q', action = ArgAction::Count)]
    times: u8,
}

impl Quiet {
    /// True if progress and summary are shown.
    pub fn tells(self) -> bool {
        self.times == 0
    }

    /// True if warnings are shown.
    pub fn warns(self) -> bool {
        self.times < 2
    }
}

/// How scratch files are read and written.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub struct Storing {
    /// Reading of points in scratch files: map (mapped into memory if the budget has room), read (into
    /// buffers), or auto (mapped on local disks if they take at most a quarter of the budget)
    #[arg(long, value_name = "auto|map|read", default_value = "auto")]
    pub io: Io,
    /// Compression of scratch files with Zstandard: none, a level from 1 to 3, or auto (level 1 if many
    /// gigabytes go to a slow disk or to a network)
    #[arg(long, value_name = "auto|none|LEVEL", default_value = "auto")]
    pub scratch_compression: Compression,
}

impl Storing {
    pub fn storage(self) -> Storage {
        Storage {
            io: self.io,
            compression: self.scratch_compression,
        }
    }
}

/// `outcrop reconstruct`
#[derive(Debug, ClapArgs)]
pub struct Reconstruct {
    #[command(flatten)]
    pub job: Job,
    #[command(flatten, next_help_heading = "Limits")]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
    #[command(flatten)]
    pub ends: Ends,
}

/// Treatment of an unfinished run.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Resume")]
pub struct Again {
    /// Resume the unfinished run of this output, if there is one
    #[arg(long, conflicts_with = "restart")]
    pub resume: bool,
    /// Discard an unfinished run of this output and begin again
    #[arg(long)]
    pub restart: bool,
}

impl Again {
    /// The corresponding value of the library.
    pub fn start(&self) -> Start {
        match (self.resume, self.restart) {
            (true, _) => Start::Resume,
            (_, true) => Start::Restart,
            _ => Start::New,
        }
    }
}

/// Time limit and report of a run.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Limits")]
pub struct Ends {
    /// Stop before this time is over, e.g. 7h30m; the run can be resumed later
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub time_limit: Option<Duration>,
    /// Write a report: as a page with pictures and charts if its name ends in .html, else as JSON; may be given
    /// several times
    #[arg(long, value_name = "FILE.html|FILE.json")]
    pub report: Vec<PathBuf>,
}

/// `outcrop resume`
#[derive(Debug, ClapArgs)]
pub struct Resume {
    /// The scratch folder of the run: MESH.ply.outcrop-scratch beside the mesh, or in --scratch
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
    /// Another name for the mesh, and so another format: for a mesh that is too large for GLB or STL
    #[arg(long, short, value_name = "MESH")]
    pub output: Option<PathBuf>,
    /// Memory budget; may differ from the earlier one
    #[arg(long, value_name = "SIZE", value_parser = size)]
    pub memory: Option<u64>,
    /// Worker threads; may differ from the earlier number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    #[command(flatten)]
    pub storing: Storing,
    #[command(flatten)]
    pub ends: Ends,
    #[command(flatten)]
    pub quiet: Quiet,
}

/// `outcrop info`
#[derive(Debug, ClapArgs)]
pub struct Info {
    /// Files, folders of files, or URLs
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write a page with pictures
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// Only what the headers say, without reading points: the default if an input is a URL
    #[arg(long, conflicts_with_all = ["html", "all_points"])]
    pub headers: bool,
    /// Read all points, also of inputs behind URLs
    #[arg(long)]
    pub all_points: bool,
    #[command(flatten)]
    pub points: Points,
    /// Reference system of the cloud, as for reconstruct
    #[arg(long, value_name = "EPSG:N|EPSG:N+M|FILE", value_parser = system)]
    pub crs: Option<GivenCrs>,
    #[command(flatten, next_help_heading = "Limits")]
    pub limits: Limits,
}

/// `outcrop verify`
#[derive(Debug, ClapArgs)]
pub struct Verify {
    /// The mesh (PLY, OBJ, STL or GLB)
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write a page with pictures
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// Accept vertices without a triangle
    #[arg(long)]
    pub allow_unreferenced: bool,
    #[command(flatten)]
    pub limits: Limits,
}

/// `outcrop tiles`
#[derive(Debug, ClapArgs)]
pub struct Tiles {
    /// The mesh (PLY, OBJ, STL or GLB, also as .zst)
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// The folder to write, or the URL of one in a store: tileset.json and tiles
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,
    /// Place the tiles on the globe, by the reference system in the header of the mesh, or else in MESH.prj
    #[arg(long)]
    pub geo: bool,
    /// Reference system of the mesh, if it names none or a wrong one, as for reconstruct
    #[arg(long, value_name = "EPSG:N|EPSG:N+M|FILE", value_parser = system)]
    pub crs: Option<GivenCrs>,
    /// Round positions, normals, colours and other values: tiles take about half of the bytes, and tell the error
    #[arg(long)]
    pub lossy: bool,
    /// Most triangles of a leaf
    #[arg(long, hide = true, default_value = "65536", value_parser = clap::value_parser!(u32).range(1..))]
    pub most_triangles: u32,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

/// `outcrop simplify`
#[derive(Debug, ClapArgs)]
pub struct Simplify {
    /// The mesh (PLY, OBJ, STL or GLB, also as .zst)
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// The mesh to write: .ply, .obj, .stl or .glb; also the URL of one in a store
    #[arg(long, short, value_name = "OUT")]
    pub output: PathBuf,
    #[command(flatten)]
    pub goal: SimplifyGoal,
    /// Leave the boundary as it is
    #[arg(long)]
    pub keep_boundary: bool,
    /// Close the boundary of what is left, as `outcrop close` does [without a value: auto]
    #[arg(long, value_name = "auto|lids|smooth|base[=Z]", num_args = 0..=1, default_missing_value = "auto")]
    pub close: Option<Closed>,
    /// Samples of each mesh by which the distance between both is measured, and most triangles by which
    /// self-intersections are counted, e.g. 1e6; 0: neither is done
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = samples)]
    pub samples: u64,
    /// Most triangles of a cell
    #[arg(long, hide = true, default_value = "131072", value_parser = clap::value_parser!(u32).range(1..))]
    pub most_triangles: u32,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

/// `outcrop close`
#[derive(Debug, ClapArgs)]
pub struct Close {
    /// The mesh (PLY, OBJ, STL or GLB, also as .zst)
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// The mesh to write: .ply, .obj, .stl or .glb; also the URL of one in a store
    #[arg(long, short, value_name = "OUT")]
    pub output: PathBuf,
    /// How: auto (smooth where the surface runs on into the hole, else a lid), lids, smooth, or base (walls from outer
    /// rims down to a floor)
    #[arg(long, value_name = "auto|lids|smooth|base[=Z]", default_value = "auto")]
    pub kind: Closed,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

/// How far `outcrop simplify` goes.
#[derive(Debug, ClapArgs)]
#[group(required = true, multiple = false)]
pub struct SimplifyGoal {
    /// To this number of triangles, e.g. 2e6
    #[arg(long, value_name = "N", value_parser = count)]
    pub triangles: Option<u64>,
    /// To this part of the triangles, e.g. 0.1
    #[arg(long, value_name = "R")]
    pub ratio: Option<f64>,
    /// As long as vertices stay within this mean distance of the triangles that they stand for
    #[arg(long, value_name = "LENGTH")]
    pub error: Option<f64>,
}

/// `outcrop compare`
#[derive(Debug, ClapArgs)]
pub struct Compare {
    /// A mesh (PLY with faces, OBJ, STL or GLB) or a cloud (LAS, LAZ, EPT, E57, PLY, PCD, PTX, OFF, XYZ text, or a
    /// folder of them)
    #[arg(value_name = "A")]
    pub a: PathBuf,
    /// The mesh or cloud to compare it with
    #[arg(value_name = "B")]
    pub b: PathBuf,
    /// Largest number of samples of each side, e.g. 1e6
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = count)]
    pub samples: u64,
    /// Seed of the random samples
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    pub seed: u64,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write a page with pictures
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    #[command(flatten)]
    pub limits: Limits,
}

/// `outcrop view`
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "The page is served to browsers on this machine only, until Ctrl-C. Nothing is fetched from elsewhere."
)]
pub struct View {
    /// A folder that `outcrop tiles` made, or a mesh (PLY, OBJ, STL or GLB), of which levels of detail are made first
    #[arg(value_name = "DIR|MESH")]
    pub mesh: PathBuf,
    /// Another one, shown in the same place: on the other side of a line that can be moved
    #[arg(value_name = "OTHER")]
    pub other: Option<PathBuf>,
    /// Show points of a cloud as well (a file or folder, as of `reconstruct`), spread evenly if there are too many
    #[arg(long, value_name = "CLOUD")]
    pub points: Option<PathBuf>,
    /// Most points that are shown, e.g. 5e6
    #[arg(long, value_name = "N", default_value = "2000000", requires = "points", value_parser = count)]
    pub points_limit: u64,
    /// Port of the server [default: a free one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Only print the address, open no browser
    #[arg(long)]
    pub no_browser: bool,
    /// Write one page that shows the coarser levels without a server, for sending, instead of serving
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "no_browser", "other", "points"])]
    pub html: Option<PathBuf>,
    /// Largest size of that page
    #[arg(long, value_name = "SIZE", default_value = "20MB", requires = "html", value_parser = size)]
    pub html_limit: u64,
    /// Keep the levels of detail of a mesh for the next time [without a folder: MESH-tiles beside the mesh]
    #[arg(long, value_name = "DIR", num_args = 0..=1, require_equals = true)]
    pub keep: Option<Option<PathBuf>>,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

/// `outcrop demo`
#[derive(Debug, ClapArgs)]
pub struct Demo {
    /// Folder for the cloud, the mesh and the report
    #[arg(value_name = "DIR", default_value = "demo")]
    pub folder: PathBuf,
    /// Number of points, e.g. 200000 or 1e6
    #[arg(long, value_name = "N", default_value = "200000", value_parser = count)]
    pub points: u64,
    #[command(flatten)]
    pub limits: Limits,
}
