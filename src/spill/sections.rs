//! A file of numbered sections of records.
//!
//! Sections may be written by several threads in any order; each is one contiguous range of the
//! file with its own CRC-32, packed, and is read back whole.

use super::pack::{pack, unpack};
use super::{Layout, Record, Word};
use crate::error::Result;
use crate::workspace::Workspace;
use crate::workspace::file::{Place, ScratchFile};
use crate::workspace::memory::{bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};
use std::sync::Mutex;

/// Sections of which a table is not made unasked.
const LARGE: usize = 1 << 20;

/// Numbered sections of `N`-word records in one scratch file, which is deleted on drop.
#[derive(Debug)]
pub struct Sections<const N: usize> {
    file: ScratchFile,
    /// How records are packed, if they are.
    layout: Option<Layout<N>>,
    places: Mutex<Vec<Place>>,
}

impl<const N: usize> Sections<N> {
    /// Makes the file `name` in the scratch folder, with `count` empty sections of records of which
    /// each is like the one before. While a section is written or read, its packed bytes are in
    /// memory as well.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        Self::with_layout(workspace, name, count, [Word::Above; N])
    }

    /// As [`Sections::create`], with the layout that packs the records best.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn with_layout(
        workspace: &Workspace,
        name: &str,
        count: usize,
        layout: Layout<N>,
    ) -> Result<Self> {
        Self::new(workspace, name, count, Some(layout))
    }

    /// As [`Sections::create`] for records that are not alike: they are kept as they are, and writing
    /// and reading take no further memory.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn unpacked(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        Self::new(workspace, name, count, None)
    }

    /// A file without sections that is gone when the run is resumed, whatever was put there.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn passing(workspace: &Workspace, name: &str, layout: Layout<N>) -> Result<Self> {
        Ok(Self {
            file: workspace.create_file(name)?,
            layout: Some(layout),
            places: Mutex::default(),
        })
    }

    fn new(
        workspace: &Workspace,
        name: &str,
        count: usize,
        layout: Option<Layout<N>>,
    ) -> Result<Self> {
        let (file, known) = workspace.keep_file(name)?;
        let count = known.iter().fold(count, |n, (s, _)| n.max(*s as usize + 1));
        if count > LARGE {
            // More than the budget holds comes from a journal that speaks of something else.
            let bytes = (count as u64).saturating_mul(size_of::<Place>() as u64);
            drop(workspace.reserve("table of sections", bytes)?);
        }
        let mut places = vec![Place::default(); count];
        for (section, place) in known {
            places[section as usize] = place;
        }
        Ok(Self {
            file,
            layout,
            places: Mutex::new(places),
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

    /// Number of records in a section.
    #[must_use]
    pub fn records(&self, section: usize) -> usize {
        self.places()[section].records
    }

    /// Number of records in all sections.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.places().iter().map(|p| p.records as u64).sum()
    }

    /// Adds an empty section; its number.
    pub fn grow(&self) -> usize {
        let mut places = self.places();
        places.push(Place::default());
        places.len() - 1
    }

    /// Writes a further section and gives its number.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn append(&self, records: &[Record<N>]) -> Result<usize> {
        let section = self.grow();
        self.put(section, records)?;
        Ok(section)
    }

    /// Writes a section; an earlier content of it is forgotten.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn put(&self, section: usize, records: &[Record<N>]) -> Result<()> {
        let mut packed = Vec::new();
        let bytes = match self.layout {
            Some(layout) => {
                pack(records, layout, &mut packed);
                drop(hold(bytes_of(&packed)));
                &packed
            }
            None => bytemuck::cast_slice(records),
        };
        let place = Place {
            offset: self.file.append(bytes)?,
            bytes: bytes.len(),
            records: records.len(),
            crc: crc32fast::hash(bytes),
        };
        self.places()[section] = place;
        self.file.put(section as u32, place)
    }

    /// Reads a section into `records`, which is cleared first.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Corrupt`] if it is not what was written.
    pub fn get_into(&self, section: usize, records: &mut Vec<Record<N>>) -> Result<()> {
        let place = self.places()[section];
        records.clear();
        let mut bytes = Vec::new();
        let packed = self.layout.map_or(0, |_| place.bytes);
        // What a journal says about sizes is not believed as far as to end the program.
        let room = bytes.try_reserve_exact(packed).is_ok()
            && self.fits(place)
            && records.try_reserve(place.records).is_ok();
        if !room {
            let found = format!("{} bytes", place.bytes);
            let expected = format!("{} records of {N} words", place.records);
            return Err(self.file.damaged(place.offset, found, expected));
        }
        let Some(layout) = self.layout else {
            records.resize(place.records, [0; N]);
            return self.read(place, bytemuck::cast_slice_mut(records));
        };
        bytes.resize(place.bytes, 0);
        let _held = hold(bytes_of(&bytes));
        self.read(place, &mut bytes)?;
        records.resize(place.records, [0; N]);
        unpack(&bytes, layout, records).ok_or_else(|| {
            let found = format!("{} bytes that do not unpack", place.bytes);
            let expected = format!("{} records", place.records);
            self.file.damaged(place.offset, found, expected)
        })
    }

    /// True if so many records can take so many bytes.
    fn fits(&self, place: Place) -> bool {
        match self.layout {
            // Packed, a word takes at least the two bits of its length.
            Some(_) => place.records.saturating_mul(N).div_ceil(4) <= place.bytes,
            None => place.records.checked_mul(size_of::<Record<N>>()) == Some(place.bytes),
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
    /// See [`Sections::get_into`].
    pub fn get(&self, section: usize) -> Result<Vec<Record<N>>> {
        let mut records = Vec::new();
        self.get_into(section, &mut records)?;
        Ok(records)
    }
}

impl<const N: usize> Persist for Sections<N> {
    fn save(&self, out: &mut Vec<u8>) {
        self.file.name.to_string().save(out);
        self.count().save(out);
        let layout = self.layout.map(|layout| layout.map(|word| word as u8));
        layout.is_some().save(out);
        layout.unwrap_or([0; N]).save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (name, count) = (String::load(from)?, usize::load(from)?);
        let packed = bool::load(from)?;
        let words = <[u8; N]>::load(from)?.map(|word| match word {
            0 => Word::Above,
            1 => Word::Left,
            _ => Word::Rising,
        });
        Self::new(from.workspace, &name, count, packed.then_some(words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn damage_is_found_and_named() {
        let workspace = crate::spill::sorter::tests::workspace();
        let packed = Sections::<2>::create(&workspace, "packed", 2).unwrap();
        let unpacked = Sections::<2>::unpacked(&workspace, "unpacked", 2).unwrap();
        for sections in [packed, unpacked] {
            let records: Vec<_> = (0..3000u32).map(|i| [i, i * i]).collect();
            sections.put(1, &records).unwrap();
            assert_eq!(sections.get(1).unwrap(), records);
            assert!(sections.get(0).unwrap().is_empty());
            let mut bytes = std::fs::read(&sections.file.path).unwrap();
            for at in (0..bytes.len()).step_by(997) {
                bytes[at] ^= 16;
                std::fs::write(&sections.file.path, &bytes).unwrap();
                match sections.get(1) {
                    Err(Error::Corrupt { path, .. }) => assert_eq!(path, sections.file.path),
                    other => panic!("{other:?}"),
                }
                bytes[at] ^= 16;
            }
        }
    }

    /// Found by fuzzing a journal whose checksums are right.
    #[test]
    fn places_that_cannot_be_ask_for_no_memory() {
        let workspace = crate::spill::sorter::tests::workspace();
        let packed = Sections::<3>::create(&workspace, "packed", 1).unwrap();
        let unpacked = Sections::<3>::unpacked(&workspace, "unpacked", 1).unwrap();
        for sections in [packed, unpacked] {
            sections.put(0, &[[1, 2, 3]; 100]).unwrap();
            for records in [101 * 8, usize::MAX / 16, usize::MAX] {
                sections.places()[0].records = records;
                let error = sections.get(0).unwrap_err();
                assert!(matches!(error, Error::Corrupt { .. }), "{error}");
            }
            // As many bytes as that many records take, and no memory has.
            sections.places()[0].records = 1 << 57;
            sections.places()[0].bytes = 12 << 57;
            let error = sections.get(0).unwrap_err();
            assert!(matches!(error, Error::Corrupt { .. }), "{error}");
        }
        let mut saved = Vec::new();
        String::from("table").save(&mut saved);
        (1usize << 58).save(&mut saved);
        false.save(&mut saved);
        [0u8; 3].save(&mut saved);
        let loaded = Sections::<3>::load(&mut Saved::new(&saved, &workspace));
        assert!(matches!(loaded, Err(Error::Memory { .. })));
    }
}
