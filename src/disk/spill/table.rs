//! A table: a file of numbered sections of rows.
//!
//! Sections may be written by several threads in any order; each is one contiguous range of the file with its
//! own CRC-32, packed, and is read back whole.

use super::Row;
use super::compress::{compress, expand};
use super::pack::{pack, unpack};
use crate::error::Result;
use crate::workspace::file::ScratchFile;
use crate::workspace::memory::bytes_of;
use crate::workspace::place::Place;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::marker::PhantomData;
use std::sync::Arc;

/// Numbered sections of rows in one scratch file, by the name of the file.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Table<R: Row> {
    name: String,
    count: usize,
    /// True if it survives the attempt.
    kept: bool,
    #[serde(skip)]
    rows: PhantomData<fn() -> R>,
}

impl<R: Row> Table<R> {
    /// The table `name` of `count` sections, empty ones unless an earlier attempt wrote them. While a section
    /// is written or read, its packed bytes are in memory too, unless its rows are unpacked.
    #[must_use]
    pub fn new(name: &str, count: usize) -> Self {
        Self {
            name: name.to_owned(),
            count,
            kept: true,
            rows: PhantomData,
        }
    }

    /// A table that does not survive the attempt.
    #[must_use]
    pub fn temporary(name: &str, count: usize) -> Self {
        Self {
            kept: false,
            ..Self::new(name, count)
        }
    }

    fn file(&self, workspace: &Workspace) -> Result<Arc<ScratchFile>> {
        workspace.files.open(&self.name, self.kept)
    }

    /// Deletes the file.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        workspace.files.release(&self.name)
    }

    /// Number of sections.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of rows in a section.
    ///
    /// # Errors
    /// [`crate::error::Error::Memory`] if there is no room for the list of sections.
    pub fn rows(&self, workspace: &Workspace, section: usize) -> Result<usize> {
        Ok(self.file(workspace)?.section(section).records)
    }

    /// Number of rows in a section, for the size of a reservation: 0 if the file cannot be opened, which
    /// reading the section reports.
    #[must_use]
    pub fn expected_rows(&self, workspace: &Workspace, section: usize) -> usize {
        self.rows(workspace, section).unwrap_or(0)
    }

    /// Number of rows in all sections.
    ///
    /// # Errors
    /// [`crate::error::Error::Memory`] if there is no room for the list of sections.
    pub fn total(&self, workspace: &Workspace) -> Result<u64> {
        Ok(self.file(workspace)?.records())
    }

    /// Writes a section; replaces its earlier content.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn put(&self, unit: &Unit<'_>, section: usize, rows: &[R]) -> Result<()> {
        let place = self.append(unit, rows)?;
        self.file(unit)?.put(unit, section as u32, place)
    }

    /// Writes rows that are no section; returns their place.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn append(&self, unit: &Unit<'_>, rows: &[R]) -> Result<Place> {
        let file = self.file(unit)?;
        let bytes = stored_bytes(&file, rows, |bytes| unit.hold(bytes));
        file.append(unit.worker(), &bytes, rows.len())
    }

    /// Writes a section that consists of parts which are read one by one; returns the place of each.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
    pub fn put_parts(
        &self,
        unit: &Unit<'_>,
        section: usize,
        parts: &[Vec<R>],
    ) -> Result<Vec<Place>> {
        let (mut all, mut packed) = (Vec::new(), Vec::new());
        let mut places = Vec::with_capacity(parts.len());
        for rows in parts {
            places.push(append_packed(rows, &mut packed, &mut all));
        }
        let _held = unit.hold(bytes_of(&all) + bytes_of(&packed));
        let file = self.file(unit)?;
        let records = parts.iter().map(Vec::len).sum();
        let whole = file.append(unit.worker(), &all, records)?;
        file.put(unit, section as u32, whole)?;
        for place in &mut places {
            place.segment = whole.segment;
            place.offset += whole.offset;
        }
        Ok(places)
    }

    /// Reads the rows at `place` into `rows`, which is cleared first.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`]; [`crate::error::Error::Corrupt`] if the bytes do not match their checksum.
    pub fn read(&self, unit: &Unit<'_>, place: Place, rows: &mut Vec<R>) -> Result<()> {
        rows.clear();
        let file = self.file(unit)?;
        read_rows(&file, place, rows, |bytes| unit.hold(bytes))
    }

    /// Reads a section into `rows`, which is cleared first.
    ///
    /// # Errors
    /// See [`Table::read`].
    pub fn get_into(&self, unit: &Unit<'_>, section: usize, rows: &mut Vec<R>) -> Result<()> {
        let place = self.file(unit)?.section(section);
        self.read(unit, place, rows)
    }

    /// Reads a section.
    ///
    /// # Errors
    /// See [`Table::read`].
    pub fn get(&self, unit: &Unit<'_>, section: usize) -> Result<Vec<R>> {
        let mut rows = Vec::new();
        self.get_into(unit, section, &mut rows)?;
        Ok(rows)
    }
}

