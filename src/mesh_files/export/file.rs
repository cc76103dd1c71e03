//! The mesh file while it is being written: slices at known offsets, under a temporary name.

use super::batch::Batch;
use super::format::{Layout, Mesh, MeshFormat, Positions};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::fault::{self, Event};
use outcrop_disk::workspace::open::{failed_write, open_existing};
use outcrop_disk::workspace::place::{Place, Put};
pub use outcrop_disk::workspace::temporary;
use outcrop_disk::workspace::{OUTPUT, RENAMED, Unit, Workspace, limits};
use outcrop_platform::{FileAt, public_options, sync_folder};
use std::fs::File;
use std::io::ErrorKind::NotFound;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A triangle with the positions of its corners.
pub type Placed = ([u32; 3], Positions);

/// A mesh file under its temporary name. It is deleted if it is dropped unfinished, except in a run that can
/// be resumed.
pub struct MeshFile<'a> {
    output: PathBuf,
    temporary: PathBuf,
    /// `None` if the mesh already has its final name.
    file: Option<File>,
    format: &'static dyn MeshFormat,
    mesh: Mesh,
    /// Its name in the journal.
    name: String,
    /// True if dropping it deletes an unfinished file.
    owned: bool,
    /// The offsets of its parts.
    pub layout: Layout,
    workspace: &'a Workspace,
}

/// The temporary name of a mesh if tasks share the run: each attempt at the mesh has a number.
#[must_use]
pub fn temporary_of(output: &Path, number: u32) -> PathBuf {
    let mut path = temporary(output).into_os_string();
    path.push(format!(".{number}"));
    path.into()
}

/// Bytes at the beginning or the end of a part that share a page with other parts, and their offset.
pub type Edge = (u64, Vec<u8>);

/// Bytes of a page. Two machines must not write to one page of a file.
const PAGE: u64 = 4096;

