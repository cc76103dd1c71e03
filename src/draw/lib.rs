//! Pictures and histograms: of the mesh while it is in the scratch folder, and of a cloud.

pub mod cloud;
pub mod histogram;
pub mod mesh;
pub mod picture;