/// The rows as they are stored as a section of `file`: packed, and compressed if the run says so. `hold` is
/// called with the bytes of memory that this takes.
pub(super) fn stored_bytes<'a, R: Row, H>(
    file: &ScratchFile,
    rows: &'a [R],
    hold: impl Fn(u64) -> H,
) -> Cow<'a, [u8]> {
    if R::PACKING.is_none() {
        return Cow::Borrowed(bytemuck::cast_slice(rows));
    }
    let mut packed = Vec::new();
    pack(rows, &mut packed);
    let level = file.compression();
    // A compressed copy has room for as many bytes.
    let copies = if level.is_some() { 2 } else { 1 };
    let _held = hold(copies * bytes_of(&packed));
    Cow::Owned(compress(packed, level))
}

/// The rows packed; `packed` is memory for them.
fn packed_bytes<'a, R: Row>(rows: &'a [R], packed: &'a mut Vec<u8>) -> &'a [u8] {
    if R::PACKING.is_none() {
        return bytemuck::cast_slice(rows);
    }
    packed.clear();
    pack(rows, packed);
    packed
}

/// Appends the bytes of rows to `all`; returns their place in it. `packed` is a buffer.
pub(super) fn append_packed<R: Row>(rows: &[R], packed: &mut Vec<u8>, all: &mut Vec<u8>) -> Place {
    let bytes = packed_bytes(rows, packed);
    let place = Place {
        segment: 0,
        offset: all.len() as u64,
        bytes: bytes.len(),
        records: rows.len(),
        crc: crc32fast::hash(bytes),
    };
    all.extend_from_slice(bytes);
    place
}

/// Appends the rows at `place` of a file; `hold` is called with the bytes of memory that this takes besides.
pub(super) fn read_rows<R: Row, H>(
    file: &ScratchFile,
    place: Place,
    rows: &mut Vec<R>,
    hold: impl FnOnce(u64) -> H,
) -> Result<()> {
    let bad = |found: String| {
        let expected = format!("{} rows of {} words", place.records, R::WORDS);
        file.damaged(place.segment, place.offset, found, expected)
    };
    let before = rows.len();
    // A size from a damaged journal must not abort the program, so allocations may fail.
    let grow = |rows: &mut Vec<R>, bytes: usize| {
        if !fits::<R>(place.records, bytes) || rows.try_reserve(place.records).is_err() {
            return Err(bad(format!("{bytes} bytes")));
        }
        rows.resize(before + place.records, R::zeroed());
        Ok(())
    };
    if R::PACKING.is_none() {
        grow(rows, place.bytes)?;
        return file.read_part(place, bytemuck::cast_slice_mut(&mut rows[before..]));
    }
    let mut bytes = Vec::new();
    if bytes.try_reserve_exact(place.bytes).is_err() {
        return Err(bad(format!("{} bytes", place.bytes)));
    }
    bytes.resize(place.bytes, 0);
    file.read_part(place, &mut bytes)?;
    let packed = expand(&bytes);
    let packed =
        packed.ok_or_else(|| bad(format!("{} bytes that do not decompress", place.bytes)))?;
    let copy = if matches!(packed, Cow::Owned(_)) {
        packed.len()
    } else {
        0
    };
    let _held = hold(bytes_of(&bytes) + copy as u64);
    grow(rows, packed.len())?;
    unpack(&packed, &mut rows[before..])
        .ok_or_else(|| bad(format!("{} bytes that do not unpack", packed.len())))
}