/// The whole pages of a part, and the edges that share pages with others.
fn pages(bytes: &[u8], offset: u64) -> (Range<usize>, [Range<usize>; 2]) {
    let end = offset + bytes.len() as u64;
    let (first, last) = (offset.next_multiple_of(PAGE), end / PAGE * PAGE);
    if first >= last {
        return (0..0, [0..bytes.len(), 0..0]);
    }
    let whole = (first - offset) as usize..(last - offset) as usize;
    let edges = [0..whole.start, whole.end..bytes.len()];
    (whole, edges)
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
            name: OUTPUT.to_owned(),
            owned: true,
            workspace,
        };
        let known = workspace.places(OUTPUT);
        let mut new = known.is_empty();
        if let Some(own) = workspace.shared_number() {
            new = false;
            let make = |_: &Unit<'_>| {
                new = true;
                Ok(own)
            };
            let number = workspace.once("file", make)?;
            file.temporary = temporary_of(output, number);
        }
        if new {
            file.begin()?;
        } else {
            // All parts were verified, in the temporary or in the final file.
            match open_existing(&file.temporary) {
                Ok(found) => file.file = Some(found),
                Err(e) if e.kind() == NotFound => {
                    // Another process may have given it its name; what is written again are the same bytes.
                    let size = output.metadata().map_or(0, |meta| meta.len());
                    if workspace.is_shared() && size == file.layout.bytes {
                        file.file = open_existing(output).ok();
                    }
                }
                Err(e) => return Err(Error::io(&file.temporary, "open", e)),
            }
        }
        Ok(file)
    }

    /// Opens the file of one of several meshes, or creates it; `name` is its name in the journal.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn one_of_several(
        output: &Path,
        temporary: PathBuf,
        name: String,
        format: &'static dyn MeshFormat,
        mesh: Mesh,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        // Several threads may do this at the same time.
        let file = public_options().create(true).open(&temporary);
        let file = file.map_err(|e| Error::io(output, "create a file beside it", e))?;
        workspace.touched(&temporary);
        Ok(Self {
            output: output.to_path_buf(),
            temporary,
            file: Some(file),
            layout: format.layout(&mesh),
            format,
            mesh,
            name,
            owned: false,
            workspace,
        })
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
        let file = public_options()
            .create_new(true)
            .open(&self.temporary)
            .map_err(|e| Error::io(&self.output, "create a file beside it", e))?;
        // The size of a compressed mesh is unknown.
        let compressed = self.mesh.compress || is_compressed(&self.output);
        let length = if compressed { 0 } else { bytes };
        let room = fault::fallible(Event::Write).and_then(|()| file.set_len(length));
        room.map_err(|e| match failed_write(&self.output, 0, bytes, e) {
            Error::Io { source, .. } => Error::io(&self.output, "make room for the mesh", source),
            full => full,
        })?;
        self.workspace.touched(&self.temporary);
        self.file = Some(file);
        Ok(())
    }

    /// Writes encoded `bytes` at `offset`, as part `part` of the mesh. A task only writes whole pages; the
    /// edges are returned.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn write(
        &self,
        unit: &Unit<'_>,
        part: u32,
        bytes: &[u8],
        offset: u64,
    ) -> Result<Vec<Edge>> {
        if unit.is_task() {
            let (whole, edges) = pages(bytes, offset);
            self.put(&bytes[whole.clone()], offset + whole.start as u64)?;
            unit.touched(&self.temporary);
            let edges = edges.into_iter().filter(|edge| !edge.is_empty());
            let edges = edges.map(|edge| (offset + edge.start as u64, bytes[edge].to_vec()));
            return Ok(edges.collect());
        }
        self.put(bytes, offset)?;
        let resumable = unit.is_resumable();
        let place = Place {
            offset,
            bytes: bytes.len(),
            crc: if resumable { crc32fast::hash(bytes) } else { 0 },
            ..Place::default()
        };
        self.note(unit, part, place);
        Ok(Vec::new())
    }

    /// Notes a part of the mesh.
    pub fn note(&self, unit: &Unit<'_>, section: u32, place: Place) {
        unit.note(Put {
            file: self.name.clone(),
            section,
            place,
        });
    }

    /// Writes the edges of parts.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn write_edges(&self, edges: &[Edge]) -> Result<()> {
        let mut edges = edges.iter();
        edges.try_for_each(|(offset, bytes)| self.put(bytes, *offset))
    }

    /// Writes `bytes` at `offset`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn put(&self, bytes: &[u8], offset: u64) -> Result<()> {
        let Some(file) = &self.file else {
            let gone = NotFound.into();
            return Err(Error::io(&self.temporary, "open", gone));
        };
        self.workspace.io.add_written(bytes.len() as u64);
        fault::fallible(Event::Write)
            .and_then(|()| file.write_all_at(bytes, offset))
            .map_err(|e| failed_write(&self.output, bytes.len(), 0, e))
    }

    /// The error of an `action` on the mesh that failed.
    pub fn failed(&self, action: &str, error: std::io::Error) -> Error {
        Error::io(&self.output, action, error)
    }

    /// Appends the encoded vertices to `bytes`; `values` has the values that each has in all columns.
    pub fn encode_vertices(
        &self,
        positions: impl Iterator<Item = [f64; 3]>,
        mut values: &[u8],
        bytes: &mut Vec<u8>,
    ) {
        let each = self.mesh.value_bytes();
        let put = |batch: &[[f64; 3]]| {
            let own;
            (own, values) = values.split_at(batch.len() * each);
            self.format.put_vertices(&self.mesh, batch, own, bytes);
        };
        let mut batch = Batch::new(put);
        positions.for_each(|p| batch.push(p));
        batch.finish();
    }

    /// A batch of triangles that are encoded to the end of `bytes`.
    pub fn triangles(&self, bytes: &mut Vec<u8>) -> Batch<[u32; 3], impl FnMut(&[[u32; 3]])> {
        Batch::new(|batch: &[[u32; 3]]| {
            self.format.put_triangles(&self.mesh, batch, &[], bytes);
        })
    }

    /// A batch of triangles with their positions that are encoded to the end of `bytes`.
    pub fn placed_triangles(&self, bytes: &mut Vec<u8>) -> Batch<Placed, impl FnMut(&[Placed])> {
        Batch::new(|batch: &[Placed]| {
            let (triangles, positions): (Vec<_>, Vec<_>) = batch.iter().copied().unzip();
            self.format
                .put_triangles(&self.mesh, &triangles, &positions, bytes);
        })
    }

    /// True if triangles are written with the positions of their corners.
    pub fn wants_positions(&self) -> bool {
        self.format.wants_positions()
    }

    /// Facts about the mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The error of a mesh that turns out to have more than `most` bytes; its file is deleted.
    pub fn too_large(&self, most: u64) -> Error {
        let _ = std::fs::remove_file(&self.temporary);
        Error::TooLarge {
            path: self.output.clone(),
            format: self.format.name(),
            unit: "bytes",
            most,
            found: "more".into(),
            finished: true,
        }
    }

    /// Bytes of the values that a vertex has in all columns.
    pub fn value_bytes(&self) -> usize {
        self.mesh.value_bytes()
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
                self.note(unit, RENAMED, Place::default());
                Ok(())
            })?;
            fault::point(Event::Rename);
            match outcrop_platform::rename(&self.temporary, &self.output) {
                // Another process may have done it.
                Err(e) if e.kind() == NotFound && self.workspace.is_shared() => {}
                done => {
                    done.map_err(|e| Error::io(&self.output, "rename the finished file to it", e))?
                }
            }
            fault::point(Event::Renamed);
        }
        let folder = folder_of(&self.output);
        sync_folder(folder).map_err(|e| Error::io(folder, "sync the folder", e))
    }
}

impl Drop for MeshFile<'_> {
    fn drop(&mut self) {
        if self.owned && self.file.is_some() && !self.workspace.is_resumable() {
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// The folder of `path`.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_pages_and_edges_are_all_of_a_part_and_edges_are_short() {
        for (offset, length) in [
            (0, 4096),
            (1, 4095),
            (5, 0),
            (100, 9000),
            (4096, 3),
            (4000, 200),
        ] {
            let bytes = vec![0; length];
            let (whole, [head, tail]) = pages(&bytes, offset);
            assert_eq!(whole.len() + head.len() + tail.len(), length);
            let start = offset + whole.start as u64;
            assert!(whole.is_empty() || start.is_multiple_of(PAGE));
            assert!(whole.len().is_multiple_of(PAGE as usize));
            assert!(head.len() < 2 * PAGE as usize && tail.len() < PAGE as usize);
        }
    }
}
