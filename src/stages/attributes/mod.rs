//! Columns of the points by id, such as colours, the scanners that saw them (both not in the paper), and the normals
//! that their files give.
//!
//! The ordered store is there already. Units read parts of the spool again, with values, and send each point's row
//! to a bucket: a range of ids, cut at a sample of all points. Units of buckets sort the rows and go through them
//! beside the store. Of several rows at one position the smallest counts, so the order of inputs does not matter;
//! rows at positions that are not in the store belong to points that were left out.

mod buckets;
mod displacement;
mod rows;

use crate::blocks::Blocks;
use crate::ids::{Id, Ids};
use crate::order::{Grouped, MOST_GROUPS, StoredPoints, cuts};
use buckets::Buckets;
pub use displacement::displacement;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Row, Shuffle, Table, release, sort};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::lattice::Lattice;
use outcrop_paper::method::METHOD;
use outcrop_points::{Carried, Column, Spool, VALUE_BUFFERS};
use rows::{Row1, Row2, Row6, Row12, Row13, Row15, Word};
use serde::{Deserialize, Serialize};

/// Bytes of memory for the rows of a unit that reads, and about those of a bucket: a third of the smallest budget.
const ROWS: u64 = 64 << 20;

/// Copies of its rows that a unit that reads has in memory: the rows, and the rows packed twice.
const COPIES: u64 = 3;

/// Words of all points by id.
#[derive(Debug, Serialize, Deserialize)]
struct Words {
    /// Words of a point.
    words: usize,
    /// Sections: the values of consecutive ids, word by word.
    table: Table<Word>,
    /// The first id of each section.
    starts: Vec<Id>,
}

release!(Words: table);

impl Words {
    /// Bytes of memory for `ids` ids while they are read: their words, and the words of a whole section as they are
    /// on disk and as rows.
    fn bytes(&self, ids: usize) -> u64 {
        let sections = self
            .starts
            .windows(2)
            .map(|pair| pair[1].index() - pair[0].index());
        // The last one ends with a block, too.
        let section = sections.max().unwrap_or(METHOD.curve.block as usize);
        ((ids + 2 * section) * self.words * 4) as u64
    }

    /// The words of the ids of a block, id by id.
    fn open(&self, unit: &Unit<'_>, ids: impl IntoIterator<Item = Id>) -> Result<Vec<u32>> {
        let mut rows = Vec::new();
        let mut section = Vec::new();
        // The ids of the section that is loaded.
        let mut loaded = Ids::default();
        for id in ids {
            if !loaded.contains(&id) {
                let next = self.starts.partition_point(|start| *start <= id);
                let end = self.starts.get(next).copied().unwrap_or(Id::NONE);
                let number = next.saturating_sub(1);
                self.table.get_into(unit, number, &mut section)?;
                let start = self.starts.get(number).copied().unwrap_or_default();
                loaded = Ids { start, end };
            }
            let count = section.len() / self.words;
            let at = loaded.place(id);
            let word = |word: usize| section.get(word * count + at).filter(|_| at < count);
            rows.extend((0..self.words).map(|w| word(w).map_or(0, |word| word.word)));
        }
        Ok(rows)
    }
}

/// Some columns of all points by id.
#[derive(Debug, Serialize, Deserialize)]
struct Columns {
    columns: Vec<Column>,
    words: Words,
}

/// The columns of all points by id: those of the files, then how far points moved.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct StoredColumns {
    parts: Vec<Columns>,
}

impl StoredColumns {
    /// A column of one word, of the points of each block.
    #[must_use]
    pub fn of(column: Column, table: Table<Word>, blocks: Blocks) -> Self {
        let ids = (0..blocks.count()).map(|block| blocks.ids(block));
        let words = Words {
            words: 1,
            table,
            starts: ids.map(|ids| ids.start).collect(),
        };
        Self::new(vec![column], words)
    }

    fn new(columns: Vec<Column>, words: Words) -> Self {
        let parts = vec![Columns { columns, words }];
        Self { parts }
    }

