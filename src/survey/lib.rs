//! Measurements of surfaces of any size, in bounded memory: [`volume`]s, and heights as a [`raster`].
//!
//! Both read the triangles of a mesh piece by piece, on all threads (`pieces`), and know its units (`units`).

mod pieces;
pub mod raster;
mod units;
pub mod volume;
