//! A remote file that is read by ranges.

use super::agent::Counts;
use super::ahead::{Ahead, Got, Room};
use super::answer::Answer;
use super::errors::{changed, told};
use super::location::Location;
use super::stores::{Patience, Place, place_of_new};
use super::wait::wait;
use bytes::Bytes;
use object_store::{GetOptions, GetRange, GetResult, ObjectMeta, ObjectStore};
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

/// Bytes that the first request asks for: most headers are in them.
const HEAD: u64 = 64 << 10;

/// Bytes that are kept of a file that cannot be read in parts: the most that tell a format.
const LONG_HEAD: u64 = 1 << 20;

/// A pause after an answer that broke off.
const PAUSE: Duration = Duration::from_millis(500);

/// A remote file.
#[derive(Debug)]
pub struct Object {
    pub(crate) file: Arc<Remote>,
    /// Its first bytes.
    head: Bytes,
    ahead: RwLock<Option<Ahead>>,
}

/// What tells one version of a file from another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Version {
    /// Size in bytes.
    pub bytes: u64,
    /// The entity tag, which changes with the content; none if the server says none.
    pub tag: Option<String>,
    /// Seconds since 1970 and nanoseconds of the last change.
    pub modified: (i64, u32),
}

impl Version {
    pub(crate) fn of(meta: &ObjectMeta) -> Self {
        let time = meta.last_modified;
        Self {
            bytes: meta.size,
            tag: meta.e_tag.clone(),
            modified: (time.timestamp(), time.timestamp_subsec_nanos()),
        }
    }
}

/// What a request for a part of the file needs.
#[derive(Debug)]
pub(crate) struct Remote {
    pub(crate) place: Place,
    version: Version,
    counts: Arc<Counts>,
    has_parts: bool,
}

impl Object {
    /// Opens a remote file: asks for its size, its version and its first bytes.
    ///
    /// # Errors
    /// [`ErrorKind::NotFound`], [`ErrorKind::PermissionDenied`]; anything else that ends a request, after
    /// some seconds.
    pub fn open(location: &Location, counts: &Arc<Counts>) -> io::Result<Self> {
        let (place, temper) = place_of_new(location, counts).map_err(told)?;
        let (got, has_parts) = match ask(&place, Some(0..HEAD), None) {
            Ok(got) => (got, true),
            // The server has no ranges, or nothing is in the file.
            Err(e) if e.kind() == ErrorKind::Unsupported => (ask(&place, None, None)?, false),
            Err(e) => return Err(e),
        };
        let version = Version::of(&got.meta);
        let kept = version.bytes.min(if has_parts { HEAD } else { LONG_HEAD });
        let head = Answer::of(got).take(kept)?;
        temper.calm();
        let file = Remote {
            place,
            version,
            counts: counts.clone(),
            has_parts,
        };
        Ok(Self {
            file: Arc::new(file),
            head,
            ahead: RwLock::default(),
        })
    }

