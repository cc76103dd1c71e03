//! Rows that one turn of the pass across blocks sends to later ones.

use crate::error::Result;
use crate::spill::{Row, Table};
use crate::workspace::Workspace;

/// Rows for numbered receivers, on disk, in the parts in which they were sent. They are not kept if the run
/// is interrupted.
#[derive(Debug)]
pub struct Deferred<R: Row> {
    parts: Table<R>,
    /// The parts for each receiver.
    of: Vec<Vec<u32>>,
}

impl<R: Row> Deferred<R> {
    /// Creates the file `name`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn new(workspace: &Workspace, name: &str, receivers: usize) -> Result<Self> {
        Ok(Self {
            parts: Table::temporary(workspace, name)?,
            of: vec![Vec::new(); receivers],
        })
    }

    /// Sends rows.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn send(&mut self, to: u32, rows: &[R]) -> Result<()> {
        if !rows.is_empty() {
            let part = self.parts.append(rows)?;
            self.of[to as usize].push(part as u32);
        }
        Ok(())
    }

    /// Number of rows for a receiver.
    #[must_use]
    pub fn rows(&self, to: usize) -> usize {
        let parts = self.of[to].iter();
        parts.map(|part| self.parts.rows(*part as usize)).sum()
    }

    /// All rows for a receiver, in the order of sending.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn get(&self, to: usize) -> Result<Vec<R>> {
        let mut all = Vec::with_capacity(self.rows(to));
        let mut rows = Vec::new();
        for &part in &self.of[to] {
            self.parts.get_into(part as usize, &mut rows)?;
            all.extend_from_slice(&rows);
        }
        Ok(all)
    }

    /// Bytes of the lists of parts.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.parts.count() * 40 + self.of.len() * 24) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_sent_comes_in_order() {
        let workspace = Workspace::for_tests(1);
        let mut deferred = Deferred::new(&workspace, "deferred", 3).unwrap();
        for i in 0..90u32 {
            let records: Vec<_> = (0..i % 4).map(|k| [i, k]).collect();
            deferred.send(i % 3, &records).unwrap();
        }
        for to in 0..3u32 {
            let sent = (0..90).filter(|i| i % 3 == to);
            let want: Vec<_> = sent.flat_map(|i| (0..i % 4).map(move |k| [i, k])).collect();
            assert_eq!(deferred.rows(to as usize), want.len());
            assert_eq!(deferred.get(to as usize).unwrap(), want);
        }
    }
}
