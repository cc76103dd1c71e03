//! PLY as other programs write it: text, polygons, further lists, faces before vertices.

use super::Mesh;
use super::spool::{NO_MATERIAL, Spool};
use crate::failure::{Failure, converted};
use outcrop_disk::error::Result;
use outcrop_ply::{MeshStream, Part, SLICE, Scalar};
use std::path::Path;

/// Bytes of memory for a value of a vertex: as it is read, and as it is written.
const VALUE: usize = size_of::<f64>() + size_of::<f64>();

/// Bytes of memory besides values: the buffer of the file, positions and triangles.
const READER: usize = (4 << 20) + SLICE * 64;

/// Reads the mesh in the file `content`: positions, triangles, and all columns of vertices. Corners are passed on as
/// they are: whoever uses them checks them, as in a mesh that is read where it is.
pub(super) fn read(mesh: &Mesh<'_>, content: &Path, spool: &mut Spool<'_>) -> Result<()> {
    let stream = MeshStream::open_as(content, mesh.shown).map_err(converted)?;
    spool.floats = stream.types() == Some([Scalar::F32; 3]);
    spool.comments = stream.place().comments();
    spool.comments.extend(stream.system().comments());
    let columns = stream.columns();
    let wanted: Vec<_> = columns.iter().map(|c| (c.0, c.2)).collect();
    spool.columns = columns.iter().map(|c| (c.1.to_owned(), c.2)).collect();
    let bytes = READER + SLICE * VALUE * wanted.len();
    let _held = mesh.workspace.reserve("mesh: slices", bytes as u64)?;
    let mut vertices = Vertices {
        wanted: wanted.clone(),
        positions: Vec::with_capacity(SLICE),
        bytes: Vec::new(),
    };
    let mut take = |part: Part<'_>| {
        mesh.workspace.check_cancel()?;
        match part {
            Part::Vertices(positions) => vertices.positions(positions, spool),
            Part::Values(values) => vertices.values(values, spool),
            Part::Triangles(triangles) => triangles
                .iter()
                .try_for_each(|corners| spool.triangle(*corners, NO_MATERIAL)),
            Part::Polygon(corners) => {
                spool.count(corners);
                Ok(())
            }
        }
    };
    let read = stream
        .wanting(wanted)
        .read(|part| take(part).map_err(Failure::from));
    read.map_err(converted)?;
    mesh.workspace.io.add_read(mesh.bytes);
    Ok(())
}

/// Vertices whose values are to come.
struct Vertices {
    /// Indices and types of the columns.
    wanted: Vec<(usize, Scalar)>,
    positions: Vec<[f64; 3]>,
    bytes: Vec<u8>,
}

impl Vertices {
    fn positions(&mut self, positions: &[[f64; 3]], spool: &mut Spool<'_>) -> Result<()> {
        if self.wanted.is_empty() {
            return positions
                .iter()
                .try_for_each(|p| spool.vertex_with(*p, &[]));
        }
        self.positions.clear();
        self.positions.extend(positions);
        Ok(())
    }

    fn values(&mut self, values: &[f64], spool: &mut Spool<'_>) -> Result<()> {
        let rows = values.chunks_exact(self.wanted.len());
        self.positions
            .iter()
            .zip(rows)
            .try_for_each(|(position, row)| {
                self.bytes.clear();
                for (value, (_, scalar)) in row.iter().zip(&self.wanted) {
                    scalar.put(*value, &mut self.bytes);
                }
                spool.vertex_with(*position, &self.bytes)
            })
    }
}
