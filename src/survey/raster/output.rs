//! A file that gets its name when it is whole.

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::temporary;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

pub(super) struct Output {
    path: PathBuf,
    part: PathBuf,
    file: BufWriter<File>,
    bytes: u64,
    is_whole: bool,
}

impl Output {
    pub fn create(path: &Path) -> Result<Self> {
        let part = temporary(path);
        let file = File::create(&part).map_err(|e| Error::io(path, "create", e))?;
        Ok(Self {
            path: path.to_path_buf(),
            part,
            file: BufWriter::with_capacity(1 << 16, file),
            bytes: 0,
            is_whole: false,
        })
    }

    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.bytes += bytes.len() as u64;
        let written = self.file.write_all(bytes);
        written.map_err(|e| Error::io(&self.path, "write", e))
    }

    /// Gives the file its name; returns its size.
    pub fn finish(mut self) -> Result<u64> {
        let failed = |e| Error::io(&self.path, "write", e);
        self.file.flush().map_err(failed)?;
        self.file.get_ref().sync_all().map_err(failed)?;
        let named = outcrop_platform::rename(&self.part, &self.path);
        named.map_err(|e| Error::io(&self.path, "name", e))?;
        self.is_whole = true;
        Ok(self.bytes)
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if !self.is_whole {
            let _ = std::fs::remove_file(&self.part);
        }
    }
}
