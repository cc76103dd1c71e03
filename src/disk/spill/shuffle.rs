//! Rows sent to numbered receivers.
//!
//! A sender writes its rows once, sorted by receiver, with an index; a receiver reads its parts of all
//! senders and merges them. So nothing depends on the order in which senders are done.

use super::table::{append_packed, read_rows};
use super::{Row, sort};
use crate::error::{Error, Result};
use crate::workspace::file::ScratchFile;
use crate::workspace::memory::{Reservation, bytes_of};
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::sync::Arc;

/// An entry of a sender's index.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Part {
    receiver: u32,
    rows: u32,
    bytes: u32,
    crc: u32,
}

/// Rows for receivers, by the name of their file: the first field of a row is the number of its receiver.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Shuffle<R: Row> {
    name: String,
    #[serde(skip)]
    rows: PhantomData<fn() -> R>,
}

impl<R: Row> Shuffle<R> {
    /// The shuffle `name`, with what earlier attempts sent.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            rows: PhantomData,
        }
    }

    /// Deletes the file.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        workspace.files.release(&self.name)
    }

    /// Sends all rows of `sender`; replaces what it sent earlier.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn send(&self, unit: &Unit<'_>, sender: usize, mut rows: Vec<R>) -> Result<()> {
        if rows.is_empty() {
            return Ok(());
        }
        sort::sort(&mut rows);
        let (mut index, mut body, mut packed) = (Vec::new(), Vec::new(), Vec::new());
        for part in rows.chunk_by(|a, b| receiver(a) == receiver(b)) {
            let place = append_packed(part, &mut packed, &mut body);
            index.push(Part {
                receiver: receiver(&part[0]),
                rows: place.records as u32,
                bytes: place.bytes as u32,
                crc: place.crc,
            });
        }
        let mut all = Vec::with_capacity(4 + size_of_val(&*index) + body.len());
        all.extend_from_slice(&(index.len() as u32).to_ne_bytes());
        all.extend_from_slice(bytemuck::cast_slice(&index));
        all.extend_from_slice(&body);
        let _held = unit.hold(bytes_of(&all) + bytes_of(&body) + bytes_of(&packed));
        let file = unit.files.open(&self.name, true)?;
        let place = file.append(unit.worker(), &all, rows.len())?;
        file.put(unit, sender as u32, place)
    }

    /// Opens what was sent to the receivers `0..receivers`; all senders must be done.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Corrupt`], [`crate::error::Error::Memory`].
    pub fn open(&self, workspace: &Workspace, receivers: usize) -> Result<Inbox<R>> {
        Ok(Inbox {
            parts: Parts::open(workspace, &self.name, receivers)?,
            unique: false,
            rows: PhantomData,
        })
    }
}

/// Bytes of memory for a part in the list of an inbox.
const ENTRY: u64 = size_of::<(u32, Place)>() as u64;

/// The index of a sender whose rows are at `place`.
fn read_index(file: &ScratchFile, place: Place) -> Result<Vec<Part>> {
    if place.bytes == 0 {
        return Ok(Vec::new());
    }
    let mut count = [0; 4];
    file.read(place.segment, place.offset, &mut count)?;
    let count = u32::from_ne_bytes(count) as usize;
    if 4 + count * size_of::<Part>() > place.bytes {
        let (found, expected) = (format!("{count} parts"), format!("{} bytes", place.bytes));
        return Err(file.damaged(place.segment, place.offset, found, expected));
    }
    let mut index = vec![Part::default(); count];
    let bytes = bytemuck::cast_slice_mut(&mut index);
    file.read(place.segment, place.offset + 4, bytes)?;
    Ok(index)
}

/// The receiver of a row.
fn receiver(row: &impl Row) -> u32 {
    row.words()[0]
}

/// Where the rows sent to each receiver are, whatever their kind.
#[derive(Debug)]
struct Parts {
    file: Arc<ScratchFile>,
    /// The parts by receiver, then in the order of senders.
    list: Vec<(u32, Place)>,
    /// For each receiver the number of parts before its own.
    starts: Vec<u32>,
    _held: Reservation,
}

