//! Freed memory that the allocator keeps.

/// True if the allocator is glibc's; others are left as they are.
pub(super) const CAN: bool = cfg!(all(target_os = "linux", target_env = "gnu"));

/// Returns freed memory of `threads` and of the other threads to the system: the next stage has lists of
/// other sizes and makes little use of it. From then on large lists are returned as soon as they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn trim(threads: &rayon::ThreadPool) {
    glibc::trim(threads);
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn trim(_: &rayon::ThreadPool) {}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(
    unsafe_code,
    reason = "it cannot be asked for otherwise, and a process is smaller by up to a seventh"
)]
mod glibc {
    use std::ffi::c_int;
    use std::hint::black_box;

    /// Larger lists are returned to the system as soon as they are freed, and grow without a copy.
    const MAPPED: c_int = 1 << 20;

    /// Up to this size free memory at the end of a thread's heap is kept.
    const KEPT: c_int = 4 << 20;

    /// Freeing a list of this size makes glibc check the end of the thread's heap.
    const NOTICED: usize = 96 << 10;

    pub(super) fn trim(threads: &rayon::ThreadPool) {
        set(libc::M_TRIM_THRESHOLD, 0);
        threads.broadcast(|_| drop(black_box(Vec::<u8>::with_capacity(NOTICED))));
        // The first setting ends the automatic adjustment by glibc.
        set(libc::M_TRIM_THRESHOLD, KEPT);
        set(libc::M_MMAP_THRESHOLD, MAPPED);
        // SAFETY: any thread may call it at any time; it affects only free memory.
        unsafe { libc::malloc_trim(0) };
    }

    fn set(parameter: c_int, value: c_int) {
        // SAFETY: these two are single words, which glibc itself changes while threads are at work (in
        // `free`).
        unsafe { libc::mallopt(parameter, value) };
    }
}
