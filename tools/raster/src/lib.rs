//! Pictures of meshes and clouds, drawn in software: a camera, a depth buffer that all threads draw into, and PNG
//! files.
//!
//! A pixel keeps the nearest of all that was drawn there; of equally near things the one with the greatest value.
//! So the picture does not depend on the order in which things are drawn.

pub mod camera;
pub mod light;
pub mod picture;
mod raster;
pub mod vec3;

pub use camera::{Camera, Framing, View};
pub use raster::{Mark, Raster};
pub use vec3::Vec3;
