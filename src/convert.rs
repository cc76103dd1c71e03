//! Meshes in another format than PLY, from the PLY file of a finished mesh.

use crate::write::{Bounds, write};
use outcrop_codecs::ply_mesh::{PlyMesh, SLICE};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_mesh_files::export::{self, CoordinateType, Mesh, VertexColumn};
use outcrop_ply::{Place, Scalar};
use std::path::Path;

/// Bytes of memory: slices of the mesh as they are read and as they are written.
const MEMORY: u64 = (SLICE as u64) * 512 + (4 << 20);

/// Properties of vertices that GLB holds.
const HELD: [&str; 6] = ["nx", "ny", "nz", "red", "green", "blue"];

/// Writes a mesh (PLY) as binary glTF: positions, and colours and normals if it has them, in one pass over the file
/// after one for the bounds. `comments` are for the properties of the asset. The file gets its name when it is whole.
///
/// # Errors
/// [`Error::Parameter`] if the name is not that of a GLB, or that of the mesh; [`Error::Input`] for a mesh with other
/// faces than triangles, or corners that are no vertices; [`Error::TooLarge`], [`Error::Io`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn to_glb(
    mesh: &Path,
    output: &Path,
    mut comments: Vec<String>,
    workspace: &Workspace,
) -> Result<()> {
    let format = export::format_of(output)?;
    if format.name() != "GLB" || export::is_compressed(output) {
        return Err(Error::Parameter {
            name: "output",
            found: output.display().to_string(),
            expected: "a name that ends with .glb".into(),
        });
    }
    let _held = workspace.reserve("convert: slices", MEMORY)?;
    let source = PlyMesh::open_any(mesh, workspace)?;
    let mut bounds = Bounds::new(mesh, source.vertices(), workspace);
    source.read(&mut bounds)?;

    let source = PlyMesh::open_any(mesh, workspace)?;
    let columns = held_columns(&source);
    // Coordinates stay those of the mesh, and what is to be added to them is said.
    if !comments.iter().any(|comment| comment.starts_with("offset")) {
        let place = source.origin().map(|origin| Place::new(origin, None));
        comments.extend(place.iter().flat_map(Place::comments));
    }
    let about = Mesh {
        vertices: source.vertices(),
        triangles: source.faces(),
        coordinates: match source.has_floats() {
            true => CoordinateType::Float,
            false => CoordinateType::Double,
        },
        columns: columns.iter().map(|(_, column)| column.clone()).collect(),
        comments,
        bounds: bounds.corners(),
        ..Mesh::default()
    };
    let wanted = columns.iter().map(|(index, c)| (*index, c.scalar));
    let source = source.wanting(wanted.collect());
    write(output, (about, [0.0; 3]), workspace, |writer| {
        source.read(writer)
    })
}

/// The columns that the file will hold, with their indices in the mesh: colours and normals of a type that it has.
fn held_columns(source: &PlyMesh) -> Vec<(usize, VertexColumn)> {
    let columns = source.columns().into_iter();
    let held = columns.filter(|(_, name, _)| HELD.contains(name));
    let all: Vec<_> = held
        .map(|(index, name, scalar)| {
            // Normals are written as floats, whatever they were.
            let scalar = if name.starts_with('n') {
                Scalar::F32
            } else {
                scalar
            };
            let name = name.to_owned();
            (index, VertexColumn { name, scalar })
        })
        .collect();
    let mesh = Mesh {
        columns: all.iter().map(|(_, column)| column.clone()).collect(),
        ..Mesh::default()
    };
    all.into_iter()
        .filter(|(_, column)| mesh.is_colour_or_normal(column))
        .collect()
}
