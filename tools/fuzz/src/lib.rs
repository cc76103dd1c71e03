//! What the fuzz targets do with their bytes: what a user's file would go through.
//!
//! A target fails by a panic, by taking longer than libFuzzer allows, or by asking for more memory than
//! [`HEAP`]. Errors of the kinds that a file may cause are the expected outcome.

pub mod cloud;
pub mod folder;
pub mod mesh;
pub mod resume;
pub mod scratch;
pub mod seeds;

use outcrop::Error;
use outcrop::workspace::Workspace;
use outcrop::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop::workspace::progress::{Cancel, Silent};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Most bytes that may be allocated at any time: the least budget that the program accepts, so that no
/// file can make a run exceed the budget it was given. Buffers count when they are asked for, filled
/// or not.
pub const HEAP: usize = MINIMUM_BUDGET as usize;

#[global_allocator]
static ALLOCATOR: cap::Cap<std::alloc::System> = cap::Cap::new(std::alloc::System, HEAP);

/// A folder for files, and a workspace in it.
pub struct Bench {
    folder: tempfile::TempDir,
    /// Where files are read into.
    pub workspace: Workspace,
}

impl Bench {
    /// The one of this process; its folder is in `TMPDIR`.
    pub fn get() -> &'static Self {
        static BENCH: OnceLock<Bench> = OnceLock::new();
        BENCH.get_or_init(|| {
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

    /// Checks that a read has left nothing behind.
    pub fn check_memory(&self) {
        let memory = &self.workspace.memory;
        assert_eq!(
            memory.available(),
            memory.capacity(),
            "memory is given back"
        );
    }
}

/// Checks that an error is one that a file can cause, in one line that names it.
pub fn check_error(error: &Error, folder: &Path) {
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text:?} is more than one line");
    match error {
        Error::Input { path, .. } => assert!(path.starts_with(folder), "{text}"),
        // A file may need more than the least budget, and is refused with the number that would do.
        Error::Memory { .. } => {}
        other => panic!("no error of a file: {other:?}"),
    }
}