/// True if the number of rows is possible for the number of bytes, which are packed or the rows themselves.
fn fits<R: Row>(records: usize, bytes: usize) -> bool {
    if R::PACKING.is_some() {
        // Packed, a word takes at least the two bits of its length.
        records.saturating_mul(R::WORDS).div_ceil(4) <= bytes
    } else {
        records.checked_mul(size_of::<R>()) == Some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::spill::row;

    #[test]
    fn damage_is_found_and_named() {
        damage::<[u32; 2]>(&Workspace::for_tests(2).expect("a scratch folder"));
        damage::<Plain>(&Workspace::for_tests(2).expect("a scratch folder"));
    }

    row! {
        /// Two unpacked words.
        struct Plain { words: [u32; 2], }
        unpacked
    }

    fn damage<R: Row>(workspace: &Workspace) {
        let unit = workspace.unit();
        let table = Table::<R>::new("table", 2);
        let words: Vec<_> = (0..3000u32).map(|i| [i, i * i]).collect();
        let rows: &[R] = bytemuck::cast_slice(&words);
        table.put(&unit, 1, rows).unwrap();
        assert_eq!(table.get(&unit, 1).unwrap(), rows);
        assert!(table.get(&unit, 0).unwrap().is_empty());
        let file = table.file(workspace).unwrap().path(unit.worker() as u32);
        let mut bytes = std::fs::read(&file).unwrap();
        for at in (0..bytes.len()).step_by(997) {
            bytes[at] ^= 16;
            std::fs::write(&file, &bytes).unwrap();
            match table.get(&unit, 1) {
                Err(Error::Corrupt { path, .. }) => assert_eq!(path, file),
                other => panic!("{other:?}"),
            }
            bytes[at] ^= 16;
        }
    }

    #[test]
    fn parts_of_a_section_are_read_one_by_one() {
        let workspace = Workspace::for_tests(1).expect("a scratch folder");
        let unit = workspace.unit();
        let table = Table::<[u32; 2]>::new("table", 2);
        let parts: Vec<Vec<_>> = (0..5u32).map(|n| vec![[n, 7]; 300 * n as usize]).collect();
        table.put(&unit, 0, &[[1, 2]]).unwrap();
        let places = table.put_parts(&unit, 1, &parts).unwrap();
        let mut rows = Vec::new();
        for (place, part) in places.iter().zip(&parts) {
            table.read(&unit, *place, &mut rows).unwrap();
            assert_eq!(rows, *part);
        }
        assert_eq!(table.rows(&workspace, 1).unwrap(), 3000);
    }

    /// Found by fuzzing a journal with valid checksums and invalid content.
    #[test]
    fn places_that_cannot_be_ask_for_no_memory() {
        bad_places::<[u32; 2]>(&Workspace::for_tests(2).expect("a scratch folder"));
        bad_places::<Plain>(&Workspace::for_tests(2).expect("a scratch folder"));
    }

    fn bad_places<R: Row>(workspace: &Workspace) {
        let unit = workspace.unit();
        let table = Table::<R>::new("table", 1);
        table
            .put(&unit, 0, bytemuck::cast_slice(&[[1, 2]; 100]))
            .unwrap();
        let place = table.file(workspace).unwrap().section(0);
        let mut rows = Vec::new();
        let mut refused = |place| {
            let error = table.read(&unit, place, &mut rows).unwrap_err();
            assert!(matches!(error, Error::Corrupt { .. }), "{error}");
        };
        for records in [101 * 8, usize::MAX / 16, usize::MAX] {
            refused(Place { records, ..place });
        }
        // More rows than the bytes can hold, and than any memory can.
        let (records, bytes) = (1 << 57, 8 << 57);
        refused(Place {
            records,
            bytes,
            ..place
        });
    }
}
