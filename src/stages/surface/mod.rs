//! Surfaces as triangles around the vertices of a block: what stitching and repair share.

mod border;
pub mod by_end;
pub mod evidence;
pub mod orient;
pub mod parity;
pub mod sides;
pub mod star;
mod weigh;
