//! Meshes in other formats than PLY: each is read once, in bounded memory, into a PLY file in the scratch folder,
//! which is then read like any other.

mod glb;
mod obj;
mod spool;
mod stl;
#[cfg(test)]
mod tests;
mod weld;

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::compressed::plain_name;
use spool::Spool;
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::os::unix::fs::FileExt;
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

impl Mesh<'_> {
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
/// the file `content`; none if that is in none of the formats here. A mesh is read once in a workspace.
///
/// # Errors
/// [`Error::Input`] if it is damaged or has what is not read; [`Error::TooLarge`]; [`Error::Memory`], [`Error::Disk`],
/// [`Error::Io`], [`Error::Cancelled`].
pub fn as_ply(shown: &Path, content: &Path, workspace: &Workspace) -> Result<Option<PathBuf>> {
    let io = |action: &'static str| move |e| Error::io(shown, action, e);
    let file = File::open(content).map_err(io("open"))?;
    let bytes = file.metadata().map_err(io("read the size of"))?.len();
    let mut head = [0; 4];
    let known = head.len().min(bytes as usize);
    file.read_exact_at(&mut head[..known], 0)
        .map_err(io("read"))?;
    let Some(format) = format(shown, &head[..known]) else {
        return Ok(None);
    };
    let mut hasher = DefaultHasher::new();
    shown.hash(&mut hasher);
    let name = format!("mesh-{:016x}", hasher.finish());
    if let Some(path) = spool::finished(&name, workspace)? {
        return Ok(Some(path));
    }
    let mesh = Mesh {
        shown,
        file,
        bytes,
        workspace,
    };
    let mut spool = Spool::new(&mesh, &name)?;
    match format {
        Format::Obj => obj::read(&mesh, &mut spool)?,
        Format::Stl => stl::read(&mesh, &mut spool)?,
        Format::Glb => glb::read(&mesh, &mut spool)?,
    }
    spool.finish().map(Some)
}
