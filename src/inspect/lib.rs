//! Checks of meshes, and distances between shapes, without a reconstruction.

pub mod compare;
pub mod verify;
