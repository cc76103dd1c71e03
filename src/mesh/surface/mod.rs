//! Surfaces as triangles around the vertices of a block; used by stitching and repair.
//!
//! There are four structures for adjacency: [`star::ByVertex`] from a vertex to its triangles, [`star::Link`]
//! for the fans at one vertex, [`sides`] from a triangle to its neighbours, and `crossing_edges` from any
//! edge of the cloud.

mod contract;
mod crossing;
mod crossing_edges;
pub mod evidence;
mod history;
mod labels;
pub mod orient;
pub mod parity;
mod patches;
pub mod rows;
mod settle;
pub mod sides;
pub mod star;
mod weigh;
