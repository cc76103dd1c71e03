//! Checks of meshes, and distances between shapes, without a reconstruction.

pub mod change;
pub mod compare;
pub mod verify;
