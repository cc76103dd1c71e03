//! Out-of-core surface reconstruction by restricted Voronoi cells.

pub mod error;
pub mod geom;
pub mod inspect;
pub mod params;
pub mod spill;
pub mod stages;
pub mod workspace;

pub use error::{Error, Result};
