//! Inspection of clouds and meshes without a reconstruction.

pub mod compare;
pub mod info;
mod pictures;
pub mod ply_mesh;
pub mod verify;
