//! A table: a file of numbered sections of rows.
//!
//! Sections may be written by several threads in any order; each is one contiguous range of the
//! file with its own CRC-32, packed, and is read back whole.

use super::Row;
use super::pack::{pack, unpack};
use crate::error::Result;
use crate::workspace::Workspace;
use crate::workspace::file::ScratchFile;
use crate::workspace::memory::{bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};
use crate::workspace::place::Place;
use std::marker::PhantomData;
use std::sync::Mutex;

/// Largest number of sections whose list of places is allocated without a reservation.
const LARGE: usize = 1 << 20;

/// Numbered sections of rows in one scratch file. The file is deleted on drop.
#[derive(Debug)]
pub struct Table<R: Row> {
    file: ScratchFile,
    places: Mutex<Vec<Place>>,
    rows: PhantomData<R>,
}

impl<R: Row> Table<R> {
    /// Creates the file `name` in the scratch folder, with `count` empty sections. While a section is written
    /// or read, its packed bytes are in memory too, unless its rows are unpacked.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        let (file, known) = workspace.keep_file(name)?;
        let count = known.iter().fold(count, |n, (s, _)| n.max(*s as usize + 1));
        if count > LARGE {
            // A number that exceeds the budget can only come from a damaged journal.
            let bytes = (count as u64).saturating_mul(size_of::<Place>() as u64);
            drop(workspace.reserve("table of sections", bytes)?);
        }
        let mut places = vec![Place::default(); count];
        for (section, place) in known {
            places[section as usize] = place;
        }
        Ok(Self {
            file,
            places: Mutex::new(places),
            rows: PhantomData,
        })
    }

    /// A table without sections that does not survive the attempt.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn temporary(workspace: &Workspace, name: &str) -> Result<Self> {
        Ok(Self {
            file: workspace.create_file(name)?,
            places: Mutex::default(),
            rows: PhantomData,
        })
    }

    fn places(&self) -> std::sync::MutexGuard<'_, Vec<Place>> {
        self.places
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Number of sections.
    #[must_use]
    pub fn count(&self) -> usize {
        self.places().len()
    }

    /// True if the file was deleted by an earlier attempt at the run.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        self.file.is_gone()
    }

    /// Number of rows in a section.
    #[must_use]
    pub fn rows(&self, section: usize) -> usize {
        self.places()[section].records
    }

    /// Number of rows in all sections.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.places().iter().map(|p| p.records as u64).sum()
    }

    /// Adds an empty section; returns its number.
    pub fn grow(&self) -> usize {
        let mut places = self.places();
        places.push(Place::default());
        places.len() - 1
    }

    /// Writes a new section; returns its number.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn append(&self, rows: &[R]) -> Result<usize> {
        let section = self.grow();
        self.put(section, rows)?;
        Ok(section)
    }

    /// Writes a section; replaces its earlier content.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn put(&self, section: usize, rows: &[R]) -> Result<()> {
        let mut packed = Vec::new();
        let bytes = if R::PACKING.is_some() {
            pack(rows, &mut packed);
            drop(hold(bytes_of(&packed)));
            &packed
        } else {
            bytemuck::cast_slice(rows)
        };
        let place = Place {
            offset: self.file.append(bytes)?,
            bytes: bytes.len(),
            records: rows.len(),
            crc: crc32fast::hash(bytes),
        };
        self.places()[section] = place;
        self.file.put(section as u32, place)
    }

    /// Reads a section into `rows`, which is cleared first.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if the bytes do not match their checksum.
    pub fn get_into(&self, section: usize, rows: &mut Vec<R>) -> Result<()> {
        let place = self.places()[section];
        rows.clear();
        let mut bytes = Vec::new();
        let packed = R::PACKING.map_or(0, |_| place.bytes);
        // A size from a damaged journal must not abort the program, so the allocation may fail.
        let room = bytes.try_reserve_exact(packed).is_ok()
            && Self::fits(place)
            && rows.try_reserve(place.records).is_ok();
        if !room {
            let found = format!("{} bytes", place.bytes);
            let expected = format!("{} rows of {} words", place.records, R::WORDS);
            return Err(self.file.damaged(place.offset, found, expected));
        }
        if R::PACKING.is_none() {
            rows.resize(place.records, R::zeroed());
            return self.read(place, bytemuck::cast_slice_mut(rows));
        }
        bytes.resize(place.bytes, 0);
        let _held = hold(bytes_of(&bytes));
        self.read(place, &mut bytes)?;
        rows.resize(place.records, R::zeroed());
        unpack(&bytes, rows).ok_or_else(|| {
            let found = format!("{} bytes that do not unpack", place.bytes);
            let expected = format!("{} rows", place.records);
            self.file.damaged(place.offset, found, expected)
        })
    }

    /// True if the number of rows is possible for the number of bytes.
    fn fits(place: Place) -> bool {
        if R::PACKING.is_some() {
            // Packed, a word takes at least the two bits of its length.
            place.records.saturating_mul(R::WORDS).div_ceil(4) <= place.bytes
        } else {
            place.records.checked_mul(size_of::<R>()) == Some(place.bytes)
        }
    }

    fn read(&self, place: Place, bytes: &mut [u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.file.read_at(bytes, place.offset)?;
        let crc = crc32fast::hash(bytes);
        if crc == place.crc {
            return Ok(());
        }
        let (found, expected) = (format!("checksum {crc:08x}"), format!("{:08x}", place.crc));
        Err(self.file.damaged(place.offset, found, expected))
    }

    /// Reads a section.
    ///
    /// # Errors
    /// See [`Table::get_into`].
    pub fn get(&self, section: usize) -> Result<Vec<R>> {
        let mut rows = Vec::new();
        self.get_into(section, &mut rows)?;
        Ok(rows)
    }
}

