//! The interface of mesh formats.

use outcrop_ply::Scalar;

/// Type of the coordinates in the file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CoordinateType {
    /// 32-bit floats.
    #[default]
    Float,
    /// 64-bit floats.
    Double,
}

/// The first comment of every mesh.
pub const MADE_BY: &str = concat!("made by outcrop ", env!("CARGO_PKG_VERSION"));

/// A mesh format; [`FORMATS`](super::FORMATS) lists all of them. Records have fixed sizes, so slices of the
/// file can be written in any order at known offsets.
pub trait MeshFormat: Sync {
    /// File name extensions.
    fn extensions(&self) -> &'static [&'static str];

    /// The layout of the file.
    fn layout(&self, mesh: &Mesh) -> Layout;

    /// Appends the records of vertices to `bytes`. `values` has for each vertex the little-endian bytes of all
    /// its columns.
    fn put_vertices(&self, mesh: &Mesh, positions: &[[f64; 3]], values: &[u8], bytes: &mut Vec<u8>);

    /// Appends the records of triangles to `bytes`.
    fn put_triangles(&self, mesh: &Mesh, triangles: &[[u32; 3]], bytes: &mut Vec<u8>);
}

/// Properties of a mesh that are known before it is written.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Type of the coordinates.
    pub coordinates: CoordinateType,
    /// Columns of the vertices beside their positions.
    pub columns: Vec<VertexColumn>,
    /// Comments for the header.
    pub comments: Vec<String>,
    /// The position of the cloud that is the origin of the mesh, if it is not that of the cloud.
    pub origin: Option<[f64; 3]>,
}

impl Mesh {
    /// Bytes of the values that a vertex has in all columns.
    pub fn value_bytes(&self) -> usize {
        let columns = self.columns.iter();
        columns.map(|column| column.scalar.bytes()).sum()
    }
}

/// A column of the vertices, such as `red`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VertexColumn {
    /// Its name, as in a PLY file.
    pub name: String,
    /// Type of its values.
    pub scalar: Scalar,
}

/// The offsets of all parts of a file.
#[derive(Debug)]
pub struct Layout {
    /// The bytes at its start.
    pub header: Vec<u8>,
    /// The vertices.
    pub vertices: Records,
    /// The triangles.
    pub triangles: Records,
    /// Bytes of the file.
    pub bytes: u64,
}

/// Consecutive records of one size.
#[derive(Debug, Clone, Copy)]
pub struct Records {
    /// Offset of the first record.
    pub at: u64,
    /// Bytes of one record.
    pub bytes: u64,
}

impl Records {
    /// Offset of record `number`.
    pub fn offset(&self, number: u64) -> u64 {
        self.at + number * self.bytes
    }
}
