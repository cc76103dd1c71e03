//! Pictures and histograms of a run, in bounded memory: of a cloud in its order, and of the finished surface while it
//! is in the scratch folder.

pub mod cloud;
pub mod mesh;
