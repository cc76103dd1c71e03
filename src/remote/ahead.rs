//! Ranges that are fetched before they are read: while points are decoded, the next ones are on their way.
//!
//! Ranges are joined and cut to pieces. Threads fetch one piece after another, as long as the pieces hold no more than
//! the memory that they were given; one that readers have taken what was wanted of is freed. A reader that is ahead of
//! the threads fetches its piece itself, or, if there is no room for it, only what it reads; so nobody waits for room.

#[cfg(test)]
mod tests;

use super::pieces::{Piece, pieces};
use bytes::Bytes;
use std::io;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Most requests at the same time.
const REQUESTS: usize = 8;

/// The state of a piece.
#[derive(Debug)]
enum State {
    Waiting,
    Asked,
    Here(Bytes),
    /// Taken, or failed: readers ask for what they want.
    Gone,
}

/// Pieces in the order of their places, and which one is next.
#[derive(Debug)]
struct Pieces {
    all: Vec<(Piece, State)>,
    /// The order in which they are read.
    order: Vec<usize>,
    next: usize,
    /// Bytes that are asked for or here.
    held: u64,
    ended: bool,
}

/// Memory for pieces, and who fetches them.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Most bytes that pieces hold. What has no room is not kept: its reader asks for it alone.
    pub bytes: u64,
    /// True if threads fetch pieces in the order of reading; else a piece is fetched when it is read first.
    pub is_ahead: bool,
}

/// What a reader finds.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Got {
    /// So many bytes are in its buffer.
    Copied(usize),
    /// So many bytes are not here: it asks for them itself.
    Absent(usize),
}

/// Fetches the piece of this number and range.
type Fetch = Box<dyn Fn(usize, Range<u64>) -> io::Result<Bytes> + Send + Sync>;

/// Pieces, and the threads that fetch them.
pub(crate) struct Ahead {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for Ahead {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let threads = self.threads.len();
        f.debug_struct("Ahead")
            .field("threads", &threads)
            .finish_non_exhaustive()
    }
}

struct Shared {
    pieces: Mutex<Pieces>,
    changed: Condvar,
    fetch: Fetch,
    most: u64,
}

impl Ahead {
    /// Pieces of these ranges of one file.
    pub(crate) fn of_ranges(
        ranges: impl IntoIterator<Item = Range<u64>>,
        room: Room,
        fetch: impl Fn(Range<u64>) -> io::Result<Bytes> + Send + Sync + 'static,
    ) -> Self {
        Self::new(pieces(ranges), room, Box::new(move |_, range| fetch(range)))
    }

    /// Files that are pieces, of at most so many bytes each, in the order in which they are read.
    pub(crate) fn of_files(
        sizes: impl IntoIterator<Item = u64>,
        room: Room,
        fetch: impl Fn(usize) -> io::Result<Bytes> + Send + Sync + 'static,
    ) -> Self {
        let mut end = 0;
        let place = |size: u64| {
            let start = end;
            end += size.max(1);
            Piece::whole(start..end)
        };
        let all: Vec<Piece> = sizes.into_iter().map(place).collect();
        let order = (0..all.len()).collect();
        Self::new((all, order), room, Box::new(move |file, _| fetch(file)))
    }

    fn new((all, order): (Vec<Piece>, Vec<usize>), room: Room, fetch: Fetch) -> Self {
        let threads = match room.is_ahead && room.bytes > 0 {
            true => REQUESTS.min(all.len()),
            false => 0,
        };
        let all = all.into_iter().map(|piece| (piece, State::Waiting));
        let shared = Arc::new(Shared {
            pieces: Mutex::new(Pieces {
                all: all.collect(),
                order,
                next: 0,
                held: 0,
                ended: false,
            }),
            changed: Condvar::new(),
            fetch,
            most: room.bytes,
        });
        let thread = |_| {
            let shared = shared.clone();
            let named = std::thread::Builder::new().name("fetch".into());
            named.spawn(move || shared.run()).ok()
        };
        let threads = (0..threads).filter_map(thread).collect();
        Self { shared, threads }
    }

    /// Fills `buffer` from `offset` as far as the piece there reaches, or says how far nothing is here.
    pub(crate) fn read(&self, buffer: &mut [u8], offset: u64) -> io::Result<Got> {
        self.shared.read(buffer, offset)
    }

