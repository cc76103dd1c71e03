//! Meshes in another format than PLY, from the PLY file of a finished mesh.

use outcrop_codecs::ply_mesh::{PlyMesh, SLICE, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_mesh_files::export::{self, CoordinateType, Format, Mesh, VertexColumn};
use outcrop_ply::{Place, Scalar};
use std::fs::File;
use std::io::{BufWriter, Write};
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
    let mut bounds = Bounds {
        mesh,
        vertices: source.vertices(),
        seen: 0,
        corners: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        workspace,
    };
    if !source.vertices_first() {
        return Err(bounds.error("faces before vertices", "vertices before faces"));
    }
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
        bounds: (bounds.vertices > 0).then_some(bounds.corners),
        ..Mesh::default()
    };
    export::check_size(output, &about, true)?;
    let wanted = columns.iter().map(|(index, c)| (*index, c.scalar));
    let source = source.wanting(wanted.collect());
    let temporary = export::temporary(output);
    let written = File::create(&temporary)
        .map_err(|e| Error::io(output, "create a file beside it", e))
        .and_then(|file| {
            let mut writer = Writer {
                output,
                format,
                header: format.layout(&about).header,
                about,
                positions: Vec::with_capacity(SLICE),
                bytes: Vec::new(),
                file: BufWriter::new(file),
                workspace,
            };
            writer.begin()?;
            source.read(&mut writer)?;
            writer.finish()
        })
        .and_then(|()| {
            std::fs::rename(&temporary, output)
                .map_err(|e| Error::io(output, "rename the finished file to it", e))
        });
    if written.is_err() {
        let _ = std::fs::remove_file(&temporary);
    }
    written
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

/// Finds the bounds of a mesh, and what is no triangle of it.
struct Bounds<'a> {
    mesh: &'a Path,
    vertices: u64,
    seen: u64,
    corners: [[f64; 3]; 2],
    workspace: &'a Workspace,
}

impl Bounds<'_> {
    fn error(&self, found: impl Into<String>, expected: &str) -> Error {
        Error::input(self.mesh, "mesh", found, expected)
    }
}

impl Sink for Bounds<'_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        for position in positions {
            for (k, x) in position.iter().enumerate() {
                if !x.is_finite() {
                    return Err(self.error(format!("the coordinate {x}"), "finite numbers"));
                }
                self.corners[0][k] = self.corners[0][k].min(*x);
                self.corners[1][k] = self.corners[1][k].max(*x);
            }
        }
        self.workspace.check_cancel()
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        for t in triangles {
            if let Some(v) = t.iter().find(|v| u64::from(**v) >= self.vertices) {
                let found = format!("corner {v} of triangle {}", self.seen);
                return Err(self.error(found, "numbers of vertices"));
            }
            self.seen += 1;
        }
        self.workspace.check_cancel()
    }

    fn non_triangles(&mut self, _: u64) -> Result<()> {
        let found = format!("face {} without exactly three corners", self.seen);
        Err(self.error(found, "triangles only"))
    }
}

/// Writes the file, in the order in which the mesh comes.
struct Writer<'a> {
    output: &'a Path,
    format: &'static dyn Format,
    header: Vec<u8>,
    about: Mesh,
    /// Positions whose values are to come.
    positions: Vec<[f64; 3]>,
    bytes: Vec<u8>,
    file: BufWriter<File>,
    workspace: &'a Workspace,
}

impl Writer<'_> {
    fn put(&mut self) -> Result<()> {
        let done = self.file.write_all(&self.bytes);
        self.bytes.clear();
        done.map_err(|e| Error::io(self.output, "write", e))?;
        self.workspace.check_cancel()
    }

    fn begin(&mut self) -> Result<()> {
        self.bytes = std::mem::take(&mut self.header);
        self.put()
    }

    fn finish(self) -> Result<()> {
        let file = self.file.into_inner().map_err(|e| e.into_error());
        let done = file.and_then(|file| file.sync_all());
        done.map_err(|e| Error::io(self.output, "write", e))
    }

    fn put_vertices(&mut self, values: &[u8]) -> Result<()> {
        let positions = std::mem::take(&mut self.positions);
        self.format
            .put_vertices(&self.about, &positions, values, &mut self.bytes);
        self.put()
    }
}

impl Sink for Writer<'_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.positions.extend_from_slice(positions);
        match self.about.columns.is_empty() {
            true => self.put_vertices(&[]),
            false => Ok(()),
        }
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        let scalars = self.about.columns.iter().map(|c| c.scalar).cycle();
        let mut bytes = Vec::with_capacity(8 * values.len());
        for (value, scalar) in values.iter().zip(scalars) {
            scalar.put(*value, &mut bytes);
        }
        self.put_vertices(&bytes)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.format
            .put_triangles(&self.about, triangles, &[], &mut self.bytes);
        self.put()
    }

    fn non_triangles(&mut self, _: u64) -> Result<()> {
        Ok(())
    }
}
