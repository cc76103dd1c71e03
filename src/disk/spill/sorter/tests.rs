//! The sorter against the standard library, with damaged files, and over several attempts.

use super::*;
use crate::error::Error;
use crate::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use crate::workspace::progress::{Cancel, Silent};
use crate::workspace::{Folder, Found};
use proptest::prelude::*;
use std::sync::Arc;

fn collect<R: Row>(sorted: Sorted<R>) -> Vec<R> {
    sorted.in_memory().map_or_else(
        |sorted| {
            let mut all = Vec::new();
            let each = |row| {
                all.push(row);
                Ok(())
            };
            sorted.for_each_from(None, each).unwrap();
            all
        },
        |(all, _)| all,
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn sorts_like_the_standard_library(
        mut records in prop::collection::vec([0u32..50, 0u32..9], 0..30_000),
        buffer in prop::sample::select(vec![16u64, 4096, 100_000, 10_000_000]),
    ) {
        // With a tiny buffer a run has only a few rows, so the number of rows is small.
        if buffer == 16 { records.truncate(900); }
        let workspace = Workspace::for_tests(2).expect("a scratch folder");
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", buffer);
        for chunk in records.chunks(1000) { sorter.push(chunk).unwrap(); }
        let got = collect(sorter.finish(&workspace).unwrap());
        records.sort_unstable();
        prop_assert_eq!(got, records);
    }

    #[test]
    fn parts_make_the_whole(
        mut records in prop::collection::vec([0u32..5000, 0u32..2], 1..40_000),
        part in prop::sample::select(vec![1usize, 9000, 100_000]),
    ) {
        let workspace = Workspace::for_tests(2).expect("a scratch folder");
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", 80_000);
        for chunk in records.chunks(1000) { sorter.push(chunk).unwrap(); }
        let sorted = sorter.finish(&workspace).unwrap();
        if let Err(sorted) = sorted.in_memory() {
            let cuts = sorted.cuts(part);
            let ends = cuts.iter().copied().map(Some).chain([None]);
            let mut got = Vec::new();
            let mut from = None;
            for to in ends {
                sorted.for_range(from, to, |r| { got.push(r); Ok(()) }).unwrap();
                from = to;
            }
            records.sort_unstable();
            prop_assert_eq!(got, records);
        }
    }
}

#[test]
fn only_what_was_filled_is_held() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let pool = &workspace.memory;
    let before = pool.peak_held();
    for whole in [true, false] {
        let reserved = workspace.promise("sorted", 1 << 20).unwrap();
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "h", 1 << 20).reporting(reserved);
        let sorter = if whole { sorter.whole() } else { sorter };
        let _ = pool.take_held();
        for n in 0..30_000u32 {
            sorter.push(&[[n % 100, n]]).unwrap();
        }
        // Growing takes the old buffer and its copy.
        let most = if whole { 30_000 } else { 2 << 14 };
        assert_eq!(pool.take_held(), before + most * 8);
        let (all, held) = sorter.finish(&workspace).unwrap().in_memory().unwrap();
        assert_eq!(all.len(), 30_000);
        let _ = pool.take_held();
        assert_eq!(pool.take_held(), before + 30_000 * 8);
        drop(held);
    }
    // Merging takes frames, and no sort buffer.
    let reserved = workspace.promise("sorted", 1 << 20).unwrap();
    let sorter = Sorter::<[u32; 2]>::new(&workspace, "m", 1 << 20).reporting(reserved);
    for n in 0..300_000u32 {
        sorter.push(&[[n % 100, n]]).unwrap();
    }
    assert_eq!(pool.take_held(), before + (1 << 20));
    let sorted = sorter.finish(&workspace).unwrap();
    let _ = pool.take_held();
    assert_eq!(pool.take_held(), before + sorted.merge_bytes());
    drop(sorted);
    assert_eq!(pool.available(), pool.capacity());
}

#[test]
fn damage_is_found_and_named() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let sorter = Sorter::<[u32; 2]>::new(&workspace, "d", 800);
    for i in 0..1000u32 {
        sorter.push(&[[i * 7 % 1000, i]]).unwrap();
    }
    let path = workspace.path("d.run3.2");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    let outcome = sorter
        .finish(&workspace)
        .and_then(|sorted| sorted.for_each(|_| Ok(())));
    match outcome {
        Err(Error::Corrupt { path, .. }) => {
            assert!(
                path.to_string_lossy().contains("d.run"),
                "{}",
                path.display()
            );
        }
        other => panic!("{other:?}"),
    }
}

/// A workspace that a later attempt can continue.
fn attempt(path: &std::path::Path) -> Workspace {
    let folder = match Folder::find(path).unwrap() {
        Found::Run(folder) => folder,
        _ => Folder::create(path, b"{}".to_vec()).unwrap(),
    };
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    Workspace::resumable(folder, memory, 2, Arc::new(Silent), Cancel::new()).unwrap()
}

/// Parts of an input: numbers with gaps, each with its number of rows.
fn parts() -> Vec<(u32, u64)> {
    (0..40)
        .map(|n| (3 * n + n % 2, u64::from(200 + n)))
        .collect()
}

