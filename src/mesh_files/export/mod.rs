//! Writes the mesh file. Used points are renumbered and pinched vertices split. Parts are written in
//! parallel at known offsets under a temporary name, or compressed in parallel and written in order; then the
//! file is renamed.
//!
//! A format is a module that implements `MeshFormat`, and an entry of the list here.

mod batch;
mod bounds;
mod compressed;
mod coordinates;
mod corners;
mod document;
mod faces;
mod file;
mod format;
mod formats;
mod glb;
mod normals;
mod number;
mod obj;
mod packed;
mod parts;
mod piece;
mod ply;
mod split;
mod stl;
mod stored;
mod write;

pub use file::{folder_of, is_compressed, temporary, temporary_of};
pub use format::CoordinateType;
pub use format::{Mesh, MeshFormat as Format, VertexColumn, normal_columns};
pub use formats::{check_name, check_size, extensions, format_of, left_out, mesh_bytes};
pub use obj::decimals;
pub use split::{SplitOptions, export_split};
pub use split::{is_square_of, remove_unfinished};

use crate::cut::StoredPieces;
use coordinates::Coordinates;
use file::{HEADER, MeshFile};
use format::MeshFormat;
use outcrop_disk::error::{Error, Remedy, Result, Setting};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_geom::lattice::{Lattice, Shift};
use outcrop_mesh::repair::Repaired;
use outcrop_points::Column;
use outcrop_stages::attributes::StoredColumns;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::order::PointStore;
use parts::{OfTile, Parts, Whole};
use serde::{Deserialize, Serialize};
use std::path::Path;
use write::Writer;

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
    /// Vertices have normals, in formats that hold them.
    pub normals: bool,
    /// Columns of the points.
    pub columns: Option<&'a StoredColumns>,
    /// Decimals of coordinates as text.
    pub decimals: usize,
    /// Meshopt compression, in formats that have it.
    pub compress: bool,
}

impl<'a> ExportOptions<'a> {
    /// A mesh without comments, origin and normals.
    #[must_use]
    pub fn new(output: &'a Path, coordinates: CoordinateType) -> Self {
        Self {
            output,
            coordinates,
            comments: Vec::new(),
            origin: None,
            normals: false,
            decimals: 3,
            columns: None,
            compress: false,
        }
    }
}

/// Writes the mesh.
///
/// # Errors
/// [`Error::Io`], [`Error::Disk`], [`Error::NoTriangles`], [`Error::TooLarge`], [`Error::Corrupt`],
/// [`Error::Memory`], [`Error::Cancelled`].
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
        store,
        surface,
        filled,
        pinches: &repaired.numbering.pinches,
        numbering,
        normals: stored::table(blocks.count()),
        blocks,
    };
    let stats = parts.stats();
    if stats.triangles == 0 {
        return Err(no_triangles());
    }
    let (format, mut mesh) = options.mesh(&stats)?;
    let mut bounds = None;
    if format.wants_bounds() {
        let found = bounds::bounds(store, &parts.numbering, workspace)?;
        let in_file = options.in_file(lattice);
        mesh.bounds = Some(found.map(|corner| in_file.of(corner)));
        bounds = Some(found);
    }
    let with_normals = mesh.compress && mesh.normals().is_some();
    if with_normals {
        stored::make(&parts, workspace)?;
    }
    let parts = write(store, parts, lattice, (mesh, bounds), &options, workspace)?;
    if with_normals {
        parts.normals.release(workspace)?;
    }
    parts.numbering.release(workspace)?;
    Ok(stats)
}

/// Writes a mesh that was cut, but not divided: that of the only square.
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
        return Err(no_triangles());
    };
    let parts = OfTile { pieces, tile };
    let (_, mut mesh) = options.mesh(&parts.stats())?;
    let in_file = options.in_file(lattice);
    mesh.bounds = Some(tile.bounds.map(|corner| in_file.of(corner)));
    let mesh = (mesh, Some(tile.bounds));
    write(store, parts, lattice, mesh, &options, workspace)?;
    Ok(parts.stats())
}

impl ExportOptions<'_> {
    /// The format, and what is known of a mesh with these counts.
    fn mesh(&self, stats: &MeshStats) -> Result<(&'static dyn MeshFormat, Mesh)> {
        let format = format_of(self.output)?;
        let mut mesh = Mesh {
            vertices: stats.vertices,
            triangles: stats.triangles,
            coordinates: self.coordinates,
            columns: normal_columns()
                .filter(|_| self.normals)
                .chain(of_points(self.columns).map(VertexColumn::from))
                .collect(),
            comments: self.comments.clone(),
            bounds: None,
            decimals: self.decimals,
            compress: self.compress,
            filled: None,
        };
        // Columns that the format does not hold are not made.
        mesh.columns = mesh
            .columns
            .iter()
            .filter(|c| format.holds(&mesh, c))
            .cloned()
            .collect();
        Ok((format, mesh))
    }

    /// True if the mesh is compressed, so that its parts are written in their order.
    fn in_order(&self) -> bool {
        self.compress || is_compressed(self.output)
    }

    /// The coordinates in the file.
    fn in_file<'l>(&self, lattice: &'l Lattice) -> Coordinates<'l> {
        Coordinates {
            lattice,
            shift: self.origin,
            written: self.coordinates,
        }
    }

    /// The columns of the points, and true for each of them that the file holds.
    fn held(&self, mesh: &Mesh) -> Option<(&StoredColumns, Vec<bool>)> {
        let held = |c: &Column| mesh.columns.iter().any(|held| held.name == c.name);
        let held = of_points(self.columns).map(held).collect();
        self.columns.map(|columns| (columns, held))
    }
}

/// The columns of points.
fn of_points(columns: Option<&StoredColumns>) -> impl Iterator<Item = &Column> {
    columns.into_iter().flat_map(StoredColumns::columns)
}

/// Writes the file of a mesh, of whose vertices the bounds may be known; returns its parts.
fn write<P: Parts>(
    store: &PointStore,
    parts: P,
    lattice: &Lattice,
    (mesh, bounds): (Mesh, Option<[Point; 2]>),
    options: &ExportOptions<'_>,
    workspace: &Workspace,
) -> Result<P> {
    let output = options.output;
    check_size(output, &mesh, false)?;
    let writer = Writer {
        store,
        parts,
        columns: options.held(&mesh),
        normals: mesh.normals().is_some() && !mesh.compress,
        coordinates: options.in_file(lattice),
        bounds,
        file: MeshFile::open(output, format_of(output)?, mesh, workspace)?,
    };
    match options.in_order() {
        true => workspace.once("compress", |unit| in_order(&writer, unit, workspace))?,
        false => writer.write(workspace)?,
    }
    writer.file.finish()?;
    Ok(writer.parts)
}

/// Writes a compressed mesh, as one unit.
fn in_order<P: Parts>(
    writer: &Writer<'_, P>,
    unit: &Unit<'_>,
    workspace: &Workspace,
) -> Result<()> {
    let whole = match writer.file.mesh().compress {
        true => packed::write_all(writer, workspace)?,
        false => compressed::write_all(writer, workspace)?,
    };
    writer.file.note(unit, HEADER, whole);
    Ok(())
}

fn no_triangles() -> Error {
    let why = "every component is too small, or no three cells agree on a triangle";
    let smooth = Setting::Value("smooth", "2".to_owned());
    Error::no_triangles(why)
        .with(Remedy::Larger("radius"))
        .with(Remedy::Give(smooth, "for noisy scans"))
        .with(Remedy::Smaller("min_component"))
}
