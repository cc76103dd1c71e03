//! Mesh files.

use crate::{Bench, check_error};
use outcrop::inspect::compare::{self, compare};
use outcrop::inspect::verify::{Options, verify_with};
use outcrop_codecs::ply_mesh::holds_faces;

/// Largest file that is also compared with itself.
const SMALL: usize = 16 << 10;

/// Verifies a mesh in large and in small ranges, and measures its distance to itself.
pub fn read(bytes: &[u8]) {
    let bench = Bench::get();
    let path = bench.write("mesh.ply", bytes);
    let folder = path.parent().expect("the folder of a file");
    let faces = holds_faces(&path).expect("a file that can be opened");
    let verify = |range| {
        let options = Options {
            range,
            ..Options::default()
        };
        verify_with(&path, &options, &bench.workspace)
    };
    match (verify(None), verify(Some(4))) {
        (Ok(a), Ok(b)) => assert_eq!(format!("{a:?}"), format!("{b:?}")),
        (Err(a), Err(b)) => [a, b].iter().for_each(|e| check_error(e, folder)),
        (a, b) => panic!("{a:?} and {b:?}"),
    }
    if bytes.len() < SMALL && faces {
        let options = compare::Options {
            samples: 100,
            seed: 1,
        };
        match compare(&path, &path, &options, &bench.workspace) {
            Ok(found) => assert!(found.symmetric.figures.max >= 0.0, "{found:?}"),
            Err(error) => check_error(&error, folder),
        }
    }
    bench.check_memory();
}