    /// The columns, in the order of the values.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.parts.iter().flat_map(|part| &part.columns)
    }

    /// Adds columns behind those that are there.
    pub fn append(&mut self, more: Self) {
        self.parts.extend(more.parts);
    }

    /// Bytes of memory for the values of `ids` ids while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.parts.iter().map(|part| part.words.bytes(ids)).sum()
    }

    /// The values of ascending ids.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, ids: &[Id]) -> Result<Values<'_>> {
        let rows = |part: &Columns| part.words.open(unit, ids.iter().copied());
        let parts = self.parts.iter().map(|part| Ok((part, rows(part)?)));
        Ok(Values {
            parts: parts.collect::<Result<_>>()?,
        })
    }

    /// Deletes the files that no one needs any more.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        let mut parts = self.parts.iter();
        parts.try_for_each(|part| part.words.release(workspace))
    }
}

/// The values of some ids.
#[derive(Debug)]
pub struct Values<'a> {
    /// Columns, and their words id by id.
    parts: Vec<(&'a Columns, Vec<u32>)>,
}

impl Values<'_> {
    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.parts.iter().map(|(_, rows)| bytes_of(rows)).sum()
    }

    /// Appends the little-endian values of the id with this number to `bytes`, in the columns that are `held`.
    pub fn put(&self, number: usize, held: &[bool], bytes: &mut Vec<u8>) {
        let mut held = held.iter();
        for (part, rows) in &self.parts {
            let words = part.words.words;
            let mut row = [0; 48];
            let own = &rows[number * words..][..words];
            for (to, word) in row.chunks_exact_mut(4).zip(own) {
                to.copy_from_slice(&word.to_be_bytes());
            }
            let mut at = 0;
            for (column, held) in part.columns.iter().zip(&mut held) {
                let own = &row[at..at + column.scalar.bytes()];
                if *held {
                    Carried::unordered(column, own, bytes);
                }
                at += own.len();
            }
        }
    }
}

/// The number of the scanner of each point by id, from 1; 0 if it is unknown.
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredScanners {
    words: Words,
}

release!(StoredScanners: words);

impl StoredScanners {
    /// Stores the numbers of all ids.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn new(numbers: &[u32], blocks: Blocks, unit: &Unit<'_>) -> Result<Self> {
        let table = Table::new("attributes.scanners", blocks.count());
        let ids = || (0..blocks.count()).map(|block| blocks.ids(block));
        for (block, ids) in ids().enumerate() {
            let own = &numbers[ids.indices()];
            table.put(unit, block, bytemuck::cast_slice(own))?;
        }
        let words = Words {
            words: 1,
            table,
            starts: ids().map(|ids| ids.start).collect(),
        };
        Ok(Self { words })
    }

    /// Bytes of memory for the numbers of `ids` ids while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.words.bytes(ids)
    }

    /// The numbers of all ids of a block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, ids: Ids) -> Result<Vec<u32>> {
        self.words.open(unit, ids.iter())
    }
}

/// The normal of each point by id.
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredNormals {
    words: Words,
}

release!(StoredNormals: words);

impl StoredNormals {
    /// Bytes of memory for the normals of `ids` ids while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.words.bytes(ids)
    }

    /// The words of the normals of some ids, ascending: two for each, of
    /// [`direction`](outcrop_points::direction).
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, ids: impl IntoIterator<Item = Id>) -> Result<Vec<u32>> {
        self.words.open(unit, ids)
    }
}

/// The values of the points by id.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct StoredAttributes {
    /// The columns of the mesh, if there are any.
    pub columns: Option<StoredColumns>,
    /// The scanners, if they are carried.
    pub scanners: Option<StoredScanners>,
    /// The normals, if they are carried.
    pub normals: Option<StoredNormals>,
}

