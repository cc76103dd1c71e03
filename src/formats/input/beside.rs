//! Small files in the folder of an input, on this machine or on a server.

use super::super::remote::{Beside, Expected, Version};
use super::{Input, Source};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{IoCounters, Workspace};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Input {
    /// A file whose bytes are in memory.
    pub(in super::super) fn of_memory(path: PathBuf, bytes: Vec<u8>) -> Self {
        Self {
            path,
            bytes: bytes.len() as u64,
            size: bytes.len() as u64,
            source: Source::Memory(bytes),
            io: Arc::default(),
            maps: false,
        }
    }

    /// The bytes of the file `name` in its folder, at most `most`; and its version, if it is on a server.
    pub(in super::super) fn beside(
        &self,
        name: &str,
        most: u64,
    ) -> Result<(Vec<u8>, Option<Version>)> {
        let path = self.path.with_file_name(name);
        let read = match self.folder()? {
            Some(folder) => folder
                .read(name, most)
                .map(|(bytes, version)| (bytes, Some(version))),
            None => read(&path, most).map(|bytes| (bytes, None)),
        };
        let (bytes, version) = read.map_err(|e| Error::io(&path, "read", e))?;
        self.io.add_read(bytes.len() as u64);
        Ok((bytes, version))
    }

    /// The latest time that its server told, in seconds since 1970.
    pub(in super::super) fn clock(&self) -> Option<i64> {
        match &self.source {
            Source::Remote(remote) => remote.clock(),
            _ => None,
        }
    }

    /// Files in its folder that will be read in this order, each with its largest size. One on a server that has changed
    /// after `begun`, in seconds since 1970, is an error.
    pub(in super::super) fn expect_beside(
        &self,
        files: Vec<(String, u64)>,
        begun: Option<i64>,
        workspace: &Workspace,
    ) -> Result<Files> {
        let folder = self.folder()?;
        let expected = folder.map(|folder| folder.expect(files.clone(), begun, workspace));
        Ok(Files {
            path: self.path.clone(),
            files,
            io: self.io.clone(),
            expected: expected.transpose()?,
        })
    }

    /// Its folder, if that is on a server.
    fn folder(&self) -> Result<Option<Beside>> {
        match &self.source {
            Source::Remote(remote) => remote.beside(&self.path).map(Some),
            _ => Ok(None),
        }
    }
}

/// Small files in one folder.
pub(in super::super) struct Files {
    path: PathBuf,
    files: Vec<(String, u64)>,
    io: Arc<IoCounters>,
    expected: Option<Expected>,
}

impl Files {
    /// The name of a file in the folder.
    pub(in super::super) fn name(&self, file: usize) -> String {
        self.files[file].0.clone()
    }

    /// The path of a file.
    pub(in super::super) fn path(&self, file: usize) -> PathBuf {
        self.path.with_file_name(&self.files[file].0)
    }

    /// The bytes of a file.
    pub(in super::super) fn take(&self, file: usize) -> Result<Vec<u8>> {
        let path = self.path(file);
        let read = match &self.expected {
            Some(expected) => expected.take(file),
            None => read(&path, self.files[file].1),
        };
        let bytes = read.map_err(|e| Error::io(&path, "read", e))?;
        self.io.add_read(bytes.len() as u64);
        Ok(bytes)
    }
}

/// The bytes of a local file, at most `most`.
fn read(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        false => Ok(bytes),
        true => Err(std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            format!("it is larger than {most} bytes"),
        )),
    }
}
