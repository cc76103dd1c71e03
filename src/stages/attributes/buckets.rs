//! Buckets: ranges of ids whose rows are put in order together.

use super::rows::{Word, key, values};
use crate::blocks::Blocks;
use crate::ids::Id;
use crate::order::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Row, Table};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::hilbert;
use std::ops::Range;

/// A table of words by id, and the number of words of an id.
pub type Part = (Table<Word>, usize);

/// The buckets of an ordered store, and the sections of its columns.
pub struct Buckets<'a> {
    store: &'a PointStore,
    /// The first id of each bucket, and the number of ids.
    starts: Vec<Id>,
    /// The first id of each section, and the number of ids: those of blocks and of buckets.
    sections: Vec<Id>,
}

impl<'a> Buckets<'a> {
    /// The buckets that begin at these keys, besides the first.
    pub fn new(
        store: &'a PointStore,
        cuts: &[hilbert::Key],
        blocks: Blocks,
        workspace: &Workspace,
    ) -> Result<Self> {
        let starts = workspace.once("attributes: cuts", |unit| {
            let mut starts = vec![Id::default()];
            for cut in cuts {
                unit.check_cancel()?;
                starts.push(id_from(store, *cut)?);
            }
            starts.push(Id::at(store.len()));
            Ok(starts)
        })?;
        let blocks = (0..blocks.count()).map(|block| blocks.ids(block).start);
        let mut sections: Vec<Id> = starts.iter().copied().chain(blocks).collect();
        sections.sort_unstable();
        sections.dedup();
        Ok(Self {
            store,
            starts,
            sections,
        })
    }

    /// Number of buckets.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The first id of each section.
    pub fn sections(&self) -> Vec<Id> {
        let all = self.sections.len() - 1;
        self.sections[..all].to_vec()
    }

    /// The numbers of the sections of a bucket.
    fn of(&self, bucket: usize) -> Range<usize> {
        let section = |id: Id| self.sections.partition_point(|start| *start < id);
        section(self.starts[bucket])..section(self.starts[bucket + 1])
    }

    /// Puts the values that were sent in the order of ids, so many words of each point into each of three tables;
    /// a table of no words is not made.
    pub fn merge<R: Row>(
        &self,
        inbox: &Inbox<R>,
        parts: [usize; 3],
        workspace: &Workspace,
    ) -> Result<[Option<Part>; 3]> {
        let words = parts.iter().sum();
        let table =
            |name, words| (words > 0).then(|| (Table::new(name, self.sections.len() - 1), words));
        let tables = [
            table("attributes.scanners", parts[0]),
            table("attributes.normals", parts[1]),
            table("attributes", parts[2]),
        ];
        let work = |unit: &Unit<'_>| {
            let bucket = unit.number();
            let rows = inbox.get(unit, bucket)?;
            let _held = unit.hold(bytes_of(&rows));
            let mut left = rows.iter().peekable();
            for section in self.of(bucket) {
                unit.check_cancel()?;
                let ids = self.sections[section].index()..self.sections[section + 1].index();
                let points = self.store.slice(ids)?;
                let count = points.len();
                let mut column = vec![Word::default(); count * words];
                let _held = unit.hold(bytes_of(&points) + bytes_of(&column));
                for (number, point) in points.iter().enumerate() {
                    let wanted = hilbert::encode(*point);
                    // What is before it belongs to points that were left out, or is not the smallest.
                    while left.next_if(|row| key(*row) < wanted).is_some() {}
                    let Some(row) = left.peek().filter(|row| key(**row) == wanted) else {
                        return Err(inbox.missing(bucket, "the values of every point"));
                    };
                    for (word, value) in values(*row).iter().take(words).enumerate() {
                        column[word * count + number].word = *value;
                    }
                }
                let mut rest = &column[..];
                for (table, words) in tables.iter().flatten() {
                    let own;
                    (own, rest) = rest.split_at(words * count);
                    table.put(unit, section, own)?;
                }
            }
            Ok(())
        };
        let bytes = |bucket: usize| {
            let rows = inbox.rows(bucket) * size_of::<R>();
            let largest = self
                .of(bucket)
                .map(|s| self.sections[s + 1].index() - self.sections[s].index());
            let ids = largest.max().unwrap_or(0);
            // The rows, half of them while they are sorted, and the packed ones.
            (rows * 5 / 2 + ids * (24 + 12 * words)) as u64 + (1 << 20)
        };
        workspace.units("attributes: merge", self.count(), bytes, work, |_, ()| {
            Ok(())
        })?;
        Ok(tables)
    }
}

/// The first id whose key is not below `cut`.
fn id_from(store: &PointStore, cut: hilbert::Key) -> Result<Id> {
    let below = |page: usize, points: &mut Vec<_>| {
        points.clear();
        store.read_pages(page..page + 1, points)?;
        Ok::<_, outcrop_disk::error::Error>(points.partition_point(|p| hilbert::encode(*p) < cut))
    };
    let (mut low, mut high) = (0, store.pages());
    let mut points = Vec::new();
    // The first page that has a point not below the cut.
    while low < high {
        let middle = low.midpoint(high);
        if below(middle, &mut points)? < points.len() {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    if low == store.pages() {
        return Ok(Id::at(store.len()));
    }
    let inside = below(low, &mut points)?;
    Ok(Id::at(store.page_ids(low).start + inside))
}