/// Puts the columns, scanners and normals `carried` of a spool in the order of the ids of `store`, and deletes the spool.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn attributes(
    spool: Spool,
    lattice: &Lattice,
    carried: &Carried,
    store: &StoredPoints,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<StoredAttributes> {
    let job = Job {
        spool,
        lattice,
        carried,
        rows: ROWS,
        workspace,
    };
    match carried.bytes().div_ceil(4) {
        0 | 1 => job.run::<Row1>(store, blocks),
        2 => job.run::<Row2>(store, blocks),
        3..=6 => job.run::<Row6>(store, blocks),
        7..=12 => job.run::<Row12>(store, blocks),
        13 => job.run::<Row13>(store, blocks),
        _ => job.run::<Row15>(store, blocks),
    }
}

/// The input of the stage.
struct Job<'a> {
    spool: Spool,
    lattice: &'a Lattice,
    carried: &'a Carried,
    /// Bytes of memory for the rows of a unit.
    rows: u64,
    workspace: &'a Workspace,
}

impl Job<'_> {
    fn run<R: Row>(self, store: &StoredPoints, blocks: Blocks) -> Result<StoredAttributes> {
        let workspace = self.workspace;
        let size = self.rows / (COPIES * size_of::<R>() as u64);
        let size = size.max(self.spool.points() / MOST_GROUPS);
        let source = Grouped::new(&self.spool, self.lattice, size, workspace);
        let cuts = cuts(
            source.samples("attributes: samples")?,
            source.count().max(1),
        );
        let sent = Shuffle::<R>::new("attributes.sent");
        self.send(&source, &cuts, &sent)?;
        // What was read is on its way now.
        self.spool.release(workspace)?;
        let store = store.open(workspace)?;
        let buckets = Buckets::new(&store, &cuts, blocks, workspace)?;
        let inbox = sent.open(workspace, buckets.count())?;
        let words = self.carried.bytes().div_ceil(4);
        let scanner = usize::from(self.carried.has_scanners());
        let normal = 2 * usize::from(self.carried.has_normals());
        let parts = [scanner, normal, words - scanner - normal];
        let tables = buckets.merge(&inbox, parts, workspace)?;
        drop(inbox);
        sent.release(workspace)?;
        let [scanners, normals, columns] = tables.map(|table| {
            table.map(|(table, words)| Words {
                words,
                table,
                starts: buckets.sections(),
            })
        });
        Ok(StoredAttributes {
            columns: columns.map(|words| StoredColumns::new(self.carried.columns.clone(), words)),
            scanners: scanners.map(|words| StoredScanners { words }),
            normals: normals.map(|words| StoredNormals { words }),
        })
    }

    /// Sends the rows of all points to their buckets. Of rows of a unit at one position only the smallest is sent.
    fn send<R: Row>(
        &self,
        source: &Grouped<'_>,
        cuts: &[[u32; 3]],
        sent: &Shuffle<R>,
    ) -> Result<()> {
        let row_bytes = self.carried.bytes();
        let work = |unit: &Unit<'_>| {
            let group = unit.number();
            let mut rows: Vec<R> = Vec::with_capacity(source.points(group) as usize);
            let take = |points: &[_], values: &[u8]| {
                let values = values.chunks_exact(row_bytes);
                rows.extend(
                    points
                        .iter()
                        .zip(values)
                        .map(|(p, v)| rows::row::<R>(*p, v)),
                );
                Ok(())
            };
            let frames = source.frames(group);
            self.spool
                .for_values(self.workspace, self.lattice, frames, self.carried, take)?;
            let _held = unit.hold(bytes_of(&rows) + VALUE_BUFFERS);
            sort(&mut rows);
            rows.dedup_by(|b, a| rows::key(a) == rows::key(b));
            rows::send_to(&mut rows, cuts);
            unit.advance(source.points(group));
            sent.send(unit, group, rows)
        };
        let bytes =
            |group: usize| VALUE_BUFFERS + source.points(group) * COPIES * size_of::<R>() as u64;
        self.workspace
            .units("attributes: send", source.count(), bytes, work, |_, ()| {
                Ok(())
            })
    }
}

#[cfg(test)]
mod tests;