    /// Size in bytes.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.file.version.bytes
    }

    /// True if the server sends parts of the file. Else only [`super::Whole`] reads it, and [`Self::read_at`] its
    /// first MiB.
    #[must_use]
    pub fn has_parts(&self) -> bool {
        self.file.has_parts
    }

    /// Its version when it was opened.
    #[must_use]
    pub fn version(&self) -> &Version {
        &self.file.version
    }

    /// Requests and bytes so far.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.file.counts
    }

    /// Fetches ranges in pieces, which are kept until all that was asked for of them is read: before they are read, with
    /// requests side by side, or then, as `room` says. Replaces the ranges of an earlier call. Ranges are in the order in
    /// which they will be read. Of the first bytes, which are here, nothing is fetched.
    pub fn expect(&self, ranges: impl IntoIterator<Item = Range<u64>>, room: Room) {
        let ahead = self.ahead.write();
        let mut ahead = ahead.unwrap_or_else(PoisonError::into_inner);
        // The threads of the earlier ones end first.
        *ahead = None;
        let file = self.file.clone();
        let head = self.head.len() as u64;
        let ranges = ranges
            .into_iter()
            .map(|range| range.start.max(head)..range.end);
        *ahead = Some(Ahead::of_ranges(ranges, room, move |range| {
            file.fetch(range)
        }));
    }

    /// Fills `buffer` from `offset`, as far as the file reaches or what was fetched together; returns the bytes read,
    /// which are none only at the end.
    ///
    /// # Errors
    /// As [`Self::open`], after minutes of failed requests; [`ErrorKind::InvalidData`] if the file has changed since
    /// it was opened.
    pub fn read_at(&self, buffer: &mut [u8], offset: u64) -> io::Result<usize> {
        let left = self.size().saturating_sub(offset);
        let wanted = buffer
            .len()
            .min(usize::try_from(left).unwrap_or(usize::MAX));
        let buffer = &mut buffer[..wanted];
        if wanted == 0 {
            return Ok(0);
        }
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        if let Some(here) = self.head.get(start..).filter(|here| !here.is_empty()) {
            let done = wanted.min(here.len());
            buffer[..done].copy_from_slice(&here[..done]);
            return Ok(done);
        }
        let ahead = self.ahead.read().unwrap_or_else(PoisonError::into_inner);
        let absent = match &*ahead {
            Some(ahead) => match ahead.read(buffer, offset)? {
                Got::Copied(done) => return Ok(done),
                Got::Absent(part) => part,
            },
            None => wanted,
        };
        drop(ahead);
        self.file.fill(&mut buffer[..absent], offset)?;
        Ok(absent)
    }
}

impl Remote {
    /// The bytes of a range inside the file. An answer that breaks off is asked for again.
    pub(crate) fn fetch(&self, range: Range<u64>) -> io::Result<Bytes> {
        again(|| self.once(range.clone()))
    }

    fn once(&self, range: Range<u64>) -> io::Result<Bytes> {
        let got = self.ask(Some(range.clone()))?;
        Answer::of(got).take(range.end - range.start)
    }

    /// Fills `buffer` from `offset`, as [`Self::fetch`], without memory for a copy.
    fn fill(&self, buffer: &mut [u8], offset: u64) -> io::Result<()> {
        let range = offset..offset + buffer.len() as u64;
        again(|| Answer::of(self.ask(Some(range.clone()))?).fill(buffer))
    }

    /// All bytes, as they arrive.
    pub(crate) fn stream(&self) -> io::Result<Answer> {
        Ok(Answer::of(self.ask(None)?))
    }

    fn ask(&self, range: Option<Range<u64>>) -> io::Result<GetResult> {
        // A weak tag is of no use for this.
        let Version { bytes, tag, .. } = &self.version;
        let usable = tag.clone().filter(|tag| !tag.starts_with("W/"));
        let got = ask(&self.place, range, usable)?;
        match (got.meta.size, &got.meta.e_tag) == (*bytes, tag) {
            true => Ok(got),
            false => Err(changed()),
        }
    }
}

/// Repeats a request whose answer breaks off.
pub(crate) fn again<T>(mut once: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    let begun = Instant::now();
    loop {
        match once() {
            Err(e)
                if e.kind() == ErrorKind::UnexpectedEof
                    && begun.elapsed() < Patience::Long.time() =>
            {
                std::thread::sleep(PAUSE);
            }
            done => return done,
        }
    }
}

/// Asks for a range, or for the whole file.
pub(crate) fn ask(
    (store, path): &Place,
    range: Option<Range<u64>>,
    tag: Option<String>,
) -> io::Result<GetResult> {
    let options = GetOptions {
        range: range.map(GetRange::Bounded),
        if_match: tag,
        ..GetOptions::default()
    };
    wait(store.get_opts(path, options))?.map_err(told)
}
