//! Sinks for a mesh that comes slice by slice: its bounds, and its file, in the order in which it comes.

use outcrop_codecs::ply_mesh::Sink;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_mesh_files::export::{self, Format, Mesh};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a mesh with these properties to `output`; `read` gives it to the sink. Positions are less `shift` in the
/// file. The file gets its name when it is whole.
///
/// # Errors
/// Errors of `read`; [`Error::Parameter`] for a name without a format; [`Error::TooLarge`], [`Error::Io`],
/// [`Error::Memory`].
pub(crate) fn write(
    output: &Path,
    (about, shift): (Mesh, [f64; 3]),
    workspace: &Workspace,
    read: impl FnOnce(&mut Writer<'_>) -> Result<()>,
) -> Result<()> {
    let format = export::format_of(output)?;
    export::check_size(output, &about, true)?;
    let corners = match format.wants_positions() {
        true => 24 * about.vertices,
        false => 0,
    };
    let _held = workspace.reserve("write: corners", corners)?;
    let temporary = export::temporary(output);
    let written = File::create(&temporary)
        .map_err(|e| Error::io(output, "create a file beside it", e))
        .and_then(|file| {
            let mut writer = Writer {
                output,
                format,
                shift,
                header: format.layout(&about).header,
                about,
                positions: Vec::new(),
                corners: Vec::new(),
                placed: Vec::new(),
                bytes: Vec::new(),
                file: BufWriter::new(file),
                workspace,
            };
            writer.begin()?;
            read(&mut writer)?;
            writer.finish()
        })
        .and_then(|()| {
            outcrop_platform::rename(&temporary, output)
                .map_err(|e| Error::io(output, "rename the finished file to it", e))
        });
    if written.is_err() {
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

/// Finds the bounds of a mesh, and what is no triangle of it.
pub(crate) struct Bounds<'a> {
    mesh: &'a Path,
    vertices: u64,
    seen: u64,
    corners: [[f64; 3]; 2],
    workspace: &'a Workspace,
}

impl<'a> Bounds<'a> {
    /// For a mesh with so many vertices.
    pub fn new(mesh: &'a Path, vertices: u64, workspace: &'a Workspace) -> Self {
        Self {
            mesh,
            vertices,
            seen: 0,
            corners: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            workspace,
        }
    }

    /// The least and largest coordinates, if there are vertices.
    pub fn corners(&self) -> Option<[[f64; 3]; 2]> {
        (self.vertices > 0).then_some(self.corners)
    }

    /// An error of the mesh.
    pub fn error(&self, found: impl Into<String>, expected: &str) -> Error {
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
}

/// Writes the file, in the order in which the mesh comes.
pub(crate) struct Writer<'a> {
    output: &'a Path,
    format: &'static dyn Format,
    header: Vec<u8>,
    about: Mesh,
    shift: [f64; 3],
    /// Positions whose values are to come.
    positions: Vec<[f64; 3]>,
    /// The positions of all vertices, if the format wants them for its triangles.
    corners: Vec<[f64; 3]>,
    placed: Vec<[[f64; 3]; 3]>,
    bytes: Vec<u8>,
    file: BufWriter<File>,
    workspace: &'a Workspace,
}

impl Writer<'_> {
    /// Notes whether the triangles that come next close the mesh, if the file tells it.
    #[cfg(feature = "levels")]
    pub fn fill(&mut self, filled: bool) {
        self.about.filled = self.about.filled.map(|_| filled);
    }

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
        let shift = self.shift;
        let moved = positions
            .iter()
            .map(|p| [p[0] - shift[0], p[1] - shift[1], p[2] - shift[2]]);
        self.positions.extend(moved);
        if self.format.wants_positions() {
            self.corners.extend_from_slice(&self.positions);
        }
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
        self.placed.clear();
        if self.format.wants_positions() {
            let placed = triangles
                .iter()
                .map(|t| t.map(|v| self.corners[v as usize]));
            self.placed.extend(placed);
        }
        self.format
            .put_triangles(&self.about, triangles, &self.placed, &mut self.bytes);
        self.put()
    }
}
