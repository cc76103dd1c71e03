//! Ranges that are fetched before they are read: while points are decoded, the next ones are on their way.
//!
//! Ranges are joined and cut to pieces. Threads fetch one piece after another, as long as those that wait for a reader
//! hold no more than the memory that they were given. A reader that is ahead of them fetches its piece itself; so
//! nobody waits for room.

use bytes::Bytes;
use std::io;
use std::ops::Range;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Most bytes of a piece: at 100 MB/s a request of it takes 40 ms, of which 10 are spent waiting.
pub(crate) const PIECE: u64 = 4 << 20;

/// Ranges with a smaller gap between them are one request.
const GAP: u64 = 16 << 10;

/// Most requests at the same time.
const REQUESTS: usize = 8;

/// A piece and what is known of it.
#[derive(Debug)]
struct Piece {
    range: Range<u64>,
    state: State,
}

#[derive(Debug)]
enum State {
    Waiting,
    Asked,
    /// Fetched, with the bytes that no reader has taken yet.
    Here(Bytes, u64),
    /// Taken, or failed: readers ask for what they want.
    Gone,
}

/// Pieces in the order of their places, and which one is next.
#[derive(Debug)]
struct Pieces {
    all: Vec<Piece>,
    /// The order in which they are read.
    order: Vec<usize>,
    next: usize,
    /// Bytes that are asked for or here.
    held: u64,
    ended: bool,
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
    /// Pieces of these ranges of one file. Without memory for a piece, each is fetched when it is read first.
    pub(crate) fn of_ranges(
        ranges: impl IntoIterator<Item = Range<u64>>,
        bytes: u64,
        fetch: impl Fn(Range<u64>) -> io::Result<Bytes> + Send + Sync + 'static,
    ) -> Self {
        Self::new(
            pieces(ranges),
            bytes,
            Box::new(move |_, range| fetch(range)),
        )
    }

    /// Files that are pieces, of at most so many bytes each, in the order in which they are read.
    pub(crate) fn of_files(
        sizes: impl IntoIterator<Item = u64>,
        bytes: u64,
        fetch: impl Fn(usize) -> io::Result<Bytes> + Send + Sync + 'static,
    ) -> Self {
        let mut end = 0;
        let place = |size: u64| {
            let start = end;
            end += size.max(1);
            start..end
        };
        let all: Vec<Range<u64>> = sizes.into_iter().map(place).collect();
        let order = (0..all.len()).collect();
        Self::new((all, order), bytes, Box::new(move |file, _| fetch(file)))
    }

