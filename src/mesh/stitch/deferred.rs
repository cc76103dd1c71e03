//! Rows that one turn of the pass across blocks sends to later ones.

use outcrop_disk::error::Result;
use outcrop_disk::spill::{Row, Table};
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Unit, Workspace};

/// Rows for numbered receivers, on disk, in the parts in which they were sent. They are not kept if the run
/// is interrupted.
#[derive(Debug)]
pub struct Deferred<R: Row> {
    parts: Table<R>,
    /// The places of the parts for each receiver.
    of: Vec<Vec<Place>>,
    /// Number of parts.
    count: usize,
}

impl<R: Row> Deferred<R> {
    /// Rows in the file `name`.
    pub fn new(name: &str, receivers: usize) -> Self {
        Self {
            parts: Table::temporary(name, 0),
            of: vec![Vec::new(); receivers],
            count: 0,
        }
    }

    /// Sends rows.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn send(&mut self, unit: &Unit<'_>, to: usize, rows: &[R]) -> Result<()> {
        if !rows.is_empty() {
            self.of[to].push(self.parts.append(unit, rows)?);
            self.count += 1;
        }
        Ok(())
    }

    /// Number of rows for a receiver.
    #[must_use]
    pub fn rows(&self, to: usize) -> usize {
        self.of[to].iter().map(|place| place.records).sum()
    }

    /// All rows for a receiver, in the order of sending.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn get(&self, unit: &Unit<'_>, to: usize) -> Result<Vec<R>> {
        let mut all = Vec::with_capacity(self.rows(to));
        let mut rows = Vec::new();
        for &place in &self.of[to] {
            self.parts.read(unit, place, &mut rows)?;
            all.extend_from_slice(&rows);
        }
        Ok(all)
    }

    /// Bytes of the lists of parts.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.count * size_of::<Place>() + self.of.len() * 24) as u64
    }

    /// Deletes the file.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.parts.release(workspace)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_sent_comes_in_order() {
        let workspace = Workspace::for_tests(1).expect("a scratch folder");
        let unit = workspace.unit();
        let mut deferred = Deferred::new("deferred", 3);
        for i in 0..90u32 {
            let records: Vec<_> = (0..i % 4).map(|k| [i, k]).collect();
            deferred.send(&unit, i as usize % 3, &records).unwrap();
        }
        for to in 0..3u32 {
            let sent = (0..90).filter(|i| i % 3 == to);
            let want: Vec<_> = sent.flat_map(|i| (0..i % 4).map(move |k| [i, k])).collect();
            assert_eq!(deferred.rows(to as usize), want.len());
            assert_eq!(deferred.get(&unit, to as usize).unwrap(), want);
        }
    }
}
