//! Sending the finished files of an output to a store.

use super::noted::Note;
use super::there::{Delivery, media_type};
use super::{Kind, TREE, Uploaded};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_mesh_files::export::is_compressed;
use outcrop_platform::FileAt;
use outcrop_remote::{Bucket, Location, Object, Whole};
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;

/// Bytes of a part: at 100 MB/s it takes 80 ms, of which 10 are spent waiting, and 1000 parts are 8 GB. Stores want at
/// least 5 MiB.
const PART: u64 = 8 << 20;

/// Most parts of a file that all stores take.
const MOST_PARTS: u64 = 10_000;

/// How many times a store may forget an upload that goes on.
const ATTEMPTS: usize = 3;

/// Most bytes of a file that tells the origin of a mesh.
const LONGEST: u64 = 1 << 20;

/// A file that is sent.
struct Sent {
    /// Its name below the folder, with slashes.
    name: String,
    bytes: u64,
}

/// The size of the parts of a file.
fn part_of(bytes: u64) -> u64 {
    PART.max(bytes.div_ceil(MOST_PARTS).next_multiple_of(1 << 20))
}

impl Delivery {
    /// The bytes of the finished files.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn bytes(&self) -> Result<u64> {
        Ok(self.files()?.iter().map(|file| file.bytes).sum())
    }

    /// The finished files. The one that tells that all are there is the last.
    fn files(&self) -> Result<Vec<Sent>> {
        let mut files = Vec::new();
        collect(&self.files_folder(), "", &mut files)
            .map_err(|e| Error::io(self.files_folder(), "list", e))?;
        let mesh = self.local().file_name().unwrap_or_default();
        let is_last = |name: &str| name == TREE || name.ends_with(".index.json") || *name == *mesh;
        files.sort_by(|a, b| (is_last(&a.name), &a.name).cmp(&(is_last(&b.name), &b.name)));
        Ok(files)
    }

    /// Sends all files. Finished ones, and finished parts of large ones, are not sent again by a resumed run.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Memory`], [`Error::Cancelled`].
    pub(crate) fn send(
        &self,
        workspace: &Workspace,
        warn: &mut dyn FnMut(String),
    ) -> Result<Uploaded> {
        let files = self.files()?;
        let bucket = self.bucket(true)?;
        let (Some(last), before) = (files.last(), &files[..files.len().saturating_sub(1)]) else {
            return Err(Error::io(self.local(), "find", ErrorKind::NotFound.into()));
        };
        let mut earlier = Vec::new();
        if self.kind == Kind::Folder {
            // While tiles are replaced, no tree tells of them.
            earlier = workspace.once("earlier files", |_| {
                let names = self.existing()?;
                self.delete(&bucket, names.iter().filter(|name| *name == TREE))?;
                Ok(names)
            })?;
        }
        let names = earlier
            .iter()
            .map(|name| (size_of::<String>() + name.len()) as u64);
        let _names = workspace.reserve("upload: earlier files", names.sum())?;
        let (small, large): (Vec<&Sent>, Vec<&Sent>) =
            before.iter().partition(|file| file.bytes <= PART);
        self.small("small files", &small, &bucket, workspace)?;
        for file in large {
            self.large(file, &bucket, workspace, warn)?;
        }
        match last.bytes <= PART {
            true => self.small("last file", &[last], &bucket, workspace)?,
            false => self.large(last, &bucket, workspace, warn)?,
        }
        let is_old = |name: &&String| !files.iter().any(|file| file.name == **name);
        self.delete(&bucket, earlier.iter().filter(is_old))?;
        if self.kind == Kind::Mesh {
            self.beside(&files, &bucket, warn);
        }
        Ok(Uploaded {
            files: files.len() as u64,
            bytes: files.iter().map(|file| file.bytes).sum(),
            requests: bucket.requests(),
        })
    }

    fn delete<'n>(&self, bucket: &Bucket, names: impl Iterator<Item = &'n String>) -> Result<()> {
        for name in names {
            let at = self.folder.below(name);
            let deleted = bucket.delete(&at);
            deleted.map_err(|e| Error::io(at.to_string(), "delete", e))?;
        }
        Ok(())
    }

    /// Sends files that take one request each, side by side.
    fn small(
        &self,
        step: &'static str,
        files: &[&Sent],
        bucket: &Bucket,
        workspace: &Workspace,
    ) -> Result<()> {
        let bytes = |n: usize| files[n].bytes;
        let work = |unit: &Unit<'_>| {
            let file = files[unit.number()];
            let _held = unit.hold(file.bytes);
            self.whole(file, bucket)?;
            unit.advance(file.bytes);
            Ok(())
        };
        workspace.units((step, "upload"), files.len(), bytes, work, |_, ()| Ok(()))
    }

    /// Sends a file at once; its bytes are reserved.
    fn whole(&self, file: &Sent, bucket: &Bucket) -> Result<()> {
        let at = self.folder.below(&file.name);
        let path = self.files_folder().join(&file.name);
        let bytes = std::fs::read(&path).map_err(|e| Error::io(&path, "read", e))?;
        let put = bucket.put(&at, bytes.into(), media_type(&file.name));
        put.map_err(|e| failed(&at, e))
    }

    /// Sends a file in parts.
    fn large(
        &self,
        file: &Sent,
        bucket: &Bucket,
        workspace: &Workspace,
        warn: &mut dyn FnMut(String),
    ) -> Result<()> {
        let step = format!("file {}", file.name);
        let mut warnings: Vec<String> = workspace.once(&step, |_| {
            for attempt in 1.. {
                match self.in_parts(file, bucket, workspace) {
                    Err(Error::Io { source, .. })
                        if source.kind() == ErrorKind::NotFound && attempt < ATTEMPTS =>
                    {
                        // The store has forgotten the upload.
                        let file = file.name.clone();
                        self.notes().add(&Note::Gone { file })?;
                    }
                    Ok(false) => return self.without_parts(file, bucket, workspace),
                    done => return done.map(|_| Vec::new()),
                }
            }
            Ok(Vec::new())
        })?;
        warnings.drain(..).for_each(warn);
        Ok(())
    }

    /// Sends a file at once to a store that knows no parts.
    fn without_parts(
        &self,
        file: &Sent,
        bucket: &Bucket,
        workspace: &Workspace,
    ) -> Result<Vec<String>> {
        let _held = workspace.reserve("upload: whole file", file.bytes)?;
        self.whole(file, bucket)?;
        workspace.observer.advance(file.bytes);
        let at = self.folder.below(&file.name);
        Ok(vec![format!(
            "{at}: the store takes no files in parts, so that it was sent at once, from memory"
        )])
    }

    /// False if the store knows no parts.
    fn in_parts(&self, file: &Sent, bucket: &Bucket, workspace: &Workspace) -> Result<bool> {
        let (notes, at) = (self.notes(), self.folder.below(&file.name));
        if notes.state(&file.name)?.whole {
            return Ok(true);
        }
        let Some(upload) = self.begun(bucket, &file.name, &*workspace.observer)? else {
            return Ok(false);
        };
        let state = notes.state(&file.name)?;
        // The parts of one upload are of no use for another.
        let step = format!("upload {}", state.count);
        let sent = self.parts(file, (step, &upload), bucket, workspace);
        let done = sent.and_then(|tags| {
            let done = bucket.complete(&at, &upload, tags);
            done.map_err(|e| failed(&at, e))
        });
        let is_there = || {
            let there = bucket.existing(&at).ok().flatten();
            there.is_some_and(|there| there.bytes == file.bytes && there.tag != state.before)
        };
        match done {
            // The answer to an earlier request to complete it was lost, perhaps with the process.
            Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound && is_there() => {
            }
            done => done?,
        }
        let name = file.name.clone();
        notes.add(&Note::Whole { file: name })?;
        Ok(true)
    }

    /// Sends the parts of an upload, side by side; returns their tags.
    fn parts(
        &self,
        file: &Sent,
        (step, upload): (String, &str),
        bucket: &Bucket,
        workspace: &Workspace,
    ) -> Result<Vec<String>> {
        let at = self.folder.below(&file.name);
        let path = self.files_folder().join(&file.name);
        let local = File::open(&path).map_err(|e| Error::io(&path, "open", e))?;
        let part = part_of(file.bytes);
        let count = file.bytes.div_ceil(part) as usize;
        let range = |n: usize| {
            let start = n as u64 * part;
            (start, part.min(file.bytes - start))
        };
        let put = |unit: &Unit<'_>| {
            let (start, bytes) = range(unit.number());
            let _held = unit.hold(bytes);
            let mut buffer = vec![0; bytes as usize];
            let read = local.read_exact_at(&mut buffer, start);
            read.map_err(|e| Error::io(&path, "read", e))?;
            let tag = bucket.put_part(&at, upload, unit.number(), buffer.into());
            unit.advance(bytes);
            tag.map_err(|e| failed(&at, e))
        };
        let mut tags = vec![String::new(); count];
        let keep = |n: usize, tag| {
            tags[n] = tag;
            Ok(())
        };
        workspace.units((step, "upload"), count, |n| range(n).1, put, keep)?;
        Ok(tags)
    }

    /// Deletes the file of the origin that an earlier mesh of this name left in the store; warns of what it leaves there.
    fn beside(&self, files: &[Sent], bucket: &Bucket, warn: &mut dyn FnMut(String)) {
        let local = self.local();
        let plain = match is_compressed(local) {
            true => local.with_extension(""),
            false => local.to_path_buf(),
        };
        let stem = plain.file_stem().unwrap_or_default().to_string_lossy();
        let mesh = local.file_name().unwrap_or_default().to_string_lossy();
        for ending in ["origin.json", "prj"] {
            let name = format!("{stem}.{ending}");
            let at = self.folder.below(&name);
            let is_new = files.iter().any(|file| file.name == name);
            if is_new || !bucket.existing(&at).is_ok_and(|there| there.is_some()) {
                continue;
            }
            let done = match ending == "origin.json" && tells_of(&at, &mesh) {
                true => bucket
                    .delete(&at)
                    .map(|()| "deleted, it was of an earlier mesh of this name"),
                false => Ok("it stays; this mesh has no such file"),
            };
            match done {
                Ok(done) => warn(format!("{at}: {done}")),
                Err(e) => warn(format!(
                    "{at}: it is of an earlier mesh, and cannot be deleted: {e}"
                )),
            }
        }
    }
}