    fn new((all, order): (Vec<Range<u64>>, Vec<usize>), bytes: u64, fetch: Fetch) -> Self {
        let threads = REQUESTS.min(all.len()) * usize::from(bytes > 0);
        let all = all.into_iter().map(|range| Piece {
            range,
            state: State::Waiting,
        });
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
            most: bytes,
        });
        let thread = |_| {
            let shared = shared.clone();
            let named = std::thread::Builder::new().name("fetch".into());
            named.spawn(move || shared.run()).ok()
        };
        let threads = (0..threads).filter_map(thread).collect();
        Self { shared, threads }
    }

    /// Fills `buffer` from `offset` as far as the piece there reaches; none outside of all pieces.
    pub(crate) fn read(&self, buffer: &mut [u8], offset: u64) -> io::Result<Option<usize>> {
        self.shared.read(buffer, offset)
    }

    /// All of a file that is a piece; it is taken once.
    pub(crate) fn take(&self, file: usize) -> io::Result<Bytes> {
        let mut pieces = self.shared.here(self.shared.lock(), file)?;
        let piece = &mut pieces.all[file];
        match std::mem::replace(&mut piece.state, State::Gone) {
            State::Here(bytes, _) => {
                self.shared.free(pieces, bytes.len() as u64);
                Ok(bytes)
            }
            // It was taken before, or a thread failed to fetch it.
            _ => {
                let range = piece.range.clone();
                drop(pieces);
                (self.shared.fetch)(file, range)
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

/// Pieces sorted by place, and their numbers in the order in which they are read first.
fn pieces(ranges: impl IntoIterator<Item = Range<u64>>) -> (Vec<Range<u64>>, Vec<usize>) {
    let mut given: Vec<(Range<u64>, usize)> = ranges
        .into_iter()
        .filter(|range| !range.is_empty())
        .zip(0..)
        .collect();
    given.sort_by_key(|(range, _)| (range.start, range.end));
    let mut joined: Vec<(Range<u64>, usize)> = Vec::new();
    for (range, turn) in given {
        match joined.last_mut() {
            // Whole ranges come into one piece, so that a reader of one waits for one request.
            Some((last, first))
                if range.start <= last.end + GAP && range.end - last.start <= PIECE =>
            {
                last.end = last.end.max(range.end);
                *first = turn.min(*first);
            }
            last => {
                let start = last.map_or(range.start, |(last, _)| range.start.max(last.end));
                let cuts = (start..range.end).step_by(PIECE as usize);
                joined.extend(cuts.map(|at| (at..range.end.min(at + PIECE), turn)));
            }
        }
    }
    let mut order: Vec<usize> = (0..joined.len()).collect();
    order.sort_by_key(|&piece| joined[piece].1);
    (joined.into_iter().map(|(range, _)| range).collect(), order)
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Pieces> {
        self.pieces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Fetches pieces until none is left.
    fn run(&self) {
        while let Some((piece, range)) = self.take() {
            // What fails here is asked for again by its reader, who tells the error.
            let got = (self.fetch)(piece, range.clone()).ok();
            self.put(piece, &range, got);
        }
    }

    /// The next piece for which there is room.
    fn take(&self) -> Option<(usize, Range<u64>)> {
        let mut pieces = self.lock();
        loop {
            if pieces.ended {
                return None;
            }
            let piece = *pieces.order.get(pieces.next)?;
            let range = pieces.all[piece].range.clone();
            let size = range.end - range.start;
            if !matches!(pieces.all[piece].state, State::Waiting) {
                pieces.next += 1;
            } else if pieces.held + size <= self.most {
                pieces.next += 1;
                pieces.held += size;
                pieces.all[piece].state = State::Asked;
                return Some((piece, range));
            } else {
                let woken = self.changed.wait(pieces);
                pieces = woken.unwrap_or_else(PoisonError::into_inner);
            }
        }
    }

    fn put(&self, piece: usize, range: &Range<u64>, got: Option<Bytes>) {
        let mut pieces = self.lock();
        // A file may be smaller than it can be at most.
        let size = got.as_ref().map_or(0, |bytes| bytes.len() as u64);
        pieces.all[piece].state = match got {
            Some(bytes) => State::Here(bytes, size),
            None => State::Gone,
        };
        self.free(pieces, (range.end - range.start).saturating_sub(size));
    }

    /// Gives memory back, and tells the threads that wait for it.
    fn free(&self, mut pieces: MutexGuard<'_, Pieces>, bytes: u64) {
        pieces.held = pieces.held.saturating_sub(bytes);
        drop(pieces);
        self.changed.notify_all();
    }

    /// Waits until a piece is here or gone; fetches it if nobody has begun to.
    fn here<'a>(
        &'a self,
        mut pieces: MutexGuard<'a, Pieces>,
        number: usize,
    ) -> io::Result<MutexGuard<'a, Pieces>> {
        loop {
            let piece = &mut pieces.all[number];
            match piece.state {
                State::Here(..) | State::Gone => return Ok(pieces),
                State::Asked => {
                    let woken = self.changed.wait(pieces);
                    pieces = woken.unwrap_or_else(PoisonError::into_inner);
                }
                State::Waiting => {
                    let range = piece.range.clone();
                    piece.state = State::Asked;
                    pieces.held += range.end - range.start;
                    drop(pieces);
                    let (got, failed) = match (self.fetch)(number, range.clone()) {
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

    fn read(&self, buffer: &mut [u8], offset: u64) -> io::Result<Option<usize>> {
        let pieces = self.lock();
        let after = pieces.all.partition_point(|p| p.range.start <= offset);
        let Some(number) = after.checked_sub(1) else {
            return Ok(None);
        };
        let range = pieces.all[number].range.clone();
        if offset >= range.end {
            return Ok(None);
        }
        let mut pieces = self.here(pieces, number)?;
        let piece = &mut pieces.all[number];
        let State::Here(bytes, left) = &mut piece.state else {
            return Ok(None);
        };
        let from = &bytes[(offset - range.start) as usize..];
        let done = buffer.len().min(from.len());
        buffer[..done].copy_from_slice(&from[..done]);
        *left = left.saturating_sub(done as u64);
        if *left == 0 {
            piece.state = State::Gone;
            self.free(pieces, range.end - range.start);
        }
        Ok(Some(done))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_ranges_are_joined_and_long_ones_cut() {
        let (all, order) = pieces([10..20, 30..40, 1 << 20..(1 << 20) + 5]);
        assert_eq!(all, [10..40, 1 << 20..(1 << 20) + 5]);
        assert_eq!(order, [0, 1]);
        let long = 3..3 + 2 * PIECE + 1;
        let (all, _) = pieces([long.clone()]);
        assert_eq!(all.len(), 3);
        assert_eq!((all[0].start, all[2].end), (long.start, long.end));
        assert!(all.windows(2).all(|w| w[0].end == w[1].start));
    }

    #[test]
    fn the_order_is_that_of_reading_and_nothing_is_fetched_twice() {
        let far = 100 << 20;
        let (all, order) = pieces([far..far + 10, 0..10, 5..12, 3..3]);
        assert_eq!(all, [0..12, far..far + 10]);
        assert_eq!(order, [1, 0]);
    }
}
