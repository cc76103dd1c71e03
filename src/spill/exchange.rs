//! Records sent to numbered receivers: an external sort by receiver, then one section each.

use super::{Layout, Record, Sections, Sorter, Word};
use crate::error::Result;
use crate::workspace::Workspace;

/// Collects records whose first word is the number of the section they are for.
#[derive(Debug)]
pub struct Exchange<const N: usize> {
    sorter: Sorter<N>,
    /// What was sent by senders with a number, in a run that can be resumed.
    sent: Option<Sections<N>>,
    name: String,
    layout: Layout<N>,
}

impl<const N: usize> Exchange<N> {
    /// An exchange that sorts in `buffer` bytes of memory. What is sent does not outlive an attempt: for
    /// steps that are done again as a whole.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub fn new(workspace: &Workspace, name: &str, buffer: u64) -> Result<Self> {
        let held = workspace.promise("exchange", buffer)?;
        Ok(Self {
            sorter: Sorter::new(workspace, name, buffer).telling(held),
            sent: None,
            name: name.to_owned(),
            layout: [Word::Above; N],
        })
    }

    /// An exchange for units of work: what a finished one has sent is there when the run is resumed.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Memory`].
    pub fn between(
        workspace: &Workspace,
        name: &str,
        buffer: u64,
        senders: usize,
        layout: Layout<N>,
    ) -> Result<Self> {
        let mut exchange = Self::new(workspace, name, buffer)?.packed(layout);
        if workspace.is_resumable() {
            let name = format!("{name}.letters");
            exchange.sent = Some(Sections::with_layout(workspace, &name, senders, layout)?);
        }
        Ok(exchange)
    }

    /// The exchange whose records are delivered packed with this layout.
    #[must_use]
    pub fn packed(mut self, layout: Layout<N>) -> Self {
        self.layout = layout;
        self
    }

    /// Sends records; the first word of each is its receiver.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn send(&self, records: &[Record<N>]) -> Result<()> {
        self.sorter.push(records)
    }

    /// Sends all records of unit `sender`; the first word of each is its receiver.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn send_from(&self, sender: usize, records: &[Record<N>]) -> Result<()> {
        match &self.sent {
            Some(sent) => {
                while sent.count() <= sender {
                    sent.grow();
                }
                sent.put(sender, records)
            }
            None => self.send(records),
        }
    }

    /// Delivers: section `r` holds, sorted, all records whose first word is `r`.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn deliver(self, workspace: &Workspace, receivers: usize) -> Result<Sections<N>> {
        self.deliver_if(workspace, receivers, |_, _| true)
    }

    /// As [`Exchange::deliver`]; of records that were sent more than once only one is kept.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn deliver_unique(self, workspace: &Workspace, receivers: usize) -> Result<Sections<N>> {
        self.deliver_if(workspace, receivers, |last, record| last != Some(record))
    }

    fn deliver_if(
        self,
        workspace: &Workspace,
        receivers: usize,
        wanted: impl Fn(Option<&Record<N>>, &Record<N>) -> bool,
    ) -> Result<Sections<N>> {
        workspace.once("deliver", || {
            let name = format!("{}.sections", self.name);
            let sections = Sections::with_layout(workspace, &name, receivers, self.layout)?;
            if let Some(sent) = self.sent {
                let mut records = Vec::new();
                for sender in 0..sent.count() {
                    workspace.check_cancel()?;
                    sent.get_into(sender, &mut records)?;
                    self.sorter.push(&records)?;
                }
            }
            let mut current: Vec<Record<N>> = Vec::new();
            self.sorter.finish(workspace)?.for_each(|record| {
                if current.first().is_some_and(|first| first[0] != record[0]) {
                    workspace.check_cancel()?;
                    sections.put(current[0][0] as usize, &current)?;
                    current.clear();
                }
                if wanted(current.last(), &record) {
                    current.push(record);
                }
                Ok(())
            })?;
            if let Some(first) = current.first() {
                sections.put(first[0] as usize, &current)?;
            }
            Ok(sections)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delivers_sorted_to_each_receiver() {
        let workspace = crate::spill::sorter::tests::workspace();
        let exchange = Exchange::<2>::new(&workspace, "mail", 64).unwrap();
        for i in (0..100u32).rev() {
            exchange.send(&[[i % 7, i]]).unwrap();
        }
        let sections = exchange.deliver(&workspace, 9).unwrap();
        for receiver in 0..9u32 {
            let got = sections.get(receiver as usize).unwrap();
            let want: Vec<_> = (0..100)
                .filter(|i| i % 7 == receiver)
                .map(|i| [receiver, i])
                .collect();
            assert_eq!(got, want);
        }
    }
}
