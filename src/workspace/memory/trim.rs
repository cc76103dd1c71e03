//! Memory that the allocator keeps for later.

/// True if the allocator can be told; others are left alone.
pub(super) const CAN: bool = cfg!(all(target_os = "linux", target_env = "gnu"));

/// Gives back to the system what was freed on `threads` and elsewhere: what a stage has freed is of little
/// use to the next one, whose lists have other sizes. From then on large lists go back at once.
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

    /// Larger lists go back at once when they are freed, and need no copy to grow.
    const MAPPED: c_int = 1 << 20;

    /// What is free at the end of a thread's heap stays up to this.
    const KEPT: c_int = 4 << 20;

    /// Freeing a list so large makes glibc look at the end of the thread's heap.
    const NOTICED: usize = 96 << 10;

    pub(super) fn trim(threads: &rayon::ThreadPool) {
        set(libc::M_TRIM_THRESHOLD, 0);
        threads.broadcast(|_| drop(black_box(Vec::<u8>::with_capacity(NOTICED))));
        // The first setting ends what glibc does by itself.
        set(libc::M_TRIM_THRESHOLD, KEPT);
        set(libc::M_MMAP_THRESHOLD, MAPPED);
        // SAFETY: any thread may call it at any time; it takes only memory that is free.
        unsafe { libc::malloc_trim(0) };
    }

    fn set(parameter: c_int, value: c_int) {
        // SAFETY: these two are single words, which glibc itself changes while threads are at work (in `free`).
        unsafe { libc::mallopt(parameter, value) };
    }
}