fn part(number: u32) -> Vec<[u32; 2]> {
    let count = parts().iter().find(|p| p.0 == number).map_or(0, |p| p.1);
    let word = |n: u32| (number * 5000 + n).wrapping_mul(2_654_435_761) >> 12;
    (0..count as u32).map(|n| [word(n), number]).collect()
}

#[test]
fn goes_on_where_it_was_stopped() {
    let mut want: Vec<_> = parts().iter().flat_map(|p| part(p.0)).collect();
    want.sort_unstable();
    for kept in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        // A different buffer size in each attempt; the last but one finished all runs before it ended.
        for (stop, buffer) in [(2, 6000), (1, 20_000), (1, 9000), (99, 9000), (99, 500_000)] {
            let workspace = attempt(&path);
            let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", buffer);
            let calls = std::cell::Cell::new(0);
            let taken = sorter.take_parts(&workspace, &parts(), kept, |numbers| {
                calls.set(calls.get() + 1);
                if calls.get() > stop {
                    return Err(Error::Cancelled);
                }
                numbers.iter().try_for_each(|n| sorter.push(&part(*n)))
            });
            if stop < 99 {
                assert!(matches!(taken, Err(Error::Cancelled)), "{taken:?}");
                continue;
            }
            assert_eq!(taken.unwrap(), want.len() as u64);
            assert!(calls.get() == 0 || buffer == 9000, "{buffer}");
            let sorted = sorter.finish(&workspace).unwrap();
            assert!(collect(sorted) == want, "{kept} {buffer}");
        }
    }
}

#[test]
fn a_run_that_was_damaged_is_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run");
    let mut want: Vec<_> = parts().iter().flat_map(|p| part(p.0)).collect();
    want.sort_unstable();
    for damage in [None, Some("s.run1.2"), Some("s.run0.2")] {
        if let Some(name) = damage {
            let path = path.join(name);
            let mut bytes = std::fs::read(&path).unwrap();
            bytes[100] ^= 1;
            std::fs::write(&path, bytes).unwrap();
        }
        let workspace = attempt(&path);
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", 20_000);
        let push = |numbers: &[u32]| numbers.iter().try_for_each(|n| sorter.push(&part(*n)));
        sorter.take_parts(&workspace, &parts(), true, push).unwrap();
        if damage == Some("s.run0.2") {
            assert!(collect(sorter.finish(&workspace).unwrap()) == want);
        }
    }
}

#[test]
fn an_error_of_the_writer_reaches_the_caller() {
    let folder = tempfile::tempdir().unwrap();
    let all: Vec<[u32; 2]> = parts().iter().flat_map(|p| part(p.0)).collect();
    for (number, threads) in [(0, 1), (1, 1), (1, 2), (2, 2), (3, 1)] {
        let blocked = format!("s.run{number}.{threads}");
        let fails = |outcome: Result<()>| match outcome {
            Err(Error::Io { path, .. }) => assert!(path.ends_with(&blocked), "{path:?}"),
            other => panic!("{other:?}"),
        };
        let workspace = Workspace::for_tests(threads).expect("a scratch folder");
        std::fs::write(workspace.path(&blocked), b"").unwrap();
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", 20_000);
        let pushed = all.chunks(100).try_for_each(|rows| sorter.push(rows));
        fails(pushed.and_then(|()| sorter.finish(&workspace).map(drop)));
        // From other threads, in a run that can be resumed.
        let path = folder.path().join(format!("run{number}{threads}"));
        let workspace = attempt(&path);
        std::fs::write(workspace.path(&format!("s.run{number}.2")), b"").unwrap();
        let sorter = Sorter::<[u32; 2]>::new(&workspace, "s", 20_000);
        let taken = sorter.take_parts(&workspace, &parts(), false, |numbers| {
            numbers.iter().try_for_each(|n| {
                std::thread::scope(|scope| scope.spawn(|| sorter.push(&part(*n))).join().unwrap())
            })
        });
        assert!(matches!(taken, Err(Error::Io { .. })), "{taken:?}");
    }
}

#[test]
fn two_halves_are_held_and_no_more() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let pool = &workspace.memory;
    let before = pool.peak_held();
    let reserved = workspace.promise("sorted", 1 << 16).unwrap();
    let sorter = Sorter::<[u32; 2]>::new(&workspace, "m", 1 << 16).reporting(reserved);
    for n in 0..100_000u32 {
        sorter.push(&[[n % 100, n]]).unwrap();
        let rows = sorter.state().buffer.capacity();
        assert!(
            rows * 8 <= if n < 1 << 13 { 1 << 16 } else { 1 << 15 },
            "{n}: {rows}"
        );
    }
    assert_eq!(pool.take_held(), before + (1 << 16));
    assert_eq!(
        sorter.state().runs.len(),
        1 + (100_000 - (1 << 13)) / (1 << 12) - 1
    );
    let rows = collect(sorter.finish(&workspace).unwrap());
    assert!(rows.len() == 100_000 && rows.is_sorted());
}
