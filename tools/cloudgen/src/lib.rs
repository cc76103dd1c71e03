//! Point clouds with known ground truth, for tests and measurements.
//!
//! A [`Cloud`] describes a cloud: the surface ([`Kind`]), the number of points, the seed, and the effects of
//! a real scanner (noise, outliers, duplicates, uneven density). Its [`Generator`] makes any point on demand,
//! and [`Cloud::write`] streams all of them to a file, in a few megabytes of memory for any number of points.
//!
//! This holds for uniform clouds. For other [`Sampling`], and for a [`Scene`], all points are chosen in advance
//! and held in memory.
//!
//! Every point is a pure function of the description and its index, and all transcendental
//! functions come from `libm`: the same description gives the same bytes everywhere.
//!
//! Surfaces other than the grid are centred on the origin before the offset; the grid and the
//! outdoor world start at the origin.
//!
//! [`Cloud::write_reference`] writes the true surface as a mesh, [`Cloud::write_seen`] the places that were
//! measured, without any error. [`Triangles`] and [`Spots`] find what is nearest to a place.
//!
//! [`Cloud::measure_mesh`] compares a mesh of the outdoor world with its ground.

mod check;
mod cloud;
mod error;
mod generator;
mod kind;
mod mesh_file;
mod odd;
mod outdoor;
mod picker;
mod ply_stream;
mod reference;
mod rng;
mod sampling;
mod scene;
mod spots;
mod surface;
mod triangles;
mod vec3;
mod write;

pub use cloud::{Cloud, NoiseMode, Order};
pub use error::{Error, Result};
pub use generator::Generator;
pub use kind::Kind;
pub use odd::Odd;
pub use outdoor::{Changes, GroundReport, HEAP_VOLUME, OUTDOOR_SIDE, Objects, PIT_VOLUME};
pub use sampling::{MOST_HELD, Sampling};
pub use scene::{MOST_IN_SCENE, Measuring, Scene};
pub use spots::{Spots, median};
pub use surface::Sample;
pub use triangles::{Found, Triangles};
pub use write::{Encoding, Format, LasOptions, PointFormat, Precision};
