//! Rows sent to numbered receivers: an external sort by receiver, then one section for each.

use super::{Row, Sorter, Table};
use crate::error::Result;
use crate::workspace::Workspace;

/// Collects rows for receivers: the first field of a row is the number of its receiver.
#[derive(Debug)]
pub struct Shuffle<R: Row> {
    sorter: Sorter<R>,
    /// Rows by sender, in a run that can be resumed.
    sent: Option<Table<R>>,
    name: String,
}

impl<R: Row> Shuffle<R> {
    /// A shuffle that sorts in `buffer` bytes of memory. Rows sent do not survive the attempt: for steps that
    /// are repeated as a whole when a run is resumed.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub fn new(workspace: &Workspace, name: &str, buffer: u64) -> Result<Self> {
        let held = workspace.promise("shuffle", buffer)?;
        Ok(Self {
            sorter: Sorter::new(workspace, name, buffer).reporting(held),
            sent: None,
            name: name.to_owned(),
        })
    }

    /// A shuffle between units of work: the rows of finished units survive the attempt.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Memory`].
    pub fn between_units(
        workspace: &Workspace,
        name: &str,
        buffer: u64,
        senders: usize,
    ) -> Result<Self> {
        let mut shuffle = Self::new(workspace, name, buffer)?;
        if workspace.is_resumable() {
            let name = format!("{name}.by-sender");
            shuffle.sent = Some(Table::create(workspace, &name, senders)?);
        }
        Ok(shuffle)
    }

    /// Sends rows.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn send(&self, rows: &[R]) -> Result<()> {
        self.sorter.push(rows)
    }

    /// Sends all rows of unit `sender`.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn send_from(&self, sender: usize, rows: &[R]) -> Result<()> {
        match &self.sent {
            Some(sent) => {
                while sent.count() <= sender {
                    sent.grow();
                }
                sent.put(sender, rows)
            }
            None => self.send(rows),
        }
    }

    /// Delivers: section `r` holds, sorted, all rows for receiver `r`.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn deliver(self, workspace: &Workspace, receivers: usize) -> Result<Table<R>> {
        self.deliver_if(workspace, receivers, |_, _| true)
    }

    /// As [`Shuffle::deliver`]; equal rows are delivered once.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn deliver_unique(self, workspace: &Workspace, receivers: usize) -> Result<Table<R>> {
        self.deliver_if(workspace, receivers, |last, row| last != Some(row))
    }

    fn deliver_if(
        self,
        workspace: &Workspace,
        receivers: usize,
        wanted: impl Fn(Option<&R>, &R) -> bool,
    ) -> Result<Table<R>> {
        workspace.once(&format!("deliver {}", self.name), || {
            let name = format!("{}.sections", self.name);
            let table = Table::create(workspace, &name, receivers)?;
            if let Some(sent) = self.sent {
                let mut rows = Vec::new();
                for sender in 0..sent.count() {
                    workspace.check_cancel()?;
                    sent.get_into(sender, &mut rows)?;
                    self.sorter.push(&rows)?;
                }
            }
            let mut current: Vec<R> = Vec::new();
            self.sorter.finish(workspace)?.for_each(|row| {
                if current
                    .first()
                    .is_some_and(|first| receiver(first) != receiver(&row))
                {
                    workspace.check_cancel()?;
                    table.put(receiver(&current[0]), &current)?;
                    current.clear();
                }
                if wanted(current.last(), &row) {
                    current.push(row);
                }
                Ok(())
            })?;
            if let Some(first) = current.first() {
                table.put(receiver(first), &current)?;
            }
            Ok(table)
        })
    }
}

/// The receiver of a row.
fn receiver(row: &impl Row) -> usize {
    row.words()[0] as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delivers_sorted_to_each_receiver() {
        let workspace = Workspace::for_tests(2);
        let shuffle = Shuffle::<[u32; 2]>::new(&workspace, "shuffle", 64).unwrap();
        for i in (0..100u32).rev() {
            shuffle.send(&[[i % 7, i]]).unwrap();
        }
        let table = shuffle.deliver(&workspace, 9).unwrap();
        for receiver in 0..9u32 {
            let got = table.get(receiver as usize).unwrap();
            let want: Vec<_> = (0..100)
                .filter(|i| i % 7 == receiver)
                .map(|i| [receiver, i])
                .collect();
            assert_eq!(got, want);
        }
    }
}
