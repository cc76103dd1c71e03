//! Out-of-core surface reconstruction by restricted Voronoi cells.
//!
//! A point cloud of any size goes in, a triangle mesh comes out that interpolates it, and the memory
//! stays below a budget. The method is that of Boltcheva & Lévy, *Surface reconstruction by
//! computing restricted Voronoi cells in parallel*, CAD 90 (2017). One cloud and one set of
//! [`Params`] give one file, byte for byte, whatever the memory, the threads and the order of inputs.
//!
//! ```
//! use outcrop::{Params, Reconstruction};
//!
//! # let folder = tempfile::tempdir()?;
//! # let (cloud, mesh) = (folder.path().join("grid.xyz"), folder.path().join("grid.ply"));
//! # let points = (0..400).map(|n| format!("{} {} 0\n", n % 20, n / 20));
//! # std::fs::write(&cloud, points.collect::<String>())?;
//! let report = Reconstruction::builder()
//!     .input(cloud) // LAS, LAZ, PLY or text, or a folder of them
//!     .output(mesh) // binary PLY
//!     .params(Params { neighbors: 20, ..Params::default() })
//!     .memory(256 << 20) // the ceiling, in bytes
//!     .build()?
//!     .run()?;
//! assert_eq!(report.mesh.vertices, 400);
//! assert_eq!(report.mesh.triangles, 2 * 19 * 19);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A run that was stopped or killed goes on from where it was, and gives the same file:
//!
//! ```no_run
//! use outcrop::{Error, Reconstruction, Start};
//! use std::time::Duration;
//!
//! let run = Reconstruction::builder()
//!     .input("scan.laz")
//!     .output("mesh.ply")
//!     .start(Start::Resume) // go on if there is something to go on with
//!     .time_limit(Duration::from_secs(3600))
//!     .build()?;
//! match run.run() {
//!     Err(Error::TimeLimit) => println!("to be continued: {}", run.scratch_folder().display()),
//!     other => println!("{} triangles", other?.mesh.triangles),
//! }
//! // Later: all but threads and memory is known.
//! Reconstruction::resume("mesh.ply.outcrop-scratch")?.build()?.run()?;
//! # Ok::<(), Error>(())
//! ```
//!
//! `examples/reconstruct.rs` shows progress ([`Observer`]) and a stop ([`Cancel`]).
//!
//! # Stages
//!
//! [`pipeline`] runs them in the order of the data. What one leaves for the next lies on disk.
//!
//! | stage | takes | gives | paper |
//! |---|---|---|---|
//! | [`stages::ingest`] | files | a spool of points in native precision, a lattice | |
//! | [`stages::thin`] | the spool | the points that stay of each cell of a grid (if asked for) | |
//! | [`stages::order`] | lattice positions | the ordered store: the rank on the curve is the id | |
//! | [`stages::outliers`] | the store | the store without outliers (if asked for) | |
//! | [`stages::smooth`] | the store | the store with points moved (if asked for); the shape, by which points are connected | 3.2 |
//! | [`stages::tiles`] | an id range | its points and those around it, neighbours (used by outliers, smooth and cells) | 3.1 |
//! | [`stages::cells`] | tiles | triples seen by each tile's cells | 3.3, 3.4 |
//! | [`stages::triples`] | triples by tile | triples with counts, by block | 3.4 |
//! | [`stages::stitch`] | triples by block | an orientable manifold | 3.5 |
//! | [`stages::repair`] | triangles by block | bridges and small components gone, holes filled, oriented | 3.6 |
//! | [`stages::export`] | triangles by block | the mesh file | |
//!
//! [`inspect`] answers questions about files without a reconstruction: what is in a cloud, is a
//! mesh a manifold, and how far are two shapes from each other. [`report::Report`] is what a run counts and measures. The semantics of the mesh
//! and the formats of scratch files are in `ARCHITECTURE.md`.

pub mod cli;
pub mod error;
pub mod geom;
pub mod inspect;
pub mod kernels;
mod method;
pub mod params;
pub mod pipeline;
pub mod report;
pub mod spill;
pub mod stages;
pub mod workspace;

pub use error::{Error, Result};
pub use params::{MaxWidth, Method, Params, Radius, Smoothing};
pub use pipeline::{Builder, DiskEstimate, Reconstruction, Start};
pub use report::Report;
pub use stages::ingest::Classes;
pub use stages::surface::evidence::Division;
pub use workspace::progress::{Cancel, Observer};
