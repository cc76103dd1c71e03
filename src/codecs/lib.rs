//! Codecs of mesh files, which know nothing of the method: compressed buffers, packed positions, PLY in slices, and
//! readers of other formats.

mod failure;
mod foreign;
pub mod glb;
pub mod light;
pub mod meshopt;
pub mod ply_mesh;
