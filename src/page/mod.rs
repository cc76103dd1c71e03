//! Pages for people: a report, or a description, as HTML in one file. A page has its pictures and its style inside,
//! needs no script, and fetches nothing.
//!
//! These functions only put into words and pictures what their arguments have.
//!
//! ```no_run
//! use outcrop::{Reconstruction, page};
//!
//! let run = Reconstruction::builder()
//!     .input("scan.laz")
//!     .output("mesh.ply")
//!     .pictures(true) // draw the mesh, and note memory and disk over time
//!     .build()?;
//! let report = run.run()?;
//! std::fs::write("mesh.html", page::report(&report, run.output())).unwrap();
//! # Ok::<(), outcrop::Error>(())
//! ```

mod advice;
mod change;
mod charts;
mod cloud;
mod comparison;
mod report;
mod sheet;
mod verdict;
mod words;

pub use change::change;
pub use cloud::cloud;
pub use comparison::comparison;
pub use report::report;
pub use verdict::verdict;
