//! The scratch folder of a run and its journal, the memory budget in bytes, units of work on all threads, and
//! packed, sorted and checksummed rows on disk. Nothing here knows points or triangles.

pub mod error;
pub mod spill;
pub mod workspace;

pub use error::{Error, Result};
