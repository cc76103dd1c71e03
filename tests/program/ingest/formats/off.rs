//! OFF.

use crate::ingest::bench::Bench;
use std::path::PathBuf;

pub fn meshes(bench: &Bench) -> Vec<PathBuf> {
    let faces = "3 0 1 2\n3 0 2 1 255 0 0\n";
    let vertices = "1 2 3\n4 5 6\n7 8 9.5\n";
    vec![
        bench.write("a.off", format!("OFF\n3 2 0\n{vertices}{faces}")),
        bench.write("b", format!("# a\nOFF 3 2 0 # b\n\n{vertices}# c\n{faces}")),
        bench.write("c.off", format!("COFF\n1 1 0\n1 2 3 255 0 0 255\n{faces}")),
        bench.write("d.off", "CNOFF\r\n1 0 0\r\n1 2 3 0 0 1 0.5 0 1 1\r\n"),
    ]
}
