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
mod ply;

pub(crate) use file::{folder_of, is_compressed, temporary, temporary_of};
pub use format::CoordinateType;

use crate::error::{Error, Result};
use crate::geom::Point;
use crate::geom::lattice::{Lattice, Shift};
use crate::spill::Inbox;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::repair::{FilledTriangle, Repaired, Surface};
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};
use faces::Faces;
use file::{Edge, HEADER, MeshFile};
use format::{Mesh, MeshFormat};
use number::Numbering;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::Path;

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
    /// The origin of the coordinates in the mesh, if it is not that of the cloud.
    pub origin: Option<Shift>,
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
    let ExportOptions {
        output,
        coordinates,
        comments,
        origin: shift,
    } = options;
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
        columns: Vec::new(),
        comments,
        origin: shift.map(|shift| shift.origin),
    };
    let writer = Writer {
        store,
        surface,
        filled,
        numbering,
        blocks,
        lattice,
        shift,
        written: coordinates,
        file: MeshFile::open(output, format_of(output), mesh, workspace)?,
    };
    match is_compressed(output) {
        true => compressed::write(&writer, workspace)?,
        false => writer.write(workspace)?,
    }
    writer.file.finish()?;
    writer.numbering.release(workspace)?;
    Ok(stats)
}

const NO_TRIANGLES: &str = "no three cells agree on one that belongs to a component large enough; \
    try a larger --radius, --smooth 1 for noisy scans, or a smaller --min-component";

/// Writes the parts of a mesh: for each block its vertices, its copies of vertices, and its triangles. In the
/// file the parts of one kind follow each other.
struct Writer<'a> {
    store: &'a PointStore,
    surface: Surface<'a>,
    filled: Inbox<FilledTriangle>,
    numbering: Numbering,
    blocks: Blocks,
    lattice: &'a Lattice,
    shift: Option<Shift>,
    /// Type of the coordinates in the file.
    written: CoordinateType,
    file: MeshFile<'a>,
}

/// Number of parts of a block.
const KINDS: usize = 3;

impl Writer<'_> {
    /// Writes the file, every part at its offset.
    fn write(&self, workspace: &Workspace) -> Result<()> {
        let (file, count) = (&self.file, self.blocks.count());
        workspace.once("header", |unit| {
            file.write(unit, HEADER, &file.layout.header, 0)
        })?;
        let memory = |block| self.memory(workspace, block);
        let work = |unit: &Unit<'_>| {
            let (mut bytes, mut edges) = (Vec::new(), Vec::new());
            for kind in 0..KINDS {
                let part = kind * count + unit.number();
                self.encode(unit, part, &mut bytes)?;
                edges.extend(file.write(unit, part as u32, &bytes, self.start(part))?);
            }
            unit.advance(1);
            Ok(edges)
        };
        let each = |_, edges: Vec<Edge>| file.write_edges(&edges);
        workspace.units("export: block", count, memory, work, each)
    }

    /// Bytes of memory for a part of a block.
    fn memory(&self, workspace: &Workspace, block: usize) -> u64 {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        60 * records as u64 + self.blocks.ids(block).len() as u64 * 60 + (1 << 20)
    }

    /// Offset in the uncompressed file at which a part begins: the end of the part before it.
    fn start(&self, part: usize) -> u64 {
        let (layout, numbering) = (&self.file.layout, &self.numbering);
        let block = part % self.blocks.count();
        match part / self.blocks.count() {
            0 => {
                let first = numbering.vertex(self.blocks.ids(block).start);
                layout.vertices.offset(first.into())
            }
            1 => layout.vertices.offset(numbering.first_copy(block)),
            2 => layout.triangles.offset(numbering.first_face(block)),
            _ => layout.bytes,
        }
    }

    /// Encodes a part.
    fn encode(&self, unit: &Unit<'_>, part: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let (numbering, block) = (&self.numbering, part % self.blocks.count());
        let ids = self.blocks.ids(block);
        bytes.clear();
        bytes.reserve_exact((self.start(part + 1) - self.start(part)) as usize);
        match part / self.blocks.count() {
            0 => {
                let used = ids.clone().filter(|v| numbering.used(*v));
                self.vertices(unit, ids, used, bytes)
            }
            1 => {
                let copies = numbering.copies.get(unit, block)?;
                if copies.is_empty() {
                    return Ok(());
                }
                self.vertices(unit, ids, copies.iter().map(|c| c.id), bytes)
            }
            _ => {
                let faces = Faces::load(unit, block, &self.surface, &self.filled, numbering, ids)?;
                let _held = unit.hold(faces.bytes() + bytes_of(bytes));
                let mut batch = self.file.triangles(bytes);
                faces.for_each(|t| batch.push(t));
                batch.finish();
                Ok(())
            }
        }
    }

    /// Encodes the positions of `chosen` points of the block with the ids `ids`.
    fn vertices(
        &self,
        unit: &Unit<'_>,
        ids: Range<u32>,
        chosen: impl Iterator<Item = u32>,
        bytes: &mut Vec<u8>,
    ) -> Result<()> {
        let points = self.store.slice(ids.start as usize..ids.end as usize)?;
        let _held = unit.hold(bytes_of(&points) + bytes_of(bytes));
        let at = |v: u32| self.coordinates(points[(v - ids.start) as usize]);
        self.file.encode_vertices(chosen.map(at), &[], bytes);
        Ok(())
    }

    /// The coordinates that are written for a position.
    fn coordinates(&self, point: Point) -> [f64; 3] {
        match (&self.shift, self.written) {
            (None, _) => self.lattice.position(point),
            (Some(shift), CoordinateType::Double) => self.lattice.shifted(point, shift),
            (Some(shift), CoordinateType::Float) => {
                self.lattice.shifted_single(point, shift).map(f64::from)
            }
        }
    }
}
