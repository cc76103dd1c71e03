//! The stages from points to the triples of their cells, one folder each, in the order of the data flow. Those from
//! triples to the mesh follow in `outcrop-mesh`.

pub mod ids;

pub mod cloud;
pub mod order;

pub mod tiles;

pub mod thin;

pub mod outliers;

pub mod attributes;
pub mod normals;

pub mod smooth;
pub mod spacing;

pub mod cells;

pub mod blocks;
pub mod columns;
pub mod levels;
pub mod located;
pub mod outside;
pub mod scanners;
