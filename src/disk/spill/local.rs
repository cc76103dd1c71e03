//! A table for the work of one function, which deletes it unless a later attempt needs it.

use super::Row;
use super::table::{read_rows, stored_bytes};
use crate::error::Result;
use crate::workspace::file::ScratchFile;
use crate::workspace::{Files, Unit, Workspace};
use std::marker::PhantomData;
use std::sync::Arc;

/// Numbered sections of rows in a scratch file. It is deleted on drop, unless it survives the attempt.
#[derive(Debug)]
pub struct LocalTable<R: Row> {
    file: Arc<ScratchFile>,
    files: Files,
    rows: PhantomData<fn() -> R>,
}

impl<R: Row> LocalTable<R> {
    /// Creates the scratch file `name`.
    ///
    /// # Errors
    /// [`crate::error::Error::Memory`].
    pub fn create(workspace: &Workspace, name: &str) -> Result<Self> {
        let files = workspace.files.clone();
        Ok(Self {
            file: files.open(name, false)?,
            files,
            rows: PhantomData,
        })
    }

    /// Opens the scratch file `name`, with the sections that finished units of an earlier attempt have
    /// [put](LocalTable::put_by) into it. It survives the attempt if the run can be resumed.
    ///
    /// # Errors
    /// [`crate::error::Error::Memory`].
    pub fn kept(workspace: &Workspace, name: &str) -> Result<Self> {
        let files = workspace.files.clone();
        Ok(Self {
            file: files.open(name, workspace.is_resumable())?,
            files,
            rows: PhantomData,
        })
    }

    /// The name of the scratch file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Number of sections.
    #[must_use]
    pub fn count(&self) -> usize {
        self.file.count()
    }

    /// Number of rows in all sections.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.file.records()
    }

    /// Writes a section; replaces its earlier content.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn put(&self, section: usize, rows: &[R]) -> Result<()> {
        let bytes = stored_bytes(&self.file, rows, |_| ());
        let place = self.file.append(self.files.worker(), &bytes, rows.len())?;
        self.file.set(section as u32, place)
    }

    /// As [`LocalTable::put`]; if the table survives the attempt, the section does once the unit is finished.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn put_by(&self, unit: &Unit<'_>, section: usize, rows: &[R]) -> Result<()> {
        let bytes = stored_bytes(&self.file, rows, |bytes| unit.hold(bytes));
        let place = self.file.append(unit.worker(), &bytes, rows.len())?;
        self.file.put(unit, section as u32, place)
    }

    /// Writes the next section.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn append(&self, rows: &[R]) -> Result<()> {
        self.put(self.count(), rows)
    }

    /// Reads a section into `rows`, which is cleared first.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`]; [`crate::error::Error::Corrupt`] if the bytes do not match their checksum.
    pub fn get_into(&self, section: usize, rows: &mut Vec<R>) -> Result<()> {
        rows.clear();
        read_rows(&self.file, self.file.section(section), rows, |_| ())
    }

    /// Reads a section.
    ///
    /// # Errors
    /// See [`LocalTable::get_into`].
    pub fn get(&self, section: usize) -> Result<Vec<R>> {
        let mut rows = Vec::new();
        self.get_into(section, &mut rows)?;
        Ok(rows)
    }
}

impl<R: Row> Drop for LocalTable<R> {
    fn drop(&mut self) {
        if !self.file.is_kept() {
            // A file that cannot be deleted is deleted with its folder.
            let _ = self.files.release(&self.file.name);
        }
    }
}
