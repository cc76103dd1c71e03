//! What a run has on disk and in memory: the scratch folder, the journal, budgets, units of work, and rows that
//! are packed, sorted and checked. Nothing here knows points or triangles.

pub mod error;
pub mod spill;
pub mod workspace;

pub use error::{Error, Result};
