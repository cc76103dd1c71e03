//! The interface of mesh formats.

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

/// A mesh format; [`FORMATS`](super::FORMATS) lists all of them. Records have fixed sizes, so slices of the
/// file can be written in any order at known offsets.
pub trait MeshFormat: Sync {
    /// File name extensions.
    fn extensions(&self) -> &'static [&'static str];

    /// The layout of the file.
    fn layout(&self, mesh: &Mesh) -> Layout;

    /// Appends the records of vertices to `bytes`.
    fn put_vertices(&self, mesh: &Mesh, positions: &[[f64; 3]], bytes: &mut Vec<u8>);

    /// Appends the records of triangles to `bytes`.
    fn put_triangles(&self, mesh: &Mesh, triangles: &[[u32; 3]], bytes: &mut Vec<u8>);
}

/// Properties of a mesh that are known before it is written.
#[derive(Debug, Clone, Copy)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Type of the coordinates.
    pub coordinates: CoordinateType,
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
