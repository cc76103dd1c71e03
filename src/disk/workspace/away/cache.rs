//! Copies of segments that other processes made: parts of them, in files with holes.

use super::super::{lock, open};
use super::Store;
use outcrop_platform::FileAt;
use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Bytes that are fetched together at least: a request takes 20 to 50 ms, in which a store sends some MiB.
const CHUNK: u64 = 256 << 10;

/// Segments up to this size are fetched whole.
const WHOLE: u64 = 2 << 20;

/// Most bytes of a request.
const LONGEST: u64 = 4 << 20;

/// Requests for one segment at the same time.
const DOORS: usize = 4;

/// Copies of segments.
#[derive(Debug)]
pub(super) struct Cache {
    store: Arc<dyn Store>,
    folder: PathBuf,
    /// Most bytes of all copies.
    limit: u64,
    held: AtomicU64,
    clock: AtomicU64,
    copies: Mutex<HashMap<String, Arc<Copied>>>,
}

/// The copy of a segment.
#[derive(Debug)]
struct Copied {
    /// The time of its last use.
    used: AtomicU64,
    state: Mutex<State>,
    /// Whoever fetches a part of the segment holds one of these, so that nobody fetches it as well.
    doors: [Mutex<()>; DOORS],
}

#[derive(Debug)]
struct State {
    file: File,
    /// For each chunk, how many of its bytes are here.
    have: Vec<u32>,
}

impl State {
    /// The chunks of a range that are not here, from the first to the last.
    fn missing(&self, range: &Range<u64>) -> Option<Range<u64>> {
        let chunks = range.start / CHUNK..range.end.div_ceil(CHUNK);
        let lacks = |chunk: &u64| {
            let wanted = range.end.min((chunk + 1) * CHUNK) - chunk * CHUNK;
            self.have
                .get(*chunk as usize)
                .is_none_or(|have| u64::from(*have) < wanted)
        };
        let first = chunks.clone().find(lacks)?;
        let last = chunks.rev().find(lacks).unwrap_or(first);
        Some(first..last + 1)
    }

    /// Puts bytes at the beginning of a chunk; the number of bytes that are new.
    fn put(&mut self, first: u64, bytes: &[u8]) -> io::Result<u64> {
        self.file.write_all_at(bytes, first * CHUNK)?;
        let mut new = 0;
        for (chunk, part) in (first as usize..).zip(bytes.chunks(CHUNK as usize)) {
            if self.have.len() <= chunk {
                self.have.resize(chunk + 1, 0);
            }
            new += (part.len() as u64).saturating_sub(self.have[chunk].into());
            self.have[chunk] = self.have[chunk].max(part.len() as u32);
        }
        Ok(new)
    }

    fn bytes(&self) -> u64 {
        self.have.iter().map(|have| u64::from(*have)).sum()
    }
}

impl Cache {
    pub(super) fn new(store: Arc<dyn Store>, folder: PathBuf, limit: u64) -> Self {
        Self {
            store,
            folder,
            limit,
            held: AtomicU64::new(0),
            clock: AtomicU64::new(0),
            copies: Mutex::default(),
        }
    }

    fn copied(&self, name: &str) -> io::Result<Arc<Copied>> {
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        let mut copies = lock(&self.copies);
        if let Some(copied) = copies.get(name) {
            copied.used.store(now, Ordering::Relaxed);
            return Ok(copied.clone());
        }
        let path = self.folder.join(name);
        let file = open::options().create(true).truncate(true).open(path)?;
        let copied = Arc::new(Copied {
            used: AtomicU64::new(now),
            state: Mutex::new(State {
                file,
                have: Vec::new(),
            }),
            doors: Default::default(),
        });
        copies.insert(name.to_owned(), copied.clone());
        Ok(copied)
    }

    /// Fills `bytes` from `offset` of a segment with at least `end` bytes.
    pub(super) fn read(
        &self,
        name: &str,
        end: u64,
        bytes: &mut [u8],
        offset: u64,
    ) -> io::Result<()> {
        let copied = self.copied(name)?;
        let wanted = offset..offset.saturating_add(bytes.len() as u64);
        let end = end.max(wanted.end);
        loop {
            let missing = {
                let state = lock(&copied.state);
                match state.missing(&wanted) {
                    None => return state.file.read_exact_at(bytes, offset),
                    Some(missing) => missing,
                }
            };
            self.fetch(name, &copied, missing, end)?;
        }
    }

    /// Fetches all of a segment.
    pub(super) fn bring(&self, name: &str, end: u64) -> io::Result<()> {
        let copied = self.copied(name)?;
        loop {
            let missing = lock(&copied.state).missing(&(0..end));
            match missing {
                None => return Ok(()),
                Some(missing) => self.fetch(name, &copied, missing, end)?,
            }
        }
    }

    /// Forgets a copy, and deletes its file.
    pub(super) fn forget(&self, name: &str) {
        if let Some(copied) = lock(&self.copies).remove(name) {
            let bytes = lock(&copied.state).bytes();
            self.held.fetch_sub(bytes, Ordering::Relaxed);
            let _ = std::fs::remove_file(self.folder.join(name));
        }
    }

    /// Fetches the first of these chunks that is missing, and more in one request.
    fn fetch(&self, name: &str, copied: &Copied, chunks: Range<u64>, end: u64) -> io::Result<()> {
        let door = (chunks.start * CHUNK / LONGEST) as usize % DOORS;
        let _door = lock(&copied.doors[door]);
        let range = match end <= WHOLE {
            true => 0..end,
            false => {
                let begin = chunks.start * CHUNK;
                begin..end.min(chunks.end * CHUNK).min(begin + LONGEST)
            }
        };
        // Another thread may have fetched it meanwhile.
        if lock(&copied.state).missing(&range).is_none() {
            return Ok(());
        }
        let bytes = self.store.read(name, range.clone())?;
        let new = lock(&copied.state).put(range.start / CHUNK, &bytes)?;
        let held = self.held.fetch_add(new, Ordering::Relaxed) + new;
        if held > self.limit {
            self.make_room(name);
        }
        Ok(())
    }

    /// Empties the copies that were not used for the longest time, until the others take three quarters of the limit.
    fn make_room(&self, but: &str) {
        let copies: Vec<(String, Arc<Copied>)> = lock(&self.copies)
            .iter()
            .filter(|(name, _)| *name != but)
            .map(|(name, copied)| (name.clone(), copied.clone()))
            .collect();
        let mut copies: Vec<_> = copies
            .into_iter()
            .map(|(_, copied)| (copied.used.load(Ordering::Relaxed), copied))
            .collect();
        copies.sort_by_key(|(used, _)| *used);
        for (_, copied) in copies {
            if self.held.load(Ordering::Relaxed) <= self.limit / 4 * 3 {
                return;
            }
            let mut state = lock(&copied.state);
            if state.file.set_len(0).is_ok() {
                self.held.fetch_sub(state.bytes(), Ordering::Relaxed);
                state.have.clear();
            }
        }
    }
}
