//! The work of the fuzz targets: the bytes are processed as a user's file would be.
//!
//! A target fails by a panic, by taking longer than libFuzzer allows, or by allocating more memory than
//! [`HEAP`]. Errors of the kinds that a file may cause are the expected outcome.

pub mod cloud;
pub mod dialect;
pub mod ept;
pub mod folder;
pub mod foreign;
pub mod mesh;
pub mod region;
pub mod resume;
pub mod scratch;
pub mod seeds;

use outcrop::Error;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Largest number of bytes that may be allocated at any time: the least budget of the program, so that no
/// file can make a run exceed its budget. Buffers count when they are allocated, filled or not.
pub const HEAP: usize = MINIMUM_BUDGET as usize;

#[global_allocator]
static ALLOCATOR: cap::Cap<std::alloc::System> = cap::Cap::new(std::alloc::System, HEAP);

/// A folder for files, and a workspace in it.
pub struct Bench {
    folder: tempfile::TempDir,
    /// The workspace for reading files.
    pub workspace: Workspace,
}

impl Bench {
    /// The bench of this process; its folder is in `TMPDIR`.
    pub fn get() -> &'static Self {
        static BENCH: OnceLock<Bench> = OnceLock::new();
        BENCH.get_or_init(|| {
            // libFuzzer's hook ends the process at every panic that it sees.
            outcrop::hide_caught_panics();
            let folder = tempfile::tempdir().expect("a folder for files");
            let memory = MemoryPool::new(MINIMUM_BUDGET).expect("the least budget");
            let scratch = folder.path().join("scratch");
            let workspace = Workspace::new(&scratch, memory, 1, Arc::new(Silent), Cancel::new());
            Bench {
                workspace: workspace.expect("a workspace"),
                folder,
            }
        })
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).expect("a file of the input");
        path
    }

    /// Checks that no memory is reserved after reading.
    pub fn check_memory(&self) {
        let memory = &self.workspace.memory;
        assert_eq!(
            memory.available(),
            memory.capacity(),
            "memory is given back"
        );
    }
}

/// Checks that an error can be caused by a file, and is one line with its name.
pub fn check_error(error: &Error, folder: &Path) {
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text:?} is more than one line");
    match error {
        Error::Input { path, .. } => assert!(path.starts_with(folder), "{text}"),
        // A file may need more than the least budget; the error has a number that would suffice.
        Error::Memory { .. } => {}
        other => panic!("no error of a file: {other:?}"),
    }
}
