//! PLY files: the header, read and written, and whole meshes.
//!
//! [`Header::read`] is the only parser of PLY headers; the readers of outcrop and of its tools differ in the
//! processing of the elements after it. [`Layout`] is the only writer: a cloud or a triangle mesh with
//! entries of fixed size. [`Mesh::read`] holds a mesh, or a cloud, in memory; [`MeshStream`] passes a mesh on
//! in parts.

mod error;
mod header;
mod layout;
mod mesh;
mod numbers;
mod parse;
mod place;
mod stream;
mod system;
mod types;

pub use error::{Error, FileError, Result};
pub use header::{Element, Field, Header};
pub use layout::{Layout, TRIANGLE, put_triangle};
pub use mesh::Mesh;
pub use numbers::{Numbers, real};
pub use place::Place;
pub use stream::{FixedMesh, MeshStream, NO_VERTEX, Part, SLICE};
pub use system::System;
pub use types::{Encoding, Property, Scalar};
