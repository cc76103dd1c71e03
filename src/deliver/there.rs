//! The place of an output behind a URL, and its files on this machine.

use super::noted::{Note, Notes};
use super::{Kind, SCRATCH, TREE, scratch_of};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::Observer;
use outcrop_mesh_files::export::is_square_of;
use outcrop_platform::{is_private, make_private_folder};
use outcrop_points::is_remote;
use outcrop_remote::{Bucket, Location};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most files of an earlier tileset.
const MOST: usize = 1 << 20;

/// Bytes of a tileset in which it says by whom it was made.
const HEAD: usize = 4096;

/// An output behind a URL, and its files on this machine.
#[derive(Debug)]
pub(crate) struct Delivery {
    /// The URL as it was given.
    pub(super) url: PathBuf,
    pub(super) kind: Kind,
    /// The folder in the store in which the files lie, and the name of the mesh there.
    pub(super) folder: Location,
    name: String,
    /// The folder with everything: the files, and notes about uploads.
    staging: PathBuf,
    /// The output on this machine.
    local: PathBuf,
    scratch: PathBuf,
}

impl Delivery {
    /// The delivery of an output; none if that is a path. Scratch files are in `parent`, or in the folder `scratch` of a
    /// run that goes on.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a URL that takes no files.
    pub(crate) fn of(
        output: &Path,
        kind: Kind,
        parent: Option<&Path>,
        scratch: Option<&Path>,
    ) -> Result<Option<Self>> {
        let usual = match scratch_of(output, parent) {
            Some(usual) => usual,
            None => return Ok(None),
        };
        let at = location("output", output)?;
        let (folder, name) = match kind {
            Kind::Folder => (at, String::new()),
            Kind::Mesh => match at.parted() {
                // A run names the file of a tileset, whose folder is written.
                Some((folder, name)) if name == TREE => (folder, name),
                Some(parted) => parted,
                None => {
                    let expected = "the URL of a file, such as s3://bucket/mesh.ply";
                    return Err(refused("output", output, expected));
                }
            },
        };
        let kind = if name == TREE { Kind::Folder } else { kind };
        let scratch = scratch.map_or(usual, Path::to_path_buf);
        let start = scratch.to_string_lossy();
        let start = Path::new(start.strip_suffix(SCRATCH).unwrap_or(&start));
        let staging = ended(start, ".outcrop-upload");
        Ok(Some(Self {
            url: output.to_path_buf(),
            kind,
            folder,
            local: match name.as_str() {
                "" => staging.join(FILES),
                name => staging.join(FILES).join(name),
            },
            name,
            staging,
            scratch,
        }))
    }

    /// The output on this machine.
    pub(crate) fn local(&self) -> &Path {
        &self.local
    }

    /// The output as it was given.
    pub(crate) fn url(&self) -> &Path {
        &self.url
    }

