//! Codecs of mesh files, which know nothing of the method: compressed buffers, packed positions, and PLY in
//! slices.

pub mod glb;
pub mod light;
pub mod meshopt;
pub mod ply_mesh;
