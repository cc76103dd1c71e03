//! Counts of the bytes that are moved, and of scratch space.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes moved and scratch space held, counted where files are read and written.
#[derive(Debug, Default)]
pub struct IoCounters {
    read: AtomicU64,
    written: AtomicU64,
    scratch: AtomicU64,
    scratch_peak: AtomicU64,
    stage_peak: AtomicU64,
}

impl IoCounters {
    /// Counts `bytes` read from a file.
    pub fn add_read(&self, bytes: u64) {
        self.read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts `bytes` written to a file.
    pub fn add_written(&self, bytes: u64) {
        self.written.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Counts `bytes` of scratch space taken.
    pub fn grow_scratch(&self, bytes: u64) {
        let now = self.scratch.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.scratch_peak.fetch_max(now, Ordering::Relaxed);
        self.stage_peak.fetch_max(now, Ordering::Relaxed);
    }

    /// Begins a new peak, see [`IoCounters::stage_peak`].
    pub fn begin_stage(&self) {
        self.stage_peak.store(self.scratch(), Ordering::Relaxed);
    }

    /// Peak of the scratch space in bytes since the stage began.
    #[must_use]
    pub fn stage_peak(&self) -> u64 {
        self.stage_peak.load(Ordering::Relaxed)
    }

    /// Counts `bytes` of scratch space given back.
    pub fn shrink_scratch(&self, bytes: u64) {
        self.scratch.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Scratch space in use now, in bytes.
    #[must_use]
    pub fn scratch(&self) -> u64 {
        self.scratch.load(Ordering::Relaxed)
    }

    /// Bytes read so far.
    #[must_use]
    pub fn read(&self) -> u64 {
        self.read.load(Ordering::Relaxed)
    }

    /// Bytes written so far.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Peak of the scratch space in bytes.
    #[must_use]
    pub fn scratch_peak(&self) -> u64 {
        self.scratch_peak.load(Ordering::Relaxed)
    }
}
