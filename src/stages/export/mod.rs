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
use crate::spill::Inbox;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::repair::{FilledTriangle, Repaired, Surface};
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};
use faces::Faces;
use file::MeshFile;
use format::{Mesh, MeshFormat};
use number::Numbering;
use serde::{Deserialize, Serialize};
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
    let surface = repaired.surface.open(workspace)?;
    let filled = repaired.filled.open(workspace, blocks.count())?;
    let numbering = number::number(&repaired.numbering, &filled, blocks, workspace)?;
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
    let writer = Writer {
        store,
        surface,
        filled,
        numbering,
        blocks,
        lattice,
        file: MeshFile::open(output, format_of(output), mesh, workspace)?,
    };
    let bytes = |block| writer.bytes(workspace, block);
    let work = |unit: &Unit<'_>| writer.block(unit).inspect(|_| unit.advance(1));
    workspace.units("export: block", blocks.count(), bytes, work, |_, ()| Ok(()))?;
    writer.file.finish()?;
    writer.numbering.release(workspace)?;
    Ok(stats)
}

const NO_TRIANGLES: &str = "no three cells agree on one that belongs to a component large enough; \
    try a larger --radius, --smooth 1 for noisy scans, or a smaller --min-component";

/// Writes the blocks of a mesh.
struct Writer<'a> {
    store: &'a PointStore,
    surface: Surface<'a>,
    filled: Inbox<FilledTriangle>,
    numbering: Numbering,
    blocks: Blocks,
    lattice: &'a Lattice,
    file: MeshFile<'a>,
}

impl Writer<'_> {
    /// Bytes for a block.
    fn bytes(&self, workspace: &Workspace, block: usize) -> u64 {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        60 * records as u64 + self.blocks.ids(block).len() as u64 * 60 + (1 << 20)
    }

    /// Writes a block.
    fn block(&self, unit: &Unit<'_>) -> Result<()> {
        let (block, numbering, file) = (unit.number(), &self.numbering, &self.file);
        let (vertices, triangles) = (file.layout.vertices, file.layout.triangles);
        let ids = self.blocks.ids(block);
        let points = self.store.slice(ids.start as usize..ids.end as usize)?;
        let at = |v: u32| self.lattice.position(points[(v - ids.start) as usize]);
        let mut bytes = Vec::with_capacity(vertices.bytes as usize * ids.len());
        let mut held = unit.hold(bytes_of(&points) + bytes_of(&bytes));
        let used = ids.clone().filter(|v| numbering.used(*v));
        file.encode_vertices(used.map(at), &mut bytes);
        // Three parts for each block; the number only identifies a part.
        let part = 3 * block as u32;
        let first = numbering.vertex(ids.start).into();
        file.write(unit, part, &bytes, vertices.offset(first))?;
        bytes.clear();
        let copies = numbering.copies.get(unit, block)?;
        file.encode_vertices(copies.iter().map(|c| at(c.id)), &mut bytes);
        let first = numbering.first_copy(block);
        file.write(unit, part + 1, &bytes, vertices.offset(first))?;
        drop(points);
        bytes.clear();
        let faces = Faces::load(unit, &self.surface, &self.filled, numbering, ids)?;
        bytes.reserve_exact(faces.len() * triangles.bytes as usize);
        let mut batch = file.triangles(&mut bytes);
        faces.for_each(|t| batch.push(t));
        batch.finish();
        held.set(faces.bytes() + bytes_of(&bytes));
        let first = numbering.first_face(block);
        file.write(unit, part + 2, &bytes, triangles.offset(first))
    }
}
