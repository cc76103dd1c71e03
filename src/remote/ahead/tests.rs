//! Memory that pieces hold, and requests that panic.

use super::*;
use crate::pieces::PIECE;
use std::time::{Duration, Instant};

const MIB: u64 = 1 << 20;

fn room(bytes: u64) -> Room {
    Room {
        bytes,
        is_ahead: true,
    }
}

/// Pieces whose bytes are zero.
fn zeros(ranges: impl IntoIterator<Item = Range<u64>>, most: u64) -> Ahead {
    Ahead::of_ranges(ranges, room(most), |range| {
        Ok(vec![0; (range.end - range.start) as usize].into())
    })
}

/// Reads a range as a reader does; returns how much of it was absent.
fn read_range(ahead: &Ahead, range: Range<u64>) -> usize {
    let mut buffer = vec![1; (range.end - range.start) as usize];
    let (mut at, mut absent) = (0, 0);
    while at < buffer.len() {
        let from = &mut buffer[at..];
        at += match ahead.read(from, range.start + at as u64).unwrap() {
            Got::Copied(done) => done,
            Got::Absent(done) => {
                absent += done;
                done
            }
        };
    }
    absent
}

fn held(ahead: &Ahead) -> u64 {
    ahead.shared.lock().held
}

/// Waits until threads have fetched as much as they may.
fn settled(ahead: &Ahead, bytes: u64) {
    let begun = Instant::now();
    while held(ahead) != bytes {
        let found = held(ahead);
        assert!(
            begun.elapsed() < Duration::from_secs(20),
            "{found} bytes held, expected {bytes}"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn pieces_with_gaps_are_freed_when_what_was_wanted_is_read() {
    // 64 pairs of ranges, each of which is a piece with a gap.
    let part = PIECE / 2 - 5_000;
    let pairs: Vec<Range<u64>> = (0..64)
        .flat_map(|pair| {
            let start = pair * 2 * PIECE;
            [
                start..start + part,
                start + part + 10_000..start + 2 * part + 10_000,
            ]
        })
        .collect();
    let most = 8 * PIECE;
    let ahead = zeros(pairs.clone(), most);
    let mut absent = 0;
    for (number, range) in pairs.into_iter().enumerate() {
        if number == 64 {
            // Half of all is read, and fetching goes on.
            settled(&ahead, most);
        }
        absent += read_range(&ahead, range);
        let held = held(&ahead);
        assert!(held <= most, "{held} of {most}");
    }
    assert_eq!((absent, held(&ahead)), (0, 0));
}

#[test]
fn a_reader_that_finds_no_room_takes_no_piece() {
    let most = 2 * PIECE;
    let ahead = zeros(std::iter::once(0..5 * PIECE), most);
    settled(&ahead, most);
    // All room is for the first pieces.
    assert_eq!(read_range(&ahead, 4 * PIECE..5 * PIECE), PIECE as usize);
    assert_eq!(held(&ahead), most);
    assert_eq!(read_range(&ahead, 0..PIECE), 0);
    settled(&ahead, most);
    assert_eq!(read_range(&ahead, PIECE..3 * PIECE), 0);
    // The last piece was read before.
    settled(&ahead, PIECE);
    assert_eq!(read_range(&ahead, 3 * PIECE..4 * PIECE), 0);
    assert_eq!(held(&ahead), 0);
}

#[test]
fn a_request_that_panics_lets_no_reader_wait() {
    for most in [MIB, 0] {
        let broken = |_| panic!("a fault of the program");
        let ranges = Ahead::of_ranges([0..100, MIB..MIB + 100], room(most), broken);
        for at in [0, MIB, 0] {
            // It is told, or asks itself.
            match ranges.read(&mut [0; 100], at) {
                Ok(got) => assert_eq!(got, Got::Absent(100)),
                Err(e) => assert!(e.to_string().contains("panicked"), "{e}"),
            }
        }
        let files = Ahead::of_files([100, 100], room(most), |_| panic!("the same"));
        for file in [1, 0] {
            let error = files.take(file).unwrap_err();
            assert!(error.to_string().contains("panicked"), "{error}");
        }
    }
}

#[test]
fn without_threads_a_piece_is_fetched_by_its_first_reader() {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let log = asked.clone();
    let fetch = move |range: Range<u64>| {
        log.lock().unwrap().push(range.clone());
        Ok(vec![0; (range.end - range.start) as usize].into())
    };
    let room = Room {
        bytes: PIECE,
        is_ahead: false,
    };
    let ahead = Ahead::of_ranges([0..100, 200..300, MIB..MIB + 100], room, fetch);
    assert_eq!(held(&ahead), 0);
    assert_eq!(read_range(&ahead, 200..300), 0);
    assert_eq!(held(&ahead), 300);
    assert_eq!(read_range(&ahead, 0..100), 0);
    assert_eq!(held(&ahead), 0);
    assert_eq!(*asked.lock().unwrap(), vec![0..300]);
}
