//! How scratch files are read and written, and what the files of a workspace share.

use super::IoCounters;
use super::mapped::Io;
use super::memory::MemoryPool;
use super::run::ResumableRun;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::{AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// How files are read and written; it changes no result.
#[derive(Debug, Clone, Copy, Default)]
pub struct Storage {
    /// The way in which files are read.
    pub io: Io,
    /// The compression of rows.
    pub compression: Compression,
}

/// Compression of rows in scratch files with Zstandard.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Compression {
    /// At level 1 where the disk is not local, or is slower than compression; else none.
    #[default]
    Auto,
    /// None.
    None,
    /// At a level of Zstandard, 1 to 3: higher ones take several MiB for each thread to save little.
    Level(i32),
}

impl FromStr for Compression {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match (text, text.parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("none", _) => Ok(Self::None),
            (_, Ok(level @ 1..=3)) => Ok(Self::Level(level)),
            _ => Err(format!("{text:?} is not auto, none or a level from 1 to 3")),
        }
    }
}

/// State shared by the files of a workspace.
#[derive(Debug)]
pub struct Shared {
    /// Path of the scratch folder.
    pub folder: PathBuf,
    /// Bytes moved.
    pub io: Arc<IoCounters>,
    /// The run, if it can be resumed.
    pub run: Option<ResumableRun>,
    /// Expected peak of scratch bytes.
    pub expected: AtomicU64,
    /// The budget, from which the lists of sections are reserved.
    pub memory: MemoryPool,
    /// How files are read and written.
    pub storage: OnceLock<Storage>,
    /// The level at which rows are compressed; 0: they are not, as long as it is `UNDECIDED`.
    pub level: AtomicI32,
}

/// Bytes that a thread takes to compress a section: tables of Zstandard, up to 2.5 MiB at level 3, and the
/// compressed copy.
pub(super) const COMPRESSING: u64 = 4 << 20;

/// The level before it is known whether compression pays.
pub(super) const UNDECIDED: i32 = -1;

impl Shared {
    /// How files are read and written.
    pub fn storage(&self) -> Storage {
        self.storage.get().copied().unwrap_or_default()
    }

    /// Scratch bytes still to be written, as far as that is known.
    pub fn more(&self) -> u64 {
        let expected = self.expected.load(Ordering::Relaxed);
        expected.saturating_sub(self.io.scratch())
    }
}
