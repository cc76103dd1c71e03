//! Pictures and histograms: of the mesh while it is in the scratch folder, and of a cloud.

#[cfg(feature = "pictures")]
pub mod cloud;
pub mod histogram;
#[cfg(feature = "pictures")]
pub mod mesh;
#[cfg(feature = "pictures")]
pub mod picture;
