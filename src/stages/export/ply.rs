//! Binary little-endian PLY, written in slices at known offsets.

use super::MeshStats;
use crate::error::{Error, Result};
use crate::workspace::fault::{self, Event};
use crate::workspace::open::{failed_write, open_existing, options};
use crate::workspace::place::{Place, Put};
use crate::workspace::{OUTPUT, RENAMED, Workspace, limits};
use std::fs::File;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Type of the coordinates in the file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CoordinateType {
    /// 32-bit floats.
    #[default]
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

/// A mesh file under its temporary name. It is deleted unless finished, but for a run that can be
/// resumed.
pub struct MeshFile<'a> {
    output: PathBuf,
    temporary: PathBuf,
    /// None if the mesh has its name already.
    file: Option<File>,
    header: u64,
    vertices: u64,
    coordinates: CoordinateType,
    workspace: &'a Workspace,
}

/// The mesh's name until it is finished, beside its last one.
#[must_use]
pub fn temporary(output: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(output.file_name().unwrap_or_default());
    name.push(".outcrop-part");
    folder_of(output).join(name)
}

/// The number of the header among the parts of the mesh.
const HEADER: u32 = u32::MAX;

impl<'a> MeshFile<'a> {
    /// Writes the header of a mesh with the counts of `stats` beside `output`, or opens the file in
    /// which an earlier attempt at the run did.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Disk`] if there is no room for the whole file.
    pub fn open(
        output: &Path,
        coordinates: CoordinateType,
        stats: &MeshStats,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let header = header(coordinates, stats);
        let bytes =
            header.len() as u64 + stats.vertices * 3 * coordinates.bytes() + stats.triangles * FACE;
        let mut mesh = Self {
            temporary: temporary(output),
            output: output.to_path_buf(),
            file: None,
            header: header.len() as u64,
            vertices: stats.vertices,
            coordinates,
            workspace,
        };
        let known = workspace.places(OUTPUT);
        if known.is_empty() {
            mesh.begin(&header, bytes)?;
        } else {
            // Every part was checked, in one file or the other.
            match open_existing(&mesh.temporary) {
                Ok(file) => {
                    mesh.file = Some(file);
                    mesh.write(HEADER, header.as_bytes(), 0)?;
                }
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
                Err(e) => return Err(Error::io(&mesh.temporary, "open", e)),
            }
        }
        Ok(mesh)
    }

    fn begin(&mut self, header: &str, bytes: u64) -> Result<()> {
        let folder = folder_of(&self.output);
        if let Some(free) = limits::disk_free(folder).filter(|free| *free < bytes) {
            return Err(Error::Disk {
                path: self.output.clone(),
                needed: bytes,
                free,
            });
        }
        // Left by a run that died, and whose scratch folder is gone.
        let _ = std::fs::remove_file(&self.temporary);
        let file = options()
            .mode(0o666)
            .create_new(true)
            .open(&self.temporary)
            .map_err(|e| Error::io(&self.output, "create a file beside it", e))?;
        let room = fault::write().and_then(|()| file.set_len(bytes));
        room.map_err(|e| match failed_write(&self.output, 0, bytes, e) {
            Error::Io { source, .. } => Error::io(&self.output, "make room for the mesh", source),
            full => full,
        })?;
        self.file = Some(file);
        self.write(HEADER, header.as_bytes(), 0)
    }

    fn write(&self, part: u32, bytes: &[u8], offset: u64) -> Result<()> {
        let Some(file) = &self.file else {
            let gone = std::io::ErrorKind::NotFound.into();
            return Err(Error::io(&self.temporary, "open", gone));
        };
        self.workspace.io.add_written(bytes.len() as u64);
        fault::write()
            .and_then(|()| file.write_all_at(bytes, offset))
            .map_err(|e| failed_write(&self.output, bytes.len(), 0, e))?;
        let place = Place {
            offset,
            bytes: bytes.len(),
            records: 0,
            crc: if self.workspace.is_resumable() {
                crc32fast::hash(bytes)
            } else {
                0
            },
        };
        self.put(part, place)
    }

    fn put(&self, section: u32, place: Place) -> Result<()> {
        let file = OUTPUT.into();
        self.workspace.put(Put {
            file,
            section,
            place,
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

    /// Writes vertices from number `first` on, as part `part` of the mesh.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_vertices(&self, part: u32, first: u64, bytes: &[u8]) -> Result<()> {
        self.write(
            part,
            bytes,
            self.header + first * 3 * self.coordinates.bytes(),
        )
    }

    /// Writes triangles from number `first` on, as part `part` of the mesh, as [`encode_face`] makes them.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_faces(&self, part: u32, first: u64, bytes: &[u8]) -> Result<()> {
        let faces = self.header + self.vertices * 3 * self.coordinates.bytes();
        self.write(part, bytes, faces + first * FACE)
    }

    /// Makes the file durable and gives it its name.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        if let Some(file) = self.file.take() {
            file.sync_all()
                .map_err(|e| Error::io(&self.output, "sync", e))?;
            let step = self.workspace.step("rename")?;
            step.finish(0, &(), || self.put(RENAMED, Place::default()))?;
            fault::point(Event::Rename);
            std::fs::rename(&self.temporary, &self.output)
                .map_err(|e| Error::io(&self.output, "rename the finished file to it", e))?;
            fault::point(Event::Renamed);
        }
        let folder = folder_of(&self.output);
        File::open(folder)
            .and_then(|f| f.sync_all())
            .map_err(|e| Error::io(folder, "sync the folder", e))
    }
}

impl Drop for MeshFile<'_> {
    fn drop(&mut self) {
        if self.file.is_some() && !self.workspace.is_resumable() {
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

fn header(coordinates: CoordinateType, stats: &MeshStats) -> String {
    // A file with up to 2^31 vertices can use the index type that every reader knows.
    let index = if stats.vertices <= 1 << 31 {
        "int"
    } else {
        "uint"
    };
    let scalar = coordinates.name();
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by outcrop {}\n\
         element vertex {}\nproperty {scalar} x\nproperty {scalar} y\nproperty {scalar} z\n\
         element face {}\nproperty list uchar {index} vertex_indices\nend_header\n",
        env!("CARGO_PKG_VERSION"),
        stats.vertices,
        stats.triangles,
    )
}

/// The folder that holds `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