    /// The scratch folder of the run.
    pub(crate) fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// Refuses an output that is one of the inputs, or may be.
    pub(crate) fn refuse_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        for input in inputs.iter().filter(|input| is_remote(input)) {
            let at = location("input", input)?;
            let Some((folder, name)) = at.parted() else {
                continue;
            };
            let name = self.local.with_file_name(name);
            if folder == self.folder && (name == self.local || is_square_of(&self.local, &name)) {
                let expected = "another name than that of an input";
                return Err(refused("output", &self.url, expected));
            }
        }
        Ok(())
    }

    /// Makes the folder of the files.
    pub(crate) fn prepare(&self) -> Result<()> {
        let failed = |e| Error::io(&self.staging, "make the folder", e);
        if let Some(parent) = self.staging.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        match make_private_folder(&self.staging) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                let about = self.staging.symlink_metadata().map_err(failed)?;
                if !about.is_dir() || !is_private(&self.staging, &about).map_err(failed)? {
                    let why = "it is open to other users, so what is in it cannot be trusted";
                    return Err(Error::not_resumable(&self.staging, why));
                }
            }
            made => made.map_err(failed)?,
        }
        std::fs::create_dir_all(self.files_folder()).map_err(failed)
    }

    /// Begins anew: gives up what an earlier run left, and makes sure that the store takes the output.
    pub(crate) fn begin(&self, observer: &dyn Observer) -> Result<()> {
        if let Some((file, _, e)) = self.give_up(observer)?.pop() {
            let at = self.folder.below(&file).to_string();
            return Err(Error::io(at, "give up an unfinished upload to", e));
        }
        let emptied = std::fs::remove_dir_all(&self.staging);
        emptied.map_err(|e| Error::io(&self.staging, "empty", e))?;
        self.prepare()?;
        let bucket = self.bucket(false)?;
        if self.kind == Kind::Folder {
            self.check_folder()?;
        }
        // Without this a run would find out after hours that it must not write.
        let probe = match self.kind {
            Kind::Folder => TREE,
            Kind::Mesh => &self.name,
        };
        if let Some(upload) = self.begun(&bucket, probe, observer)? {
            let at = self.folder.below(probe);
            let aborted = bucket.abort(&at, &upload);
            aborted.map_err(|e| Error::io(&self.url, "give up an upload to", e))?;
            let file = probe.to_owned();
            self.notes().add(&Note::Gone { file })?;
        }
        Ok(())
    }

    /// Removes everything on this machine; what is not whole in the store is given up.
    pub(crate) fn end(&self, observer: &dyn Observer) {
        let failed = match self.give_up(observer) {
            Ok(failed) => failed,
            Err(e) => {
                observer.warn(&format!(
                    "{e}; the store may hold parts of unfinished uploads that they name, so they are kept"
                ));
                let _ = std::fs::remove_dir_all(self.files_folder());
                return;
            }
        };
        // It does no harm if they cannot be deleted.
        let _ = match failed.is_empty() {
            true => std::fs::remove_dir_all(&self.staging),
            false => std::fs::remove_dir_all(self.files_folder()),
        };
        for (file, upload, e) in failed {
            let (at, notes) = (self.folder.below(&file), self.staging.display());
            observer.warn(&format!(
                "{at}: the store may hold parts of an unfinished upload {upload}: {e}; the next run with this output \
                 gives it up, by {notes}"
            ));
        }
    }

    pub(super) fn files_folder(&self) -> PathBuf {
        self.staging.join(FILES)
    }

    pub(super) fn notes(&self) -> Notes {
        Notes::of(&self.staging)
    }

    pub(super) fn bucket(&self, patient: bool) -> Result<Bucket> {
        let bucket = Bucket::of(&self.folder, patient);
        bucket.map_err(|e| Error::io(&self.url, "write", e))
    }

    /// The files in the store below the folder.
    pub(super) fn existing(&self) -> Result<Vec<String>> {
        let folder = self.folder.below("");
        let listed = outcrop_remote::list(&folder, MOST, |_| true, &Arc::default());
        let listed = listed.map_err(|e| Error::io(&self.url, "list the files of", e))?;
        let start = folder.to_string();
        let names = listed
            .into_iter()
            .filter_map(|file| file.url.strip_prefix(&start).map(ToOwned::to_owned));
        Ok(names.collect())
    }

    /// An error unless nothing is there, or a tileset of this program.
    fn check_folder(&self) -> Result<()> {
        let names = self.existing()?;
        if names.is_empty() {
            return Ok(());
        }
        let others = names.iter().any(|n| n != TREE && !n.starts_with("tiles/"));
        let ours = || {
            let tree = outcrop_remote::Object::open(&self.folder.below(TREE), &Arc::default());
            let mut head = [0; HEAD];
            let read = tree.and_then(|tree| tree.read_at(&mut head, 0));
            read.is_ok_and(|n| String::from_utf8_lossy(&head[..n]).contains("\"outcrop\":{"))
        };
        match !others && ours() {
            true => Ok(()),
            false => {
                let expected = "a new or empty prefix, or one with a tileset of outcrop alone";
                Err(refused("output", &self.url, expected))
            }
        }
    }
}

/// A path with an ending after its name.
fn ended(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(ending);
    name.into()
}

/// The folder of the files, in that of the delivery.
const FILES: &str = "files";

/// The media type of a file, for browsers that read it from the store.
pub(super) fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("json") => "application/json",
        Some("html" | "htm") => "text/html; charset=utf-8",
        Some("glb") => "model/gltf-binary",
        Some("stl") => "model/stl",
        Some("obj") => "model/obj",
        Some("prj") => "text/plain",
        Some("zst") => "application/zstd",
        _ => "application/octet-stream",
    }
}

fn refused(name: &'static str, url: &Path, expected: &str) -> Error {
    Error::Parameter {
        name,
        found: url.display().to_string(),
        expected: expected.into(),
    }
}

/// The location of an output. Web servers are refused.
fn location(name: &'static str, url: &Path) -> Result<Location> {
    let expected = "a path, or a URL such as s3://bucket/mesh.ply, gs://… or az://…";
    let at = Location::of(url).map_err(|e| Error::Parameter {
        name,
        found: format!("a URL that cannot be used: {e}"),
        expected: expected.into(),
    })?;
    match at.is_web() && name != "input" {
        true => {
            let expected = format!("{expected}: web servers take no files");
            Err(refused(name, url, &expected))
        }
        false => Ok(at),
    }
}

/// Makes sure that a text file behind a URL can be written; nothing is there before.
///
/// # Errors
/// [`Error::Parameter`] for a URL that takes no files; [`Error::Io`].
pub(crate) fn check_text(url: &Path) -> Result<()> {
    let at = location("report", url)?;
    let failed = |e| Error::io(url, "write the report", e);
    let bucket = Bucket::of(&at, false).map_err(failed)?;
    match bucket.begin(&at, media_type("")) {
        Ok(upload) => bucket.abort(&at, &upload).map_err(failed),
        Err(e) if e.kind() == ErrorKind::Unsupported => Ok(()),
        Err(e) => Err(failed(e)),
    }
}

/// Writes a text file behind a URL.
///
/// # Errors
/// As [`check_text`].
pub(crate) fn put_text(url: &Path, text: &str) -> Result<()> {
    let at = location("report", url)?;
    let bytes = text.as_bytes().to_vec().into();
    let put = Bucket::of(&at, true)
        .and_then(|bucket| bucket.put(&at, bytes, media_type(&url.to_string_lossy())));
    put.map_err(|e| Error::io(url, "write the report", e))
}
