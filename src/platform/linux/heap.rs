//! Freed memory that the allocator keeps.

/// True if the allocator is glibc's; others are left as they are.
pub const CAN_TRIM: bool = cfg!(target_env = "gnu");

#[cfg(target_env = "gnu")]
pub use glibc::trim;

#[cfg(not(target_env = "gnu"))]
pub fn trim(_: impl FnOnce(&(dyn Fn() + Sync))) {}

#[cfg(target_env = "gnu")]
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

    pub fn trim(on_all: impl FnOnce(&(dyn Fn() + Sync))) {
        set(libc::M_TRIM_THRESHOLD, 0);
        on_all(&|| drop(black_box(Vec::<u8>::with_capacity(NOTICED))));
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
