//! Binary little-endian PLY, written in slices at known offsets.

use super::MeshStats;
use crate::error::{Error, Result};
use crate::workspace::{IoCounters, Workspace, limits};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Type of the coordinates in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CoordinateType {
    /// 32-bit floats.
    Float,
    /// 64-bit floats.
    Double,
}

impl CoordinateType {
    fn bytes(self) -> u64 {
        match self {
            CoordinateType::Float => 4,
            CoordinateType::Double => 8,
        }
    }

    fn name(self) -> &'static str {
        match self {
            CoordinateType::Float => "float",
            CoordinateType::Double => "double",
        }
    }
}

/// Bytes of a triangle: the number of its corners and three indices.
pub const FACE: u64 = 13;

/// Appends the bytes of a triangle to `bytes`.
#[inline]
pub fn encode_face([a, b, c]: [u32; 3], bytes: &mut Vec<u8>) {
    let mut face = [3u8; FACE as usize];
    face[1..5].copy_from_slice(&a.to_le_bytes());
    face[5..9].copy_from_slice(&b.to_le_bytes());
    face[9..].copy_from_slice(&c.to_le_bytes());
    bytes.extend_from_slice(&face);
}

/// A mesh file under its temporary name; deleted unless finished.
#[derive(Debug)]
pub struct MeshFile {
    output: PathBuf,
    temporary: Option<tempfile::TempPath>,
    file: File,
    header: u64,
    vertices: u64,
    coordinates: CoordinateType,
    io: Arc<IoCounters>,
}

impl MeshFile {
    /// Writes the header of a mesh with the counts of `stats` beside `output`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Disk`] if there is no room for the whole file.
    pub fn create(
        output: &Path,
        coordinates: CoordinateType,
        stats: &MeshStats,
        workspace: &Workspace,
    ) -> Result<Self> {
        // A file with up to 2^31 vertices can use the index type that every reader knows.
        let index = if stats.vertices <= 1 << 31 {
            "int"
        } else {
            "uint"
        };
        let scalar = coordinates.name();
        let header = format!(
            "ply\nformat binary_little_endian 1.0\ncomment made by outcrop {}\n\
             element vertex {}\nproperty {scalar} x\nproperty {scalar} y\nproperty {scalar} z\n\
             element face {}\nproperty list uchar {index} vertex_indices\nend_header\n",
            env!("CARGO_PKG_VERSION"),
            stats.vertices,
            stats.triangles,
        );
        let bytes =
            header.len() as u64 + stats.vertices * 3 * coordinates.bytes() + stats.triangles * FACE;
        let folder = folder_of(output);
        if let Some(free) = limits::disk_free(folder).filter(|free| *free < bytes) {
            return Err(Error::Disk {
                path: output.to_path_buf(),
                needed: bytes,
                free,
            });
        }
        let io = |action: &'static str| move |e| Error::io(output, action, e);
        let temporary = tempfile::Builder::new()
            .prefix(".outcrop-")
            .suffix(".tmp")
            .permissions(mode())
            .tempfile_in(folder)
            .map_err(io("create a file beside it"))?;
        let (file, temporary) = temporary.into_parts();
        file.set_len(bytes).map_err(io("make room for the mesh"))?;
        file.write_all_at(header.as_bytes(), 0)
            .map_err(io("write the header"))?;
        workspace.io.add_written(header.len() as u64);
        Ok(Self {
            output: output.to_path_buf(),
            temporary: Some(temporary),
            file,
            header: header.len() as u64,
            vertices: stats.vertices,
            coordinates,
            io: workspace.io.clone(),
        })
    }

    fn write(&self, bytes: &[u8], offset: u64) -> Result<()> {
        self.io.add_written(bytes.len() as u64);
        self.file.write_all_at(bytes, offset).map_err(|e| {
            Error::io(
                &self.output,
                format!("write {} bytes at {offset}", bytes.len()),
                e,
            )
        })
    }

    /// Bytes of a vertex.
    pub fn vertex_bytes(&self) -> usize {
        3 * self.coordinates.bytes() as usize
    }

    /// Appends the bytes of a vertex to `bytes`.
    #[inline]
    pub fn encode_vertex(&self, position: [f64; 3], bytes: &mut Vec<u8>) {
        match self.coordinates {
            CoordinateType::Float => {
                let words = position.map(|x| (x as f32).to_le_bytes());
                bytes.extend_from_slice(words.as_flattened());
            }
            CoordinateType::Double => {
                bytes.extend_from_slice(position.map(f64::to_le_bytes).as_flattened());
            }
        }
    }

    /// Writes vertices from number `first` on.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_vertices(&self, first: u64, bytes: &[u8]) -> Result<()> {
        self.write(bytes, self.header + first * 3 * self.coordinates.bytes())
    }

    /// Writes triangles from number `first` on, as [`encode_face`] makes them.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_faces(&self, first: u64, bytes: &[u8]) -> Result<()> {
        let faces = self.header + self.vertices * 3 * self.coordinates.bytes();
        self.write(bytes, faces + first * FACE)
    }

    /// Makes the file durable and gives it its name.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        self.file
            .sync_all()
            .map_err(|e| Error::io(&self.output, "sync", e))?;
        if let Some(temporary) = self.temporary.take() {
            temporary
                .persist(&self.output)
                .map_err(|e| Error::io(&self.output, "rename the finished file to it", e.error))?;
        }
        let folder = folder_of(&self.output);
        File::open(folder)
            .and_then(|f| f.sync_all())
            .map_err(|e| Error::io(folder, "sync the folder", e))
    }
}

/// The folder that holds `path`.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A mesh is an ordinary file, unlike scratch: readable as the user's mask allows.
fn mode() -> std::fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}
