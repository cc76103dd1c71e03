//! The process: its memory, its time, what ends it.

use crate::system;

/// Bytes of memory this process may use: the smallest of physical memory and the limits that the system sets,
/// on Linux those of its memory cgroup and all its ancestors, on Windows those of its job.
#[must_use]
pub fn memory_allowed() -> u64 {
    system::memory_allowed()
}

/// Peak resident memory of this process so far, in bytes.
#[must_use]
pub fn peak_resident() -> u64 {
    system::peak_resident()
}

/// Resident memory of this process now, in bytes.
#[must_use]
pub fn resident() -> u64 {
    system::resident()
}

/// Resident pages of mapped files now, in bytes: the program's code and its libraries, and points while they are
/// mapped. 0 where that is not known.
#[must_use]
pub fn resident_file() -> u64 {
    system::resident_file()
}

/// Processor time of this process so far, in seconds.
#[must_use]
pub fn cpu_seconds() -> f64 {
    system::cpu_seconds()
}

/// Allows as many open files as the system does: each thread has segments of its own of every scratch file.
pub fn open_many_files() {
    system::open_many_files();
}

/// True if [`trim`] does something: the allocator is known, and keeps freed memory.
pub const CAN_TRIM: bool = system::CAN_TRIM;

/// Returns freed memory to the system: what follows has lists of other sizes and makes little use of it. From then
/// on large lists are returned as soon as they are freed. `on_all` does what it is given on all threads that work.
pub fn trim(on_all: impl FnOnce(&(dyn Fn() + Sync))) {
    system::trim(on_all);
}

/// Calls `tell` in a thread of its own with the number of each signal that asks the program to stop, until it
/// returns false: 2 for Ctrl-C, 15 for an end of the program or, on Windows, of the session, 1 where a terminal was
/// closed. False if that cannot be done: such signals then end the program.
pub fn on_stop(tell: impl FnMut(i32) -> bool + Send + 'static) -> bool {
    system::on_stop(tell)
}

/// Ends this process at once, without a word, as `kill -9` does.
pub fn kill() -> ! {
    system::kill();
    std::process::abort()
}

/// Stops this process until it is continued from outside, or killed.
pub fn freeze() {
    system::freeze();
}

/// The system's number of the error of a full disk.
pub const DISK_FULL: i32 = system::DISK_FULL;

/// The system's number of the error of a disk that fails.
pub const DISK_FAILS: i32 = system::DISK_FAILS;

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Error, ErrorKind};

    #[test]
    fn reads_this_process() {
        assert!(memory_allowed() > 1 << 20);
        let held = std::hint::black_box(vec![1u8; 32 << 20]);
        assert!(resident() >= 32 << 20 && peak_resident() >= resident() / 2);
        assert!(resident_file() <= resident());
        assert!(cpu_seconds() > 0.0 && cpu_seconds() < 3600.0);
        assert_eq!(held.last(), Some(&1));
    }

    #[test]
    fn a_full_disk_is_known_by_its_number() {
        let kind = |number| Error::from_raw_os_error(number).kind();
        assert_eq!(kind(DISK_FULL), ErrorKind::StorageFull);
        assert_ne!(kind(DISK_FAILS), ErrorKind::StorageFull);
    }

    #[test]
    fn memory_can_be_trimmed_at_any_time() {
        // Small pieces, of which the last keeps the others from being returned when they are freed.
        let pieces = |count: usize| (0..count).map(|n| vec![n as u8; 512]).collect::<Vec<_>>();
        let (freed, kept) = (pieces(200_000), pieces(1000));
        drop(freed);
        let (before, mut calls) = (resident(), 0);
        trim(|work| {
            calls += 1;
            std::thread::scope(|scope| {
                // One thread is at work with memory meanwhile.
                let other = scope.spawn(|| pieces(1000));
                (0..2).for_each(|_| drop(scope.spawn(work)));
                assert!(other.join().unwrap() == kept);
            });
        });
        assert_eq!(calls, u32::from(CAN_TRIM));
        // 100 MB are free; other tests may have taken some memory since.
        assert!(!CAN_TRIM || resident() + (50 << 20) < before, "{before}");
        assert!(kept == pieces(1000));
    }
}
