//! The reference surface as a PLY mesh.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

use crate::error::{Error, Result};
use crate::surface::Tessellation;
use outcrop_ply::{Encoding, Layout, Scalar};

/// Writes a triangle mesh, binary with 64-bit coordinates.
pub(crate) fn write_reference(mesh: &Tessellation, path: &Path) -> Result<()> {
    let file = File::create(path).map_err(|e| Error::io(path, "create the file", e))?;
    body(mesh, BufWriter::with_capacity(1 << 18, file)).map_err(|e| Error::io(path, "write", e))
}

fn body(mesh: &Tessellation, mut file: impl Write) -> io::Result<()> {
    let layout = Layout {
        encoding: Encoding::Little,
        comments: &["outcrop-cloudgen reference"],
        vertices: mesh.vertices.len() as u64,
        coordinates: Scalar::F64,
        columns: &[],
        triangles: Some((mesh.triangles.len() as u64, Scalar::U32)),
    };
    file.write_all(layout.header().as_bytes())?;
    for vertex in &mesh.vertices {
        file.write_all(vertex.map(f64::to_le_bytes).as_flattened())?;
    }
    for triangle in &mesh.triangles {
        file.write_all(&[3])?;
        file.write_all(triangle.map(u32::to_le_bytes).as_flattened())?;
    }
    file.flush()
}
