//! Out-of-core surface reconstruction by restricted Voronoi cells.
//!
//! The input is a point cloud of any size, the output a triangle mesh that interpolates it; memory stays
//! below a budget. The method is that of Boltcheva & Lévy, *Surface reconstruction by computing restricted
//! Voronoi cells in parallel*, CAD 90 (2017). One cloud and one set of [`Params`] give the same file, byte
//! for byte, for any memory budget, number of threads and order of inputs.
//!
//! ```
//! use outcrop::{Params, Reconstruction};
//!
//! # let folder = tempfile::tempdir()?;
//! # let (cloud, mesh) = (folder.path().join("grid.xyz"), folder.path().join("grid.ply"));
//! # let points = (0..400).map(|n| format!("{} {} 0\n", n % 20, n / 20));
//! # std::fs::write(&cloud, points.collect::<String>())?;
//! let report = Reconstruction::builder()
//!     .input(cloud) // LAS, LAZ, EPT, E57, PLY, PCD, PTX, OFF or text, or a folder
//!     .output(mesh) // PLY, OBJ, STL or GLB; or DIR/tileset.json
//!     .params(Params { neighbors: 20, ..Params::default() })
//!     .memory(256 << 20) // the ceiling, in bytes
//!     .build()?
//!     .run()?;
//! assert_eq!(report.mesh.vertices, 400);
//! assert_eq!(report.mesh.triangles, 2 * 19 * 19);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A run that was stopped or killed continues with its last unfinished work, and gives the same file:
//!
//! ```no_run
//! use outcrop::{Error, Reconstruction, Start};
//! use std::time::Duration;
//!
//! let run = Reconstruction::builder()
//!     .input("scan.laz")
//!     .output("mesh.ply")
//!     .start(Start::Resume) // continue the unfinished run, if there is one
//!     .time_limit(Duration::from_secs(3600))
//!     .build()?;
//! match run.run() {
//!     Err(Error::TimeLimit) => println!("to be continued: {}", run.scratch_folder().display()),
//!     other => println!("{} triangles", other?.mesh.triangles),
//! }
//! // Later; inputs, output and parameters are in the scratch folder.
//! Reconstruction::resume("mesh.ply.outcrop-scratch")?.build()?.run()?;
//! # Ok::<(), Error>(())
//! ```
//!
//! `examples/reconstruct.rs` shows progress ([`Observer`]) and cancellation ([`Cancel`]).
//!
//! [`convert`] writes a finished mesh in another format.
//!
//! [`Closing`] closes the boundary of a mesh of any size, [`Simplification`] makes one mesh with fewer triangles of it, and [`Tiles`] levels of detail for
//! viewers of 3D Tiles. [`ChangeDetection`] measures what changed between two surfaces, and [`Rasterization`] makes
//! rasters of heights.
//!
//! [`inspect`] describes a cloud, checks that a mesh is a manifold, and measures volumes, heights, and the distance between two
//! shapes. [`Report`] has the counts and measurements of a run. [`page`] puts all of these into pages with
//! pictures.
//!
//! [`call`] runs the commands of the program inside another one.
//!
//! `levels`, `page`, `view`, `Closing`, `Simplification`, `Tiles` and the pictures need the features `levels`, `pages` and `view`, which are on by
//! default, like `e57` and `demo`.
//!
//! These items are the interface. The crates of which the program consists (`outcrop-geom`, `outcrop-disk`,
//! `outcrop-points`, `outcrop-stages` and others) change without notice; `ARCHITECTURE.md` has their map.

#[doc(hidden)]
pub mod cli;
pub mod convert;
mod deliver;
#[cfg(feature = "faults")]
mod faults;
mod features;
#[doc(hidden)]
pub mod info;
#[cfg(feature = "pages")]
pub mod page;
pub mod params;
mod pipeline;
pub mod report;
mod write;

pub use outcrop_disk::error;
#[cfg(feature = "levels")]
pub use outcrop_levels as levels;
#[cfg(feature = "view")]
pub use outcrop_view as view;

/// Inspection of clouds and meshes without a reconstruction.
pub mod inspect {
    pub use crate::info;
    pub use crate::pipeline::compare;
    pub use outcrop_inspect::{change, verify};
    pub use outcrop_survey::{raster, volume};
}

#[doc(inline)]
pub use cli::call;
pub use deliver::Uploaded;
pub use error::{Error, Result};
pub use outcrop_disk::workspace::Workspace;
pub use outcrop_disk::workspace::memory::MemoryPool;
pub use outcrop_disk::workspace::outlook::{Outlook, Planned, Position};
pub use outcrop_disk::workspace::progress::{Cancel, Observer, Silent};
pub use outcrop_formats::hide_caught_panics;
pub use outcrop_points::Classes;
pub use params::{
    Division, Facing, InputNormals, MaxWidth, Method, Origin, Params, Radius, Region, Smooth,
    Smoothing,
};
pub use pipeline::{
    Builder, ChangeDetection, Rasterization, Reconstruction, Start, default_memory, default_threads,
};
#[cfg(feature = "levels")]
pub use pipeline::{Closing, Simplification, Tiles};
#[cfg(feature = "levels")]
pub use report::{CloseReport, SimplifyReport};
pub use report::{DiskEstimate, Report};