    /// All of a file that is a piece; it is taken once.
    pub(crate) fn take(&self, file: usize) -> io::Result<Bytes> {
        let mut pieces = self.shared.here(self.shared.lock(), file)?;
        let (piece, state) = &mut pieces.all[file];
        match std::mem::replace(state, State::Gone) {
            State::Here(bytes) => {
                self.shared.free(pieces, bytes.len() as u64);
                Ok(bytes)
            }
            // It was taken before, or a thread failed to fetch it, or there is no room for it.
            _ => {
                let range = piece.range.clone();
                self.shared.free(pieces, 0);
                self.shared.fetch(file, range)
            }
        }
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.changed.notify_all();
        for thread in self.threads.drain(..) {
            // It has nothing to report: a reader gets its errors.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Pieces> {
        self.pieces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Fetches pieces until none is left.
    fn run(&self) {
        while let Some((piece, range)) = self.next() {
            // What fails here is asked for again by its reader, who tells the error.
            let got = self.fetch(piece, range.clone()).ok();
            self.put(piece, &range, got);
        }
    }

    /// Asks for a piece. A panic is an error too: readers wait for a piece that was asked for.
    fn fetch(&self, piece: usize, range: Range<u64>) -> io::Result<Bytes> {
        let ask = AssertUnwindSafe(|| (self.fetch)(piece, range));
        let panicked = |_| Err(io::Error::other("a request for it panicked"));
        catch_unwind(ask).unwrap_or_else(panicked)
    }

    /// The next piece for which there is room.
    fn next(&self) -> Option<(usize, Range<u64>)> {
        let mut pieces = self.lock();
        loop {
            if pieces.ended {
                return None;
            }
            let number = *pieces.order.get(pieces.next)?;
            if !matches!(pieces.all[number].1, State::Waiting) {
                pieces.next += 1;
            } else if let Some(range) = self.ask(&mut pieces, number) {
                pieces.next += 1;
                return Some((number, range));
            } else {
                let woken = self.changed.wait(pieces);
                pieces = woken.unwrap_or_else(PoisonError::into_inner);
            }
        }
    }

    /// Notes that a piece is asked for; none if there is no room for it.
    fn ask(&self, pieces: &mut Pieces, number: usize) -> Option<Range<u64>> {
        let (piece, state) = &mut pieces.all[number];
        let held = pieces.held + piece.bytes();
        if held > self.most {
            return None;
        }
        pieces.held = held;
        *state = State::Asked;
        Some(piece.range.clone())
    }

    fn put(&self, piece: usize, range: &Range<u64>, got: Option<Bytes>) {
        let mut pieces = self.lock();
        // A file may be smaller than it can be at most.
        let size = got.as_ref().map_or(0, |bytes| bytes.len() as u64);
        pieces.all[piece].1 = got.map_or(State::Gone, State::Here);
        self.free(pieces, (range.end - range.start).saturating_sub(size));
    }

    /// Gives memory back, and tells the threads that wait for it, or for a piece that is gone.
    fn free(&self, mut pieces: MutexGuard<'_, Pieces>, bytes: u64) {
        pieces.held = pieces.held.saturating_sub(bytes);
        drop(pieces);
        self.changed.notify_all();
    }

    /// Waits for a piece that was asked for. If nobody has begun to, it is fetched, or left if there is no room.
    fn here<'a>(
        &'a self,
        mut pieces: MutexGuard<'a, Pieces>,
        number: usize,
    ) -> io::Result<MutexGuard<'a, Pieces>> {
        loop {
            match pieces.all[number].1 {
                State::Here(_) | State::Gone => return Ok(pieces),
                State::Asked => {
                    let woken = self.changed.wait(pieces);
                    pieces = woken.unwrap_or_else(PoisonError::into_inner);
                }
                State::Waiting => {
                    let Some(range) = self.ask(&mut pieces, number) else {
                        return Ok(pieces);
                    };
                    drop(pieces);
                    let (got, failed) = match self.fetch(number, range.clone()) {
                        Ok(bytes) => (Some(bytes), None),
                        Err(e) => (None, Some(e)),
                    };
                    self.put(number, &range, got);
                    if let Some(e) = failed {
                        return Err(e);
                    }
                    pieces = self.lock();
                }
            }
        }
    }

    fn read(&self, buffer: &mut [u8], offset: u64) -> io::Result<Got> {
        let pieces = self.lock();
        let after = pieces
            .all
            .partition_point(|(piece, _)| piece.range.start <= offset);
        let before = after.checked_sub(1);
        let inside = before.filter(|&number| offset < pieces.all[number].0.range.end);
        let Some(number) = inside else {
            let next = pieces.all.get(after).map(|(piece, _)| piece.range.start);
            return Ok(Got::Absent(upto(buffer.len(), offset, next)));
        };
        let mut pieces = self.here(pieces, number)?;
        let (piece, state) = &mut pieces.all[number];
        let done = upto(buffer.len(), offset, Some(piece.range.end));
        piece.take(&(offset..offset + done as u64));
        let got = match state {
            State::Here(bytes) => {
                let from = (offset - piece.range.start) as usize;
                buffer[..done].copy_from_slice(&bytes[from..from + done]);
                Got::Copied(done)
            }
            _ => Got::Absent(done),
        };
        if piece.is_taken() {
            let bytes = match std::mem::replace(state, State::Gone) {
                State::Here(bytes) => bytes.len() as u64,
                _ => 0,
            };
            self.free(pieces, bytes);
        }
        Ok(got)
    }
}

/// How many of `wanted` bytes from `offset` lie before `end`.
fn upto(wanted: usize, offset: u64, end: Option<u64>) -> usize {
    let most = end.map_or(u64::MAX, |end| end - offset);
    wanted.min(usize::try_from(most).unwrap_or(usize::MAX))
}
