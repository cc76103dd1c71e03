//! Surfaces as triangles around the vertices of a block: what stitching and repair share.
//!
//! Adjacency has four shapes, by where one starts from: [`star::ByVertex`] from a vertex,
//! [`star::Link`] for the fans at one vertex, [`sides`] from one triangle to the next, and
//! `crossing_edges` from an edge anywhere in the cloud.

pub mod columns;
mod contract;
mod crossing;
mod crossing_edges;
pub mod evidence;
mod labels;
pub mod orient;
pub mod parity;
mod patches;
pub mod rows;
mod settle;
pub mod sides;
pub mod star;
mod weigh;
