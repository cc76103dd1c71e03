//! PLY files: the header, read and written, and whole meshes.
//!
//! [`Header::read`] is the only parser of PLY headers; the readers of outcrop and of its tools differ in the
//! processing of the elements after it. [`Layout`] is the only writer: a cloud or a triangle mesh with
//! entries of fixed size. [`Mesh::read`] holds a mesh, or a cloud, in memory.

mod error;
mod header;
mod layout;
mod mesh;
mod numbers;
mod parse;
mod types;

pub use error::{Error, Result};
pub use header::{Element, Header, bytes_of};
pub use layout::{Layout, TRIANGLE, put_triangle};
pub use mesh::Mesh;
pub use numbers::{integer, real};
pub use types::{Encoding, Property, Scalar};
