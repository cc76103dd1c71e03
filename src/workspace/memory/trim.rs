//! Memory that the allocator keeps for later.

/// Gives back to the system what was freed on `threads` and elsewhere: what a stage has freed is of little
/// use to the next one, whose lists have other sizes. True if it was done.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn trim(threads: &rayon::ThreadPool) -> bool {
    glibc::trim(threads);
    true
}

/// Other allocators are left alone.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn trim(_: &rayon::ThreadPool) -> bool {
    false
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(
    unsafe_code,
    reason = "it cannot be asked for otherwise, and a process is smaller by up to a seventh"
)]
mod glibc {
    use std::ffi::c_int;
    use std::hint::black_box;

    /// Larger lists go back at once when they are freed, and need no copy to grow.
    const MAPPED: c_int = 8 << 20;

    /// What is free at the end of a thread's heap stays while stages are at work, as it does where glibc
    /// sets this by itself: to give it back after every unit costs a twentieth of the time.
    const KEPT: c_int = 64 << 20;

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
