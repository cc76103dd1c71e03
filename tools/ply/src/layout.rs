//! Writing clouds and triangle meshes with entries of fixed size.

use crate::types::{Encoding, Scalar};

/// A file with vertices x, y and z, possibly with more columns, and possibly triangles.
#[derive(Debug, Clone, Copy)]
pub struct Layout<'a> {
    /// Encoding of numbers.
    pub encoding: Encoding,
    /// Comments. Control characters in them, such as ends of lines, become spaces.
    pub comments: &'a [&'a str],
    /// Number of vertices.
    pub vertices: u64,
    /// Type of the coordinates.
    pub coordinates: Scalar,
    /// Names and types of the properties that vertices have after x, y and z.
    pub columns: &'a [(&'a str, Scalar)],
    /// Number of triangles and type of their corners, unless the file is a cloud.
    pub triangles: Option<(u64, Scalar)>,
}

/// Bytes of a triangle with 32-bit corners: their count, a byte, and the corners.
pub const TRIANGLE: usize = 13;

/// Appends a triangle with 32-bit corners, in little-endian order.
#[inline]
pub fn put_triangle([a, b, c]: [u32; 3], bytes: &mut Vec<u8>) {
    let mut face = [3u8; TRIANGLE];
    face[1..5].copy_from_slice(&a.to_le_bytes());
    face[5..9].copy_from_slice(&b.to_le_bytes());
    face[9..].copy_from_slice(&c.to_le_bytes());
    bytes.extend_from_slice(&face);
}

impl Layout<'_> {
    /// The header.
    #[must_use]
    pub fn header(&self) -> String {
        let scalar = self.coordinates.name();
        let comments = self.comments.iter().map(|comment| {
            let line = comment.replace(char::is_control, " ");
            format!("comment {line}\n")
        });
        let columns = self.columns.iter();
        let columns = columns.map(|(name, scalar)| format!("property {} {name}\n", scalar.name()));
        let faces = self.triangles.map(|(count, corner)| {
            let corner = corner.name();
            format!("element face {count}\nproperty list uchar {corner} vertex_indices\n")
        });
        format!(
            "ply\nformat {} 1.0\n{}element vertex {}\n\
             property {scalar} x\nproperty {scalar} y\nproperty {scalar} z\n{}{}end_header\n",
            self.encoding.name(),
            comments.collect::<String>(),
            self.vertices,
            columns.collect::<String>(),
            faces.unwrap_or_default(),
        )
    }
}
