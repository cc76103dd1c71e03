//! The mesh file while it is being written: slices at known offsets, under a temporary name.

use super::format::{Layout, Mesh, MeshFormat};
use crate::error::{Error, Result};
use crate::workspace::fault::{self, Event};
use crate::workspace::open::{failed_write, open_existing, options};
use crate::workspace::place::{Place, Put};
use crate::workspace::{OUTPUT, RENAMED, Unit, Workspace, limits};
use std::fs::File;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Records encoded at a time.
const BATCH: usize = 1024;

/// A mesh file under its temporary name. It is deleted if it is dropped unfinished, except in a run that can
/// be resumed.
pub struct MeshFile<'a> {
    output: PathBuf,
    temporary: PathBuf,
    /// `None` if the mesh already has its final name.
    file: Option<File>,
    format: &'static dyn MeshFormat,
    mesh: Mesh,
    /// The offsets of its parts.
    pub layout: Layout,
    workspace: &'a Workspace,
}

/// The temporary name of a mesh, in the same folder as the final one.
#[must_use]
pub fn temporary(output: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(output.file_name().unwrap_or_default());
    name.push(".outcrop-part");
    folder_of(output).join(name)
}

/// Number of the header among the parts of the mesh, and of the whole of a compressed one.
pub const HEADER: u32 = u32::MAX;

/// True if the name of a mesh asks for Zstandard.
#[must_use]
pub fn is_compressed(output: &Path) -> bool {
    let extension = output.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("zst")
}

impl<'a> MeshFile<'a> {
    /// Creates the file of a mesh beside `output`, or reopens it if an earlier attempt of the run wrote it.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Disk`] if there is no room for the whole file.
    pub fn open(
        output: &Path,
        format: &'static dyn MeshFormat,
        mesh: Mesh,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let mut file = Self {
            temporary: temporary(output),
            output: output.to_path_buf(),
            file: None,
            layout: format.layout(&mesh),
            format,
            mesh,
            workspace,
        };
        let known = workspace.places(OUTPUT);
        if known.is_empty() {
            file.begin()?;
        } else {
            // All parts were verified, in the temporary or in the final file.
            match open_existing(&file.temporary) {
                Ok(found) => file.file = Some(found),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
                Err(e) => return Err(Error::io(&file.temporary, "open", e)),
            }
        }
        Ok(file)
    }

    fn begin(&mut self) -> Result<()> {
        let bytes = self.layout.bytes;
        let folder = folder_of(&self.output);
        if let Some(free) = limits::disk_free(folder).filter(|free| *free < bytes) {
            return Err(Error::Disk {
                path: self.output.clone(),
                needed: bytes,
                free,
            });
        }
        // May remain from an interrupted run whose scratch folder was deleted.
        let _ = std::fs::remove_file(&self.temporary);
        let file = options()
            .mode(0o666)
            .create_new(true)
            .open(&self.temporary)
            .map_err(|e| Error::io(&self.output, "create a file beside it", e))?;
        // The size of a compressed mesh is unknown.
        let length = if is_compressed(&self.output) {
            0
        } else {
            bytes
        };
        let room = fault::write().and_then(|()| file.set_len(length));
        room.map_err(|e| match failed_write(&self.output, 0, bytes, e) {
            Error::Io { source, .. } => Error::io(&self.output, "make room for the mesh", source),
            full => full,
        })?;
        self.file = Some(file);
        Ok(())
    }

    /// Writes encoded `bytes` at `offset`, as part `part` of the mesh.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn write(&self, unit: &Unit<'_>, part: u32, bytes: &[u8], offset: u64) -> Result<()> {
        self.put(bytes, offset)?;
        let resumable = unit.is_resumable();
        let place = Place {
            offset,
            bytes: bytes.len(),
            crc: if resumable { crc32fast::hash(bytes) } else { 0 },
            ..Place::default()
        };
        note(unit, part, place);
        Ok(())
    }

    /// Writes `bytes` at `offset`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn put(&self, bytes: &[u8], offset: u64) -> Result<()> {
        let Some(file) = &self.file else {
            let gone = std::io::ErrorKind::NotFound.into();
            return Err(Error::io(&self.temporary, "open", gone));
        };
        self.workspace.io.add_written(bytes.len() as u64);
        fault::write()
            .and_then(|()| file.write_all_at(bytes, offset))
            .map_err(|e| failed_write(&self.output, bytes.len(), 0, e))
    }

    /// The error of an `action` on the mesh that failed.
    pub fn failed(&self, action: &str, error: std::io::Error) -> Error {
        Error::io(&self.output, action, error)
    }

    /// Appends the encoded vertices to `bytes`.
    pub fn encode_vertices(&self, positions: impl Iterator<Item = [f64; 3]>, bytes: &mut Vec<u8>) {
        let put = |batch: &[[f64; 3]]| self.format.put_vertices(&self.mesh, batch, bytes);
        let mut batch = Batch::new(put);
        positions.for_each(|p| batch.push(p));
        batch.finish();
    }

    /// A batch of triangles that are encoded to the end of `bytes`.
    pub fn triangles(&self, bytes: &mut Vec<u8>) -> Batch<[u32; 3], impl FnMut(&[[u32; 3]])> {
        Batch::new(|batch: &[[u32; 3]]| self.format.put_triangles(&self.mesh, batch, bytes))
    }

    /// Flushes the file to disk and renames it to its final name.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        if let Some(file) = self.file.take() {
            file.sync_all()
                .map_err(|e| Error::io(&self.output, "sync", e))?;
            let step = self.workspace.step("rename")?;
            step.finish(0, &(), |unit| {
                note(unit, RENAMED, Place::default());
                Ok(())
            })?;
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

/// Notes a part of the mesh.
pub fn note(unit: &Unit<'_>, section: u32, place: Place) {
    unit.note(Put {
        file: OUTPUT.to_owned(),
        section,
        place,
    });
}

/// Collects records and passes them on in batches.
pub struct Batch<T, F: FnMut(&[T])> {
    records: Vec<T>,
    put: F,
}

impl<T, F: FnMut(&[T])> Batch<T, F> {
    fn new(put: F) -> Self {
        Self {
            records: Vec::with_capacity(BATCH),
            put,
        }
    }

    /// Adds a record.
    #[inline]
    pub fn push(&mut self, record: T) {
        self.records.push(record);
        if self.records.len() == BATCH {
            (self.put)(&self.records);
            self.records.clear();
        }
    }

    /// Passes on the remaining records.
    pub fn finish(mut self) {
        (self.put)(&self.records);
    }
}

/// The folder of `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
