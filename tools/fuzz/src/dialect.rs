//! Text with a point a line, as a table of known columns was written.

#[path = "../../../tests/program/ingest/recipe.rs"]
mod recipe;

use crate::{Bench, check_error};
use outcrop_formats::ingest;

/// Writes the text that the bytes stand for: it is read as the plain reading says, or both refuse it.
pub fn read(bytes: &[u8]) {
    let Some(recipe) = recipe::Recipe::of(bytes) else {
        return;
    };
    let bench = Bench::get();
    let path = bench.write("dialect.txt", recipe.text().as_bytes());
    let folder = path.parent().expect("the folder of a file").to_path_buf();
    let found = match ingest(&[path], &bench.workspace) {
        Ok(spool) => {
            let lattice = spool.choose_lattice(0).expect("points");
            let mut all: Vec<[i64; 3]> = Vec::new();
            let streamed = spool.for_each(&bench.workspace, &lattice, |points| {
                let place =
                    |p: &[i32; 3]| lattice.position(*p).map(|v| (v * 1000.0).round() as i64);
                all.extend(points.iter().map(place));
                Ok(())
            });
            streamed.expect("points that were just written");
            spool.release(&bench.workspace).expect("a spool");
            all.sort_unstable();
            Some(all)
        }
        Err(error) => {
            check_error(&error, &folder);
            None
        }
    };
    assert_eq!(found, recipe.expected(), "{recipe:?}\n{}", recipe.text());
    bench.check_memory();
}
