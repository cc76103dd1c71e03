//! Files of the scratch folder: private, never opened through a symbolic link; all bytes are counted.
//!
//! A file consists of segments `NAME.0`, `NAME.1` …, each written by one thread of one attempt at the run.
//! Its numbered sections are contiguous parts of segments.

use super::away::Away;
use super::fault::{self, Event};
use super::keeper::{Kept, Leaving};
use super::mapped::Mapping;
use super::memory::Reservation;
use super::open::{failed_write, open_existing, options};
use super::place::{Place, Put};
use super::run::ResumableRun;
use super::storage::Shared;
use super::{Unit, lock};
use crate::error::{Error, Result};
use outcrop_platform::FileAt;
use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Bytes of memory for a section.
const SECTION: u64 = size_of::<Place>() as u64;

/// Lists of up to this number of sections are not reserved by name.
const FEW: usize = 1024;

/// A part of a scratch file that one thread writes.
#[derive(Debug)]
struct Segment {
    number: u32,
    kept: Arc<Kept>,
    /// The handle; closed segments are opened again by their readers.
    file: Mutex<Option<Arc<File>>>,
    /// End of the bytes allocated so far.
    end: AtomicU64,
}

impl Segment {
    fn end(&self) -> u64 {
        self.end.load(Ordering::Relaxed)
    }
}

/// A scratch file. It exists until it is released.
#[derive(Debug)]
pub struct ScratchFile {
    /// Name in the folder.
    pub name: String,
    /// True if a resumed run needs the file.
    kept: bool,
    /// True if an earlier attempt deleted it.
    gone: bool,
    shared: Arc<Shared>,
    segments: Mutex<Vec<(u32, Arc<Segment>)>>,
    sections: Mutex<Vec<Place>>,
    reserved: Mutex<Reservation>,
}

impl ScratchFile {
    pub(super) fn open(name: &str, kept: bool, shared: &Arc<Shared>) -> Result<Self> {
        let run = shared.run.as_ref().filter(|_| kept);
        let file = Self {
            name: name.to_owned(),
            kept,
            gone: run.is_some_and(|run| run.is_deleted(name)),
            shared: shared.clone(),
            segments: Mutex::default(),
            sections: Mutex::default(),
            reserved: Mutex::new(shared.memory.promise("sections", 0)?),
        };
        for (section, place) in run.map(|run| run.places(name)).unwrap_or_default() {
            file.set(section, place)?;
            if !file.gone {
                let segment = file.segment(place.segment);
                let end = place.end().unwrap_or(0);
                let before = segment.end.fetch_max(end, Ordering::Relaxed);
                shared.io.grow_scratch(end.saturating_sub(before));
            }
        }
        Ok(file)
    }

    /// The segment with this number.
    fn segment(&self, number: u32) -> Arc<Segment> {
        let mut segments = lock(&self.segments);
        if let Some((_, segment)) = segments.iter().find(|(n, _)| *n == number) {
            return segment.clone();
        }
        let path = self.shared.folder.join(format!("{}.{number}", self.name));
        let segment = Arc::new(Segment {
            number,
            kept: Arc::new(Kept::new(path)),
            file: Mutex::new(None),
            end: AtomicU64::new(0),
        });
        segments.push((number, segment.clone()));
        segment
    }

    fn segments(&self) -> Vec<Arc<Segment>> {
        let segments = lock(&self.segments);
        segments
            .iter()
            .map(|(_, segment)| segment.clone())
            .collect()
    }

    /// Path of a segment.
    #[must_use]
    pub fn path(&self, segment: u32) -> PathBuf {
        self.segment(segment).kept.path.clone()
    }

    /// The store that has a segment, if other machines made it and share no folder.
    fn away(&self, segment: &Segment) -> Option<&Away> {
        let run = self.shared.run.as_ref().filter(|_| self.kept)?;
        run.away_of(segment.number)
    }

    /// The error of a segment of which bytes cannot be read: offset and number.
    fn unread(
        &self,
        segment: &Segment,
        (offset, wanted): (u64, usize),
        e: std::io::Error,
    ) -> Error {
        use std::io::ErrorKind::{NotFound, QuotaExceeded, StorageFull, UnexpectedEof};
        let path = &segment.kept.path;
        match e.kind() {
            UnexpectedEof | NotFound => {
                let (found, wanted) = ("the end of the file".into(), format!("{wanted} bytes"));
                self.damaged(segment.number, offset, found, wanted)
            }
            // There is no room for a copy.
            StorageFull | QuotaExceeded => failed_write(path, wanted, 0, e),
            _ => Error::io(path, format!("read {wanted} bytes"), e),
        }
    }

