//! Writes the mesh file. Used points are renumbered and pinched vertices split. Parts are written in
//! parallel at known offsets under a temporary name, or compressed in parallel and written in order; then the
//! file is renamed.
//!
//! A format is a module that implements `MeshFormat`, and an entry of the list here.

mod compressed;
mod faces;
mod file;
mod format;
mod number;
mod parts;
mod ply;
mod writer;

pub(crate) use file::{folder_of, is_compressed, temporary, temporary_of};
pub use format::CoordinateType;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::stages::blocks::Blocks;
use crate::stages::cut::StoredPieces;
use crate::stages::order::PointStore;
use crate::stages::repair::Repaired;
use crate::workspace::Workspace;
use file::MeshFile;
use format::{Mesh, MeshFormat};
use parts::{OfTile, Parts, Whole};
use serde::{Deserialize, Serialize};
use std::path::Path;
use writer::Writer;

/// All formats. The first is used if the extension is not known.
const FORMATS: [&dyn MeshFormat; 1] = [&ply::Ply];

/// The format for the extension of `output`, or for that before the one of compression.
fn format_of(output: &Path) -> &'static dyn MeshFormat {
    let name = match is_compressed(output) {
        true => Path::new(output.file_stem().unwrap_or_default()),
        false => output,
    };
    let extension = name.extension().unwrap_or_default();
    let is = |known: &&str| extension.eq_ignore_ascii_case(known);
    let mut named = FORMATS.into_iter();
    let named = named.find(|f| f.extensions().iter().any(is));
    named.unwrap_or(FORMATS[0])
}

/// Bytes of a mesh file in the first format.
pub(crate) fn mesh_bytes(vertices: u64, triangles: u64, coordinates: CoordinateType) -> u64 {
    let mesh = Mesh {
        vertices,
        triangles,
        coordinates,
        columns: Vec::new(),
        comments: Vec::new(),
        origin: None,
    };
    FORMATS[0].layout(&mesh).bytes
}

/// Counts of the finished mesh.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct MeshStats {
    /// Vertices, copies included.
    pub vertices: u64,
    /// Points of the cloud that are vertices.
    pub points_used: u64,
    /// Copies made to split pinched vertices.
    pub pinched_copies: u64,
    /// Triangles.
    pub triangles: u64,
    /// Edges with exactly one triangle.
    pub boundary_edges: u64,
}

/// Properties of a mesh file.
#[derive(Debug)]
pub struct ExportOptions<'a> {
    /// Path of the mesh; its extension selects the format.
    pub output: &'a Path,
    /// Type of the coordinates, in formats that have both.
    pub coordinates: CoordinateType,
    /// Comments for the header.
    pub comments: Vec<String>,
    /// The position of the cloud that is the origin of the mesh, if it is not that of the cloud.
    pub origin: Option<[f64; 3]>,
}

/// Writes the mesh.
///
/// # Errors
/// [`Error::Io`], [`Error::Disk`], [`Error::NoTriangles`], [`Error::Corrupt`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn export(
    store: &PointStore,
    repaired: &Repaired,
    blocks: Blocks,
    lattice: &Lattice,
    options: ExportOptions<'_>,
    workspace: &Workspace,
) -> Result<MeshStats> {
    let surface = repaired.surface.open(workspace)?;
    let filled = repaired.filled.open(workspace, blocks.count())?;
    let numbering = number::number(&repaired.numbering, &filled, blocks, workspace)?;
    let parts = Whole {
        surface,
        filled,
        numbering,
        blocks,
    };
    let stats = parts.stats();
    if stats.triangles == 0 {
        return Err(Error::NoTriangles {
            why: NO_TRIANGLES.into(),
        });
    }
    let parts = write(store, parts, lattice, options, workspace)?;
    parts.numbering.release(workspace)?;
    Ok(stats)
}

/// Writes a mesh that was cut: that of the only square.
///
/// # Errors
/// See [`export`].
pub fn export_cut(
    store: &PointStore,
    stored: &StoredPieces,
    lattice: &Lattice,
    options: ExportOptions<'_>,
    workspace: &Workspace,
) -> Result<MeshStats> {
    let pieces = &stored.open(workspace)?;
    let [tile] = pieces.tiles() else {
        return Err(Error::NoTriangles {
            why: NO_TRIANGLES.into(),
        });
    };
    let parts = OfTile { pieces, tile };
    write(store, parts, lattice, options, workspace)?;
    stored.release(workspace)?;
    Ok(parts.stats())
}

/// Writes the file of a mesh; returns its parts.
fn write<P: Parts>(
    store: &PointStore,
    parts: P,
    lattice: &Lattice,
    options: ExportOptions<'_>,
    workspace: &Workspace,
) -> Result<P> {
    let ExportOptions {
        output,
        coordinates,
        comments,
        origin,
    } = options;
    let stats = parts.stats();
    let mesh = Mesh {
        vertices: stats.vertices,
        triangles: stats.triangles,
        coordinates,
        columns: Vec::new(),
        comments,
        origin,
    };
    let writer = Writer {
        store,
        lattice,
        parts,
        file: MeshFile::open(output, format_of(output), mesh, workspace)?,
    };
    match is_compressed(output) {
        true => compressed::write(&writer, workspace)?,
        false => writer.write(workspace)?,
    }
    writer.file.finish()?;
    Ok(writer.parts)
}

const NO_TRIANGLES: &str = "no three cells agree on one that belongs to a component large enough; \
    try a larger --radius, --smooth 1 for noisy scans, or a smaller --min-component";
