//! Writes a store of the same points at other positions, in any order.

use super::store::PointStore;
use super::writer::{PageEnd, StoreWriter};
use crate::error::Result;
use crate::geom::Point;
use crate::geom::aabb::Aabb;
use crate::workspace::Workspace;
use std::sync::{Mutex, PoisonError};

/// Writes a [`PointStore`] of the same length as another one; several threads may write ranges of pages.
#[derive(Debug)]
pub struct Rewriter {
    writer: StoreWriter,
    len: usize,
    pages: Mutex<Vec<PageEnd>>,
}

impl Rewriter {
    /// Creates the scratch file `name`, with the length and page size of `store`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn of(store: &PointStore, workspace: &Workspace, name: &str) -> Result<Self> {
        Ok(Self {
            writer: StoreWriter::create(workspace, name, store.page_size())?,
            len: store.len(),
            pages: Mutex::new(vec![
                (0, Aabb::EMPTY);
                store.len().div_ceil(store.page_size())
            ]),
        })
    }

    /// Writes whole pages, starting with point `first`; the number of the first page is a multiple of 16.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn put(&self, first: usize, points: &[Point]) -> Result<()> {
        let written = self.writer.write(first, points)?;
        let from = first / self.writer.page();
        self.writer.keep(from, std::slice::from_ref(&written))?;
        let mut pages = self.pages.lock().unwrap_or_else(PoisonError::into_inner);
        pages[from..from + written.0.len()].copy_from_slice(&written.0);
        Ok(())
    }

    /// Returns the store; every page must have been written.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Memory`].
    pub fn finish(self, workspace: &Workspace) -> Result<PointStore> {
        let pages = self.pages.into_inner();
        let pages = pages.unwrap_or_else(PoisonError::into_inner);
        self.writer.finish_with(self.len, pages, workspace)
    }
}