    /// Deletes the file; a later attempt does not need it any more.
    pub(super) fn delete(&self) -> Result<()> {
        if self.gone {
            return Ok(());
        }
        // Where a name stays until the last handle is closed, it would be in the way.
        self.close();
        let segments = self.segments().into_iter();
        let leaving = segments.map(|s| Leaving(s.kept.clone(), s.end()));
        match &self.shared.run {
            Some(run) if self.kept => run.delete(&self.name, leaving),
            _ => {
                leaving.for_each(|file| file.delete(&self.shared.io));
                Ok(())
            }
        }
    }

    /// True if a resumed run needs the file.
    #[must_use]
    pub fn is_kept(&self) -> bool {
        self.kept && self.shared.run.is_some()
    }

    /// True if an earlier attempt deleted the file.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        self.gone
    }

    /// Number of sections.
    #[must_use]
    pub fn count(&self) -> usize {
        lock(&self.sections).len()
    }

    /// The place of a section; an empty one if it was not written.
    #[must_use]
    pub fn section(&self, section: usize) -> Place {
        let sections = lock(&self.sections);
        sections.get(section).copied().unwrap_or_default()
    }

    /// Rows in all sections.
    #[must_use]
    pub fn records(&self) -> u64 {
        let sections = lock(&self.sections);
        sections.iter().map(|place| place.records as u64).sum()
    }

    /// Sets the place of a section.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no room for the list of sections.
    pub(crate) fn set(&self, section: u32, place: Place) -> Result<()> {
        let mut sections = lock(&self.sections);
        if section as usize >= sections.len() {
            let count = (section as usize + 1).next_power_of_two();
            if count > sections.capacity() {
                // A number from a damaged journal must not decide how much memory is allocated.
                if count > FEW {
                    lock(&self.reserved).at_least(count as u64 * SECTION)?;
                }
                let more = count - sections.len();
                sections.reserve_exact(more);
            }
            sections.resize(section as usize + 1, Place::default());
            if sections.len() > FEW {
                lock(&self.reserved).set_held(sections.len() as u64 * SECTION);
            }
        }
        sections[section as usize] = place;
        Ok(())
    }

    /// Records that a unit wrote the section `section`.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn put(&self, unit: &Unit<'_>, section: u32, place: Place) -> Result<()> {
        if self.kept && !self.gone {
            let file = self.name.clone();
            unit.note(Put {
                file,
                section,
                place,
            });
        }
        self.set(section, place)
    }

    /// Closes the handles; later reads open the file by its path.
    pub fn close(&self) {
        for segment in self.segments() {
            *lock(&segment.file) = None;
        }
    }

    /// Writes `bytes` with `records` rows to the segment of thread `worker`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Disk`] if the disk is full.
    pub fn append(&self, worker: usize, bytes: &[u8], records: usize) -> Result<Place> {
        let mut place = Place {
            segment: self.shared.run.as_ref().map_or(0, ResumableRun::first) + worker as u32,
            offset: 0,
            bytes: bytes.len(),
            records,
            crc: crc32fast::hash(bytes),
        };
        // A step that is done again may write to a file that is not needed any more.
        if self.gone || bytes.is_empty() {
            return Ok(place);
        }
        let segment = self.segment(place.segment);
        let file = self.created(&segment)?;
        let length = bytes.len() as u64;
        place.offset = segment.end.fetch_add(length, Ordering::Relaxed);
        self.shared.io.grow_scratch(length);
        fault::fallible(Event::Write)
            .and_then(|()| file.write_all_at(bytes, place.offset))
            .map_err(|e| failed_write(&segment.kept.path, bytes.len(), self.shared.more(), e))?;
        self.shared.io.add_written(length);
        if let (Some(run), true) = (&self.shared.run, self.kept) {
            run.keeper.sync_later(&segment.kept);
        }
        Ok(place)
    }

    /// The handle of a segment of this attempt.
    fn created(&self, segment: &Segment) -> Result<Arc<File>> {
        let mut handle = lock(&segment.file);
        if let Some(file) = &*handle {
            return Ok(file.clone());
        }
        let path = &segment.kept.path;
        let file = options().create_new(true).open(path);
        let file = Arc::new(file.map_err(|e| Error::io(path, "create", e))?);
        *handle = Some(file.clone());
        segment.kept.made();
        if let (Some(run), true) = (&self.shared.run, self.kept) {
            run.made(path);
        }
        Ok(file)
    }

    /// Fills `bytes` from `offset` of a segment.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Corrupt`] if the segment is too short.
    pub fn read(&self, segment: u32, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let wanted = bytes.len();
        if wanted == 0 {
            return Ok(());
        }
        let of = self.segment(segment);
        let read = match self.away(&of) {
            Some(away) => away.read(&of.kept.path, of.end(), bytes, offset),
            None => self
                .opened(&of)
                .and_then(|f| f.read_exact_at(bytes, offset)),
        };
        read.map_err(|e| self.unread(&of, (offset, wanted), e))?;
        self.shared.io.add_read(wanted as u64);
        Ok(())
    }

    /// The level at which rows are to be compressed; `None` if they are not.
    #[must_use]
    pub fn compression(&self) -> Option<i32> {
        Some(self.shared.level.load(Ordering::Relaxed)).filter(|level| *level > 0)
    }

    /// Bytes in the segments.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let segments = self.segments();
        segments.iter().map(|segment| segment.end()).sum()
    }

    /// Maps the segments, none of which is written any more, if files are to be mapped and the budget has
    /// room for these. The segments that are mapped, by number, and their reservation.
    #[must_use]
    pub fn map(&self) -> Option<(HashMap<u32, Mapping>, Reservation)> {
        let (bytes, memory) = (self.bytes(), &self.shared.memory);
        let io = self.shared.storage().io;
        let run = self.shared.run.as_ref();
        // What is elsewhere is fetched as far as it is read.
        if run.is_some_and(|run| run.away().is_some()) {
            return None;
        }
        if bytes == 0 || !io.maps(&self.shared.folder, bytes, memory.available()) {
            return None;
        }
        let held = memory.reserve("mapped points", bytes).ok()?;
        let segments: Vec<_> = lock(&self.segments).clone();
        let map = |(number, segment): (u32, Arc<Segment>)| {
            let file = self.opened(&segment).ok()?;
            Some((number, Mapping::of(&file)?))
        };
        Some((segments.into_iter().filter_map(map).collect(), held))
    }

    /// Bytes of a segment, from its mapping if that has them.
    ///
    /// # Errors
    /// See [`ScratchFile::read`].
    pub fn view<'a>(
        &self,
        segment: u32,
        mapping: Option<&'a Mapping>,
        offset: u64,
        bytes: usize,
    ) -> Result<Cow<'a, [u8]>> {
        if let Some(mapped) = mapping.and_then(|mapping| mapping.get(offset, bytes)) {
            self.shared.io.add_read(bytes as u64);
            return Ok(Cow::Borrowed(mapped));
        }
        let mut copy = vec![0; bytes];
        self.read(segment, offset, &mut copy)?;
        Ok(Cow::Owned(copy))
    }

    /// The handle of an existing segment.
    fn opened(&self, segment: &Segment) -> std::io::Result<Arc<File>> {
        let mut handle = lock(&segment.file);
        if let Some(file) = &*handle {
            return Ok(file.clone());
        }
        let file = Arc::new(open_existing(&segment.kept.path)?);
        *handle = Some(file.clone());
        Ok(file)
    }

    /// Fills `bytes` with the part at `place`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Corrupt`] if the bytes do not match their checksum.
    pub fn read_part(&self, place: Place, bytes: &mut [u8]) -> Result<()> {
        self.read(place.segment, place.offset, bytes)?;
        let crc = crc32fast::hash(bytes);
        if crc == place.crc || bytes.is_empty() {
            return Ok(());
        }
        let (found, expected) = (format!("checksum {crc:08x}"), format!("{:08x}", place.crc));
        Err(self.damaged(place.segment, place.offset, found, expected))
    }

    /// The error for content that differs from what was written.
    #[must_use]
    pub fn damaged(&self, segment: u32, offset: u64, found: String, expected: String) -> Error {
        Error::Corrupt {
            path: self.path(segment),
            offset,
            found,
            expected,
        }
    }
}
