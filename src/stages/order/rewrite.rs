//! Writes a store in any order: of points that are sorted elsewhere, or of the same points at other positions.

use super::files::{StoreFiles, StoredPoints, WRITTEN};
use super::store::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;

/// Writes a store of known length; several threads may write ranges of pages.
#[derive(Debug)]
pub struct Rewriter {
    files: StoreFiles,
    len: usize,
}

impl Rewriter {
    /// The scratch file `name`, with the length and page size of `store`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn of(store: &PointStore, workspace: &Workspace, name: &str) -> Result<Self> {
        Self::new(name, store.len(), store.page_size(), workspace)
    }

    /// The scratch file `name` for `len` points in pages of `page`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn new(name: &str, len: usize, page: usize, workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            files: StoreFiles::open(workspace, name, page)?,
            len,
        })
    }

    /// Writes whole pages, starting with point `first`; the number of the first page is a multiple of 16.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn put(&self, unit: &Unit<'_>, first: usize, points: &[Point]) -> Result<()> {
        let groups = points.chunks(WRITTEN * self.files.page);
        let written: Result<Vec<_>> = groups.map(|group| self.files.write(unit, group)).collect();
        self.files.keep(unit, first / self.files.page, &written?)
    }

    /// Returns the store; every page must have been written.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn finish(self, workspace: &Workspace) -> Result<StoredPoints> {
        let pages = self.len.div_ceil(self.files.page);
        let bounds = self.files.bounds(&workspace.unit(), pages)?;
        Ok(self.files.stored(self.len, bounds))
    }
}