impl<R: Row> Persist for Table<R> {
    fn save(&self, out: &mut Vec<u8>) {
        self.file.name.to_string().save(out);
        self.count().save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (name, count) = (String::load(from)?, usize::load(from)?);
        Self::create(from.workspace, &name, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::spill::row;

    #[test]
    fn damage_is_found_and_named() {
        damage::<[u32; 2]>(&Workspace::for_tests(2));
        damage::<Plain>(&Workspace::for_tests(2));
    }

    row! {
        /// Two unpacked words.
        struct Plain { words: [u32; 2], }
        unpacked
    }

    fn damage<R: Row>(workspace: &Workspace) {
        let table = Table::<R>::create(workspace, "table", 2).unwrap();
        let words: Vec<_> = (0..3000u32).map(|i| [i, i * i]).collect();
        let rows: &[R] = bytemuck::cast_slice(&words);
        table.put(1, rows).unwrap();
        assert_eq!(table.get(1).unwrap(), rows);
        assert!(table.get(0).unwrap().is_empty());
        let mut bytes = std::fs::read(&table.file.path).unwrap();
        for at in (0..bytes.len()).step_by(997) {
            bytes[at] ^= 16;
            std::fs::write(&table.file.path, &bytes).unwrap();
            match table.get(1) {
                Err(Error::Corrupt { path, .. }) => assert_eq!(path, table.file.path),
                other => panic!("{other:?}"),
            }
            bytes[at] ^= 16;
        }
    }

    /// Found by fuzzing a journal with valid checksums and invalid content.
    #[test]
    fn places_that_cannot_be_ask_for_no_memory() {
        let workspace = Workspace::for_tests(2);
        bad_places::<[u32; 2]>(&workspace);
        bad_places::<Plain>(&Workspace::for_tests(2));
        let mut saved = Vec::new();
        String::from("table").save(&mut saved);
        (1usize << 58).save(&mut saved);
        let loaded = Table::<Plain>::load(&mut Saved::new(&saved, &workspace));
        assert!(matches!(loaded, Err(Error::Memory { .. })));
    }

    fn bad_places<R: Row>(workspace: &Workspace) {
        let table = Table::<R>::create(workspace, "table", 1).unwrap();
        table.put(0, bytemuck::cast_slice(&[[1, 2]; 100])).unwrap();
        for rows in [101 * 8, usize::MAX / 16, usize::MAX] {
            table.places()[0].records = rows;
            let error = table.get(0).unwrap_err();
            assert!(matches!(error, Error::Corrupt { .. }), "{error}");
        }
        // More rows than the bytes can hold, and than any memory can.
        table.places()[0].records = 1 << 57;
        table.places()[0].bytes = 8 << 57;
        let error = table.get(0).unwrap_err();
        assert!(matches!(error, Error::Corrupt { .. }), "{error}");
    }
}
