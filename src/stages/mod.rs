//! The stages of a reconstruction, one folder each, in the order the data flows.

pub mod ingest;
