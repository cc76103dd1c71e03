//! A file of numbered sections of records.
//!
//! Sections may be written by several threads in any order; each is one contiguous range of the
//! file with its own CRC-32, packed, and is read back whole.

use super::pack::{pack, unpack};
use super::{Layout, Record, Word};
use crate::error::{Error, Result};
use crate::workspace::{IoCounters, Workspace};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

#[derive(Debug, Clone, Copy, Default)]
struct Place {
    offset: u64,
    bytes: usize,
    records: usize,
    crc: u32,
}

/// Numbered sections of `N`-word records in one scratch file, which is deleted on drop.
#[derive(Debug)]
pub struct Sections<const N: usize> {
    path: PathBuf,
    file: File,
    /// How records are packed, if they are.
    layout: Option<Layout<N>>,
    places: Mutex<Vec<Place>>,
    end: AtomicU64,
    io: Arc<IoCounters>,
}

impl<const N: usize> Sections<N> {
    /// Makes the file `name` in the scratch folder, with `count` empty sections of records of which
    /// each is like the one before. While a section is written or read, its packed bytes are in
    /// memory as well.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        Self::with_layout(workspace, name, count, [Word::Above; N])
    }

    /// As [`Sections::create`], with the layout that packs the records best.
    ///
    /// # Errors
    /// [`Error::Io`].
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
    /// [`Error::Io`].
    pub fn unpacked(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        Self::new(workspace, name, count, None)
    }

    fn new(
        workspace: &Workspace,
        name: &str,
        count: usize,
        layout: Option<Layout<N>>,
    ) -> Result<Self> {
        let (path, file) = workspace.create_file(name)?;
        Ok(Self {
            path,
            file,
            layout,
            places: Mutex::new(vec![Place::default(); count]),
            end: AtomicU64::new(0),
            io: workspace.io.clone(),
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

    /// Writes a further section and gives its number.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn append(&self, records: &[Record<N>]) -> Result<usize> {
        let section = {
            let mut places = self.places();
            places.push(Place::default());
            places.len() - 1
        };
        self.put(section, records)?;
        Ok(section)
    }

    /// Writes a section; an earlier content of it is forgotten.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn put(&self, section: usize, records: &[Record<N>]) -> Result<()> {
        let mut packed = Vec::new();
        let bytes = match self.layout {
            Some(layout) => {
                pack(records, layout, &mut packed);
                &packed
            }
            None => bytemuck::cast_slice(records),
        };
        let offset = self.end.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.file
            .write_all_at(bytes, offset)
            .map_err(|e| Error::io(&self.path, format!("write {} bytes", bytes.len()), e))?;
        self.io.add_written(bytes.len() as u64);
        self.io.grow_scratch(bytes.len() as u64);
        self.places()[section] = Place {
            offset,
            bytes: bytes.len(),
            records: records.len(),
            crc: crc32fast::hash(bytes),
        };
        Ok(())
    }

    /// Reads a section into `records`, which is cleared first.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Corrupt`] if it is not what was written.
    pub fn get_into(&self, section: usize, records: &mut Vec<Record<N>>) -> Result<()> {
        let place = self.places()[section];
        records.clear();
        let Some(layout) = self.layout else {
            records.resize(place.records, [0; N]);
            return self.read(place, bytemuck::cast_slice_mut(records));
        };
        let mut bytes = vec![0; place.bytes];
        self.read(place, &mut bytes)?;
        records.resize(place.records, [0; N]);
        unpack(&bytes, layout, records).ok_or_else(|| Error::Corrupt {
            path: self.path.clone(),
            offset: place.offset,
            found: format!("{} bytes that do not unpack", place.bytes),
            expected: format!("{} records", place.records),
        })
    }

    fn read(&self, place: Place, bytes: &mut [u8]) -> Result<()> {
        self.file
            .read_exact_at(bytes, place.offset)
            .map_err(|e| Error::io(&self.path, format!("read {} bytes", bytes.len()), e))?;
        self.io.add_read(bytes.len() as u64);
        let crc = crc32fast::hash(bytes);
        if crc == place.crc {
            return Ok(());
        }
        Err(Error::Corrupt {
            path: self.path.clone(),
            offset: place.offset,
            found: format!("checksum {crc:08x}"),
            expected: format!("{:08x}", place.crc),
        })
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

impl<const N: usize> Drop for Sections<N> {
    fn drop(&mut self) {
        self.io.shrink_scratch(self.end.load(Ordering::Relaxed));
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let mut bytes = std::fs::read(&sections.path).unwrap();
            for at in (0..bytes.len()).step_by(997) {
                bytes[at] ^= 16;
                std::fs::write(&sections.path, &bytes).unwrap();
                match sections.get(1) {
                    Err(Error::Corrupt { path, .. }) => assert_eq!(path, sections.path),
                    other => panic!("{other:?}"),
                }
                bytes[at] ^= 16;
            }
        }
    }
}