impl Parts {
    fn open(workspace: &Workspace, name: &str, receivers: usize) -> Result<Self> {
        let file = workspace.files.open(name, true)?;
        let list = (receivers as u64 + 1) * size_of::<u32>() as u64;
        let mut held = workspace.promise("shuffle", list)?;
        let mut parts: Vec<(u32, Place)> = Vec::new();
        let senders = if file.is_gone() { 0 } else { file.count() };
        for sender in 0..senders {
            let place = file.section(sender);
            let index = read_index(&file, place)?;
            if parts.len() + index.len() > parts.capacity() {
                // Growing takes the old list and its copy.
                let room = (parts.len() + index.len()).next_power_of_two();
                held.at_least(list + (room + parts.capacity()) as u64 * ENTRY)?;
                parts.reserve_exact(room - parts.len());
            }
            let mut offset = place.offset + 4 + size_of_val(&*index) as u64;
            for part in index {
                let entry = Place {
                    segment: place.segment,
                    offset,
                    bytes: part.bytes as usize,
                    records: part.rows as usize,
                    crc: part.crc,
                };
                if part.receiver as usize >= receivers || entry.end() > place.end() {
                    let found = format!("a part of {} bytes for {}", part.bytes, part.receiver);
                    let expected = format!("parts for {receivers} receivers");
                    return Err(file.damaged(place.segment, place.offset, found, expected));
                }
                offset += u64::from(part.bytes);
                parts.push((part.receiver, entry));
            }
        }
        // Stable: the parts of a receiver stay in the order of senders.
        parts.sort_by_key(|(receiver, _)| *receiver);
        let mut starts = Vec::with_capacity(receivers + 1);
        for receiver in 0..=receivers {
            starts.push(parts.partition_point(|(r, _)| (*r as usize) < receiver) as u32);
        }
        held.set_held(list + parts.capacity() as u64 * ENTRY);
        Ok(Self {
            file,
            list: parts,
            starts,
            _held: held,
        })
    }

    fn of(&self, receiver: usize) -> &[(u32, Place)] {
        &self.list[self.starts[receiver] as usize..self.starts[receiver + 1] as usize]
    }

    fn rows(&self, receiver: usize) -> usize {
        let parts = self.of(receiver).iter();
        parts.map(|(_, place)| place.records).sum()
    }

    /// Number of rows for which there is room in memory: all, unless the index is damaged.
    fn fitting(&self, receiver: usize) -> usize {
        let bytes: usize = self.of(receiver).iter().map(|(_, place)| place.bytes).sum();
        self.rows(receiver).min(4 * bytes)
    }
}

/// The rows sent to each receiver.
#[derive(Debug)]
pub struct Inbox<R: Row> {
    parts: Parts,
    unique: bool,
    rows: PhantomData<fn() -> R>,
}

impl<R: Row> Inbox<R> {
    /// Of equal rows only one is received.
    #[must_use]
    pub fn unique(self) -> Self {
        Self {
            unique: true,
            ..self
        }
    }

    /// Number of rows sent to a receiver.
    #[must_use]
    pub fn rows(&self, receiver: usize) -> usize {
        self.parts.rows(receiver)
    }

    /// All rows sent to a receiver, ascending.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`]; [`crate::error::Error::Corrupt`] if the bytes do not match their checksum.
    pub fn get(&self, unit: &Unit<'_>, receiver: usize) -> Result<Vec<R>> {
        let mut rows = Vec::with_capacity(self.parts.fitting(receiver));
        for (_, place) in self.parts.of(receiver) {
            read_rows(&self.parts.file, *place, &mut rows, |bytes| {
                unit.hold(bytes)
            })?;
        }
        // Consists of ascending runs, which this sort merges.
        sort::merge(&mut rows);
        if self.unique {
            rows.dedup();
        }
        Ok(rows)
    }

    /// An error if rows that a receiver needs were not sent.
    #[must_use]
    pub fn missing(&self, receiver: usize, expected: &str) -> Error {
        let found = format!("{} rows for {receiver}", self.rows(receiver));
        self.parts.file.damaged(0, 0, found, expected.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delivers_sorted_to_each_receiver() {
        let workspace = Workspace::for_tests(2).expect("a scratch folder");
        let unit = workspace.unit();
        let shuffle = Shuffle::<[u32; 2]>::new("shuffle");
        for sender in (0..10u32).rev() {
            let rows = (0..100)
                .filter(|i| i % 10 == sender)
                .map(|i| [i % 7, i / 2]);
            shuffle
                .send(&unit, sender as usize, rows.collect())
                .unwrap();
        }
        let inbox = shuffle.open(&workspace, 9).unwrap();
        let mut unique = shuffle.open(&workspace, 9).unwrap().unique();
        for receiver in 0..9u32 {
            let of = (0..100).filter(|i| i % 7 == receiver);
            let mut want: Vec<_> = of.map(|i| [receiver, i / 2]).collect();
            let got = inbox.get(&unit, receiver as usize).unwrap();
            assert_eq!((inbox.rows(receiver as usize), &got), (want.len(), &want));
            want.dedup();
            assert_eq!(unique.get(&unit, receiver as usize).unwrap(), want);
        }
        unique.parts.list[3].1.crc ^= 1;
        let damaged = (0..9).map(|receiver| unique.get(&unit, receiver));
        assert!(
            damaged
                .into_iter()
                .any(|r| matches!(r, Err(Error::Corrupt { .. })))
        );
        // A receiver that does not exist.
        assert!(matches!(
            shuffle.open(&workspace, 3),
            Err(Error::Corrupt { .. })
        ));
    }
}
