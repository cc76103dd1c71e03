//! Meshes that are not read where they are: each is read once, in bounded memory, into a PLY file in the scratch
//! folder, binary and of triangles, which is then read like any other.

mod glb;
mod obj;
mod ply;
mod spool;
mod stl;
mod stream;
#[cfg(test)]
mod tests;
mod weld;

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::compressed::plain_name;
use outcrop_platform::{FileAt, modified};
use spool::Spool;
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Stl,
    Glb,
}

/// The format of a file with this name, which may have an ending of compression, and this beginning; none if it is
/// none of these.
fn format(path: &Path, head: &[u8]) -> Option<Format> {
    if head.starts_with(b"glTF") {
        return Some(Format::Glb);
    }
    let name = plain_name(path);
    let extension = name.extension()?.to_str()?.to_ascii_lowercase();
    match &*extension {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}

/// True for the name and the first bytes of a mesh that is read here.
pub fn is_foreign(path: &Path, head: &[u8]) -> bool {
    format(path, head).is_some()
}

/// A mesh file: the name that is shown in messages, and the file with its content.
struct Mesh<'a> {
    shown: &'a Path,
    file: File,
    bytes: u64,
    workspace: &'a Workspace,
}

impl<'a> Mesh<'a> {
    fn open(shown: &'a Path, content: &Path, workspace: &'a Workspace) -> Result<Self> {
        let io = |action: &'static str| move |e| Error::io(shown, action, e);
        let file = File::open(content).map_err(io("open"))?;
        let bytes = file.metadata().map_err(io("read the size of"))?.len();
        Ok(Self {
            shown,
            file,
            bytes,
            workspace,
        })
    }

    /// The PLY file that `read` fills, or has filled before.
    fn spooled(&self, read: impl FnOnce(&mut Spool<'_>) -> Result<()>) -> Result<PathBuf> {
        let about = std::fs::metadata(self.shown);
        let about = about.map_err(|e| Error::io(self.shown, "read the size of", e))?;
        let mut hasher = DefaultHasher::new();
        (self.shown, about.len(), modified(&about)).hash(&mut hasher);
        let name = format!("mesh-{:016x}", hasher.finish());
        if let Some(path) = spool::finished(&name, self.workspace)? {
            return Ok(path);
        }
        let mut spool = Spool::new(self, &name)?;
        read(&mut spool)?;
        spool.finish()
    }

    fn error(&self, place: impl Into<String>, found: impl Into<String>, expected: &str) -> Error {
        Error::input(self.shown, place, found, expected)
    }

    /// Fills `bytes` from `offset`.
    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        self.workspace.check_cancel()?;
        let read = self.file.read_exact_at(bytes, offset);
        read.map_err(|e| Error::io(self.shown, "read", e))?;
        self.workspace.io.add_read(bytes.len() as u64);
        Ok(())
    }
}

/// The PLY file in the scratch folder with the mesh of the file `shown`, whose content, if that was compressed, is in
/// the file `content`; none if that is in none of the formats here. A mesh is read once in a workspace, unless its file changes.
///
/// # Errors
/// [`Error::Input`] if it is damaged or has what is not read; [`Error::TooLarge`]; [`Error::Memory`], [`Error::Disk`],
/// [`Error::Io`], [`Error::Cancelled`].
pub fn as_ply(shown: &Path, content: &Path, workspace: &Workspace) -> Result<Option<PathBuf>> {
    let mesh = Mesh::open(shown, content, workspace)?;
    let mut head = [0; 4];
    let known = head.len().min(mesh.bytes as usize);
    let read = mesh.file.read_exact_at(&mut head[..known], 0);
    read.map_err(|e| Error::io(shown, "read", e))?;
    let Some(format) = format(shown, &head[..known]) else {
        return Ok(None);
    };
    let ply = mesh.spooled(|spool| {
        match format {
            Format::Obj => obj::read(&mesh, spool)?,
            Format::Stl => stl::read(&mesh, spool)?,
            Format::Glb => glb::read(&mesh, spool)?,
        }
        spool.check_content()
    })?;
    Ok(Some(ply))
}

/// As [`as_ply`], of a mesh in PLY that is not read where it is.
///
/// # Errors
/// See [`as_ply`].
pub fn as_plain_ply(shown: &Path, content: &Path, workspace: &Workspace) -> Result<PathBuf> {
    let mesh = Mesh::open(shown, content, workspace)?;
    mesh.spooled(|spool| ply::read(&mesh, content, spool))
}
