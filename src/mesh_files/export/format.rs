//! The interface of mesh formats.

use outcrop_paper::method::method_version;
use outcrop_ply::Scalar;
use outcrop_points::Column;

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

/// The program, as every mesh names it.
pub const MADE_BY: &str = concat!(
    "made by outcrop ",
    env!("CARGO_PKG_VERSION"),
    ", method ",
    method_version!()
);

/// The positions of the corners of a triangle.
pub type Positions = [[f64; 3]; 3];

/// A mesh format; `FORMATS` lists all of them. Records have fixed sizes, so slices of the
/// file can be written in any order at known offsets.
pub trait MeshFormat: Sync {
    /// Its name, for messages.
    fn name(&self) -> &'static str;

    /// File name extensions, in lower case.
    fn extensions(&self) -> &'static [&'static str];

    /// True if [`MeshFormat::put_triangles`] takes the positions of corners.
    fn wants_positions(&self) -> bool {
        false
    }

    /// True if [`MeshFormat::layout`] takes the bounds of the vertices.
    fn wants_bounds(&self) -> bool {
        false
    }

    /// True if the file can have coordinates in double precision.
    fn holds_doubles(&self) -> bool;

    /// True if the format has compression of its own.
    fn has_compression(&self) -> bool {
        false
    }

    /// True if the file can tell which triangles close the mesh.
    fn holds_filled(&self) -> bool {
        false
    }

    /// True if vertices have this column in the file; others are left out.
    fn holds(&self, mesh: &Mesh, column: &VertexColumn) -> bool;

    /// The limit of the format that a mesh exceeds.
    fn exceeded(&self, _: &Mesh) -> Option<Exceeded> {
        None
    }

    /// The layout of the file.
    fn layout(&self, mesh: &Mesh) -> Layout;

    /// Appends the records of vertices to `bytes`. `values` has for each vertex the little-endian bytes of all
    /// its columns.
    fn put_vertices(&self, mesh: &Mesh, positions: &[[f64; 3]], values: &[u8], bytes: &mut Vec<u8>);

    /// Appends the records of triangles to `bytes`; `positions` is empty unless the format wants positions.
    fn put_triangles(
        &self,
        mesh: &Mesh,
        triangles: &[[u32; 3]],
        positions: &[Positions],
        bytes: &mut Vec<u8>,
    );
}

/// A limit of a format, and a mesh that exceeds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exceeded {
    /// The unit: `bytes` or `triangles`.
    pub unit: &'static str,
    /// How many the mesh has.
    pub found: u64,
    /// Largest number in a file.
    pub most: u64,
}

/// Properties of a mesh that are known before it is written.
#[derive(Debug, Clone, Default)]
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
    /// Lowest and highest coordinates of the vertices, if the format wants them.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Decimals with which coordinates are written as text: exact for files with decimal coordinates, else to
    /// a hundredth of a step of the lattice.
    pub decimals: usize,
    /// GLB with meshopt compression.
    pub compress: bool,
    /// Whether the triangles that are put next close the mesh; none if the file does not tell it of its triangles.
    pub filled: Option<bool>,
}

impl Mesh {
    /// Bytes of the values that a vertex has in all columns.
    pub fn value_bytes(&self) -> usize {
        let columns = self.columns.iter();
        columns.map(|column| column.scalar.bytes()).sum()
    }

    /// Place of the columns with these names, if all are there with one type.
    pub fn columns_of(&self, names: [&str; 3]) -> Option<([usize; 3], Scalar)> {
        let place = |name: &str| {
            let at = self.columns.iter().position(|c| c.name == name)?;
            let before = self.columns[..at].iter().map(|c| c.scalar.bytes()).sum();
            Some((before, self.columns[at].scalar))
        };
        let [a, b, c] = names.map(place);
        let ((a, scalar), (b, second), (c, third)) = (a?, b?, c?);
        (scalar == second && scalar == third).then_some(([a, b, c], scalar))
    }

    /// Place of the colours, bytes or 16-bit numbers.
    pub fn colours(&self) -> Option<([usize; 3], Scalar)> {
        self.columns_of(COLOURS)
            .filter(|(_, scalar)| matches!(scalar, Scalar::U8 | Scalar::U16))
    }

    /// Place of the normals, 32-bit floats.
    pub fn normals(&self) -> Option<[usize; 3]> {
        let found = self.columns_of(NORMALS);
        found
            .filter(|(_, scalar)| *scalar == Scalar::F32)
            .map(|(places, _)| places)
    }

    /// True if `column` is one of the colours or normals.
    pub fn is_colour_or_normal(&self, column: &VertexColumn) -> bool {
        let is = |names: [&str; 3]| names.contains(&&*column.name);
        is(COLOURS) && self.colours().is_some() || is(NORMALS) && self.normals().is_some()
    }
}

/// Names of the columns with colours.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// Names of the columns with normals.
const NORMALS: [&str; 3] = ["nx", "ny", "nz"];

/// The columns of normals.
pub fn normal_columns() -> impl Iterator<Item = VertexColumn> {
    NORMALS.into_iter().map(|name| VertexColumn {
        name: name.to_owned(),
        scalar: Scalar::F32,
    })
}

impl From<&Column> for VertexColumn {
    fn from(column: &Column) -> Self {
        Self {
            name: column.name.clone(),
            scalar: column.scalar,
        }
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

/// Four bytes of the values of a vertex.
pub fn four(values: &[u8], at: usize) -> [u8; 4] {
    std::array::from_fn(|n| values[at + n])
}

/// Two bytes of the values of a vertex.
pub fn two(values: &[u8], at: usize) -> [u8; 2] {
    [values[at], values[at + 1]]
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

impl Layout {
    /// The layout of a file with records of these sizes after its header.
    pub fn of(header: Vec<u8>, mesh: &Mesh, vertex: u64, triangle: u64) -> Self {
        let vertices = Records {
            at: header.len() as u64,
            bytes: vertex,
        };
        let triangles = Records {
            at: vertices.offset(mesh.vertices),
            bytes: triangle,
        };
        Self {
            header,
            vertices,
            triangles,
            bytes: triangles.offset(mesh.triangles),
        }
    }
}

/// Consecutive records of one size.
#[derive(Debug, Clone, Copy)]
pub struct Records {
    /// Offset of the first record.
    pub at: u64,
    /// Bytes of one record; none if the format has no such records.
    pub bytes: u64,
}

impl Records {
    /// Offset of record `number`.
    pub fn offset(&self, number: u64) -> u64 {
        self.at + number * self.bytes
    }
}
