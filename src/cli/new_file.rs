//! Files with what a command says.

use crate::deliver::{check_text, put_text};
use crate::features::PAGES;
use outcrop_disk::error::{Error, Result};
use outcrop_points::is_remote;
use std::path::Path;

/// True if a report with this name is a page.
pub fn is_page(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["html", "htm"]
        .iter()
        .any(|page| extension.eq_ignore_ascii_case(page))
}

/// A file to be written after the work. That it cannot be written is an error before the work; if the work fails,
/// no empty file is left.
pub struct NewFile<'a> {
    path: &'a Path,
    is_new: bool,
}

impl<'a> NewFile<'a> {
    /// Makes sure that the file can be written; its content stays.
    pub fn open(path: &'a Path) -> Result<Self> {
        Self::opened(path)
    }

    /// The same for a page, which has to be named so: nothing else is overwritten by mistake.
    pub fn page(path: &'a Path) -> Result<Self> {
        PAGES.require()?;
        if !is_page(path) {
            return Err(Error::Parameter {
                name: "html",
                found: path.display().to_string(),
                expected: "a name that ends in .html".into(),
            });
        }
        Self::opened(path)
    }

    fn opened(path: &'a Path) -> Result<Self> {
        if is_remote(path) {
            check_text(path)?;
            return Ok(Self {
                path,
                is_new: false,
            });
        }
        let is_new = !path.exists();
        let opened = std::fs::File::options()
            .append(true)
            .create(true)
            .open(path);
        opened.map_err(|e| Error::io(path, "write the report", e))?;
        Ok(Self { path, is_new })
    }

    /// Its path.
    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Writes it.
    pub fn write(mut self, text: &str) -> Result<()> {
        self.is_new = false;
        if is_remote(self.path) {
            return put_text(self.path, text);
        }
        std::fs::write(self.path, text).map_err(|e| Error::io(self.path, "write the report", e))
    }
}

impl Drop for NewFile<'_> {
    fn drop(&mut self) {
        if self.is_new {
            let _ = std::fs::remove_file(self.path);
        }
    }
}
