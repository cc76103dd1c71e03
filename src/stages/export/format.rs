//! How a format of meshes is written.

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

/// A format of meshes; [`FORMATS`](super::FORMATS) lists all of them. Records have fixed sizes, so slices
/// of the file are written in any order at known places.
pub trait MeshFormat: Sync {
    /// Extensions of its files.
    fn extensions(&self) -> &'static [&'static str];

    /// Where everything goes.
    fn layout(&self, mesh: &Mesh) -> Layout;

    /// Appends the records of some vertices.
    fn put_vertices(&self, mesh: &Mesh, positions: &[[f64; 3]], bytes: &mut Vec<u8>);

    /// Appends the records of some triangles.
    fn put_triangles(&self, mesh: &Mesh, triangles: &[[u32; 3]], bytes: &mut Vec<u8>);
}

/// What is known of a mesh before it is written.
#[derive(Debug, Clone, Copy)]
pub struct Mesh {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Type of the coordinates.
    pub coordinates: CoordinateType,
}

/// Where everything is in a file.
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

/// Records of one size, one behind the other.
#[derive(Debug, Clone, Copy)]
pub struct Records {
    /// Where the first one is.
    pub at: u64,
    /// Bytes of each.
    pub bytes: u64,
}
