//! Writes the mesh file. Used points are renumbered and pinched vertices split. Slices are written in
//! parallel at known offsets under a temporary name; then the file is renamed.
//!
//! A format is a module that implements `MeshFormat`, and an entry of the list here.

mod faces;
mod file;
mod format;
mod number;
mod ply;

pub(crate) use file::{folder_of, temporary};
pub use format::CoordinateType;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::repair::Repaired;
use crate::workspace::Workspace;
use crate::workspace::memory::{bytes_of, hold};
use crate::workspace::persist::persist;
use faces::Faces;
use file::MeshFile;
use format::{Mesh, MeshFormat};
use number::Numbering;
use serde::Serialize;
use std::path::Path;

/// All formats. The first is used if the extension is not known.
const FORMATS: [&dyn MeshFormat; 1] = [&ply::Ply];

/// The format for the extension of `output`.
fn format_of(output: &Path) -> &'static dyn MeshFormat {
    let extension = output.extension().unwrap_or_default();
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
    };
    FORMATS[0].layout(&mesh).bytes
}

/// Counts of the finished mesh.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
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

fn block_bytes(repaired: &Repaired, blocks: Blocks, block: usize) -> u64 {
    let records = repaired.surface.records(block) + repaired.filled.rows(block);
    60 * records as u64 + blocks.ids(block).len() as u64 * 60 + (1 << 20)
}

/// Writes the mesh to `output`.
///
/// # Errors
/// [`Error::Io`], [`Error::Disk`], [`Error::NoTriangles`], [`Error::Corrupt`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn export(
    store: &PointStore,
    repaired: &Repaired,
    blocks: Blocks,
    lattice: &Lattice,
    coordinates: CoordinateType,
    output: &Path,
    workspace: &Workspace,
) -> Result<MeshStats> {
    let numbering = number::number(repaired, blocks, workspace)?;
    let stats = numbering.stats;
    if stats.triangles == 0 {
        return Err(Error::NoTriangles {
            why: NO_TRIANGLES.into(),
        });
    }
    let mesh = Mesh {
        vertices: stats.vertices,
        triangles: stats.triangles,
        coordinates,
    };
    let file = MeshFile::open(output, format_of(output), mesh, workspace)?;
    let bytes = |block| block_bytes(repaired, blocks, block);
    let work = |block| {
        write_block(store, repaired, &numbering, blocks, lattice, &file, block)?;
        workspace.advance(1);
        Ok(())
    };
    workspace.units("export: block", blocks.count(), bytes, work, |_, ()| Ok(()))?;
    file.finish()?;
    Ok(stats)
}

persist!(MeshStats {
    vertices,
    points_used,
    pinched_copies,
    triangles,
    boundary_edges
});

const NO_TRIANGLES: &str = "no three cells agree on one that belongs to a component large enough; \
    try a larger --radius, --smooth 1 for noisy scans, or a smaller --min-component";

fn write_block(
    store: &PointStore,
    repaired: &Repaired,
    numbering: &Numbering<'_>,
    blocks: Blocks,
    lattice: &Lattice,
    file: &MeshFile<'_>,
    block: usize,
) -> Result<()> {
    let ids = blocks.ids(block);
    let points = store.slice(ids.start as usize..ids.end as usize)?;
    let at = |v: u32| lattice.position(points[(v - ids.start) as usize]);
    let mut bytes = Vec::with_capacity(file.vertex_bytes() * ids.len());
    let mut held = hold(bytes_of(&points) + bytes_of(&bytes));
    let used = ids.clone().filter(|v| numbering.used(*v));
    file.encode_vertices(used.map(at), &mut bytes);
    // Three parts for each block; the number only identifies a part.
    let part = 3 * block as u32;
    file.write_vertices(part, numbering.vertex(ids.start).into(), &bytes)?;
    bytes.clear();
    let copies = numbering.copies.get(block)?;
    file.encode_vertices(copies.iter().map(|c| at(c.id)), &mut bytes);
    file.write_vertices(part + 1, numbering.first_copy(block), &bytes)?;
    drop(points);
    bytes.clear();
    let faces = Faces::load(repaired, numbering, ids, block)?;
    bytes.reserve_exact(faces.len() * file.triangle_bytes());
    let mut batch = file.triangles(&mut bytes);
    faces.for_each(|t| batch.push(t));
    batch.finish();
    held.set(faces.taken() + bytes_of(&bytes));
    file.write_triangles(part + 2, numbering.first_face(block), &bytes)
}
