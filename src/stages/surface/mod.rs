//! Surfaces as triangles around the vertices of a block: what stitching and repair share.

mod across;
mod border;
pub mod by_end;
pub mod columns;
mod contract;
pub mod evidence;
pub mod orient;
pub mod parity;
mod patches;
pub mod sides;
pub mod star;
mod weigh;
