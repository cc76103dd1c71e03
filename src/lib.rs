//! Out-of-core surface reconstruction by restricted Voronoi cells.

pub mod cli;
pub mod error;
pub mod geom;
pub mod inspect;
pub mod params;
pub mod pipeline;
pub mod report;
pub mod spill;
pub mod stages;
pub mod workspace;

pub use error::{Error, Result};
pub use params::{Params, Radius};
pub use pipeline::{Builder, Reconstruction};
pub use report::Report;
pub use workspace::progress::{Cancel, Observer};
