//! Meshes in OBJ, STL, GLB and PLY. The first byte gives the ending of the name.

use crate::{Bench, check_error};
use outcrop::inspect::verify::{Options, verify_with};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use std::sync::Arc;

/// The endings by the first byte.
pub const ENDINGS: [&str; 4] = ["obj", "stl", "glb", "ply"];

/// Verifies a mesh.
pub fn read(bytes: &[u8]) {
    let Some((ending, bytes)) = bytes.split_first() else {
        return;
    };
    let ending = ENDINGS[usize::from(*ending) % ENDINGS.len()];
    let bench = Bench::get();
    let path = bench.write(&format!("mesh.{ending}"), bytes);
    let folder = path.parent().expect("the folder of a file");
    // A mesh is read once in a workspace.
    let memory = MemoryPool::new(MINIMUM_BUDGET).expect("the least budget");
    let scratch = bench.path("scratch of a mesh");
    let workspace = Workspace::new(&scratch, memory, 1, Arc::new(Silent), Cancel::new());
    let workspace = workspace.expect("a workspace");
    if let Err(error) = verify_with(&path, &Options::default(), &workspace) {
        check_error(&error, folder);
    }
}
