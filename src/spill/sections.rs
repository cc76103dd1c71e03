//! A file of numbered sections of records.
//!
//! Sections may be written by several threads in any order; each is one contiguous range of the
//! file with its own CRC-32, and is read back whole.

use super::Record;
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
    records: u64,
    crc: u32,
}

/// Numbered sections of `N`-word records in one scratch file, which is deleted on drop.
#[derive(Debug)]
pub struct Sections<const N: usize> {
    path: PathBuf,
    file: File,
    places: Mutex<Vec<Place>>,
    end: AtomicU64,
    io: Arc<IoCounters>,
}

impl<const N: usize> Sections<N> {
    /// Makes the file `name` in the scratch folder, with `count` empty sections.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        let (path, file) = workspace.create_file(name)?;
        Ok(Self {
            path,
            file,
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
        self.places()[section].records as usize
    }

    /// Number of records in all sections.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.places().iter().map(|p| p.records).sum()
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
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let offset = self.end.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.file
            .write_all_at(bytes, offset)
            .map_err(|e| Error::io(&self.path, format!("write {} bytes", bytes.len()), e))?;
        self.io.add_written(bytes.len() as u64);
        self.io.grow_scratch(bytes.len() as u64);
        self.places()[section] = Place {
            offset,
            records: records.len() as u64,
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
        records.resize(place.records as usize, [0; N]);
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(records);
        self.file
            .read_exact_at(bytes, place.offset)
            .map_err(|e| Error::io(&self.path, format!("read {} bytes", bytes.len()), e))?;
        self.io.add_read(bytes.len() as u64);
        let crc = crc32fast::hash(bytes);
        if crc != place.crc {
            return Err(Error::Corrupt {
                path: self.path.clone(),
                offset: place.offset,
                found: format!("checksum {crc:08x}"),
                expected: format!("{:08x}", place.crc),
            });
        }
        Ok(())
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