/// True if a file tells the origin of this mesh, as this program writes it.
fn tells_of(at: &Location, mesh: &str) -> bool {
    let read = || -> io::Result<serde_json::Value> {
        let object = Object::open(at, &Arc::default())?;
        let whole = Whole::of(&object)?.take(LONGEST);
        Ok(serde_json::from_reader(BufReader::new(whole))?)
    };
    read().is_ok_and(|origin| {
        let ours = origin["made_by"]
            .as_str()
            .is_some_and(|by| by.starts_with("outcrop "));
        ours && origin["mesh"] == mesh
    })
}

fn failed(at: &Location, error: io::Error) -> Error {
    Error::io(at.to_string(), "write", error)
}

/// The files below a folder, without hidden ones.
fn collect(folder: &Path, start: &str, files: &mut Vec<Sent>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let about = entry.metadata()?;
        let name = entry.file_name();
        // What is still hidden was not finished, or is a mesh of which others were made.
        let is_finished = |name: &&str| !(name.starts_with('.') && name.contains(".outcrop-"));
        let Some(name) = name.to_str().filter(is_finished) else {
            continue;
        };
        let name = format!("{start}{name}");
        match about.is_dir() {
            true => collect(&entry.path(), &format!("{name}/"), files)?,
            false => files.push(Sent {
                name,
                bytes: about.len(),
            }),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_few_and_large_enough() {
        for bytes in [1, PART, PART * MOST_PARTS, 5 << 40] {
            let part = part_of(bytes);
            assert!(
                part >= PART && bytes.div_ceil(part) <= MOST_PARTS,
                "{bytes}"
            );
        }
        assert_eq!(part_of(1 << 30), PART);
    }
}
