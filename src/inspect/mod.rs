//! Questions a user asks of a cloud or a mesh.

pub mod compare;
pub mod info;
pub mod ply_mesh;
pub mod verify;
