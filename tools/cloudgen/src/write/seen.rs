//! The places that were measured, as a PLY cloud with normals.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

use crate::error::{Error, Result};
use crate::generator::Generator;
use outcrop_ply::{Encoding, Layout, Scalar};

/// Writes places and normals, binary with 64 bits a number.
pub(crate) fn write_seen(generator: &Generator, path: &Path) -> Result<()> {
    let file = File::create(path).map_err(|e| Error::io(path, "create the file", e))?;
    body(generator, BufWriter::with_capacity(1 << 18, file))
        .map_err(|e| Error::io(path, "write", e))
}

fn body(generator: &Generator, mut file: impl Write) -> io::Result<()> {
    let exact = || (0..generator.len()).filter_map(|index| generator.exact(index));
    let layout = Layout {
        encoding: Encoding::Little,
        comments: &["outcrop-cloudgen seen"],
        // Counted first, since the header has the number.
        vertices: exact().count() as u64,
        coordinates: Scalar::F64,
        columns: &[
            ("nx", Scalar::F64),
            ("ny", Scalar::F64),
            ("nz", Scalar::F64),
        ],
        triangles: None,
    };
    file.write_all(layout.header().as_bytes())?;
    for sample in exact() {
        for vector in [sample.position, sample.normal] {
            file.write_all(vector.map(f64::to_le_bytes).as_flattened())?;
        }
    }
    file.flush()
}
