//! Reading meshes, and the places that were seen.

use crate::error::{Error, Result};
use outcrop_ply::{Element, Header, Mesh, Numbers, Property, Scalar};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A place of the true surface that was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The place, without any error.
    pub place: [f64; 3],
    /// The normal of the true surface there.
    pub normal: [f64; 3],
}

fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let file = File::open(path).map_err(|e| Error::io(path, "open the file", e))?;
    let bytes = file.metadata();
    let bytes = bytes
        .map_err(|e| Error::io(path, "open the file", e))?
        .len();
    Ok((BufReader::with_capacity(1 << 18, file), bytes))
}

/// Reads a PLY mesh. Vertices must be finite.
///
/// # Errors
/// [`Error`] with the file.
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    let (file, bytes) = open(path)?;
    let mesh = Mesh::read(file, bytes).map_err(|e| Error::input(path, e.to_string()))?;
    if mesh.vertices.iter().flatten().any(|c| !c.is_finite()) {
        return Err(Error::input(path, "a vertex that is not finite"));
    }
    Ok(mesh)
}

/// Reads a PLY cloud with the properties x, y, z, nx, ny and nz.
///
/// # Errors
/// [`Error`] with the file.
pub fn read_seen(path: &Path) -> Result<Vec<Seen>> {
    let wrong = |what: String| Error::input(path, what);
    let (mut file, bytes) = open(path)?;
    let header = Header::read(&mut file).map_err(|e| wrong(e.to_string()))?;
    let vertex = match header.elements.first() {
        Some(element) if element.name == "vertex" => element,
        _ => return Err(wrong("its first element is not vertex".to_owned())),
    };
    let coordinates = vertex.coordinates().map_err(|e| wrong(e.to_string()))?;
    let normals =
        normals(vertex).ok_or_else(|| wrong("it has no normals nx, ny, nz".to_owned()))?;
    let least = vertex.least_bytes(header.encoding).max(1);
    let mut seen = Vec::with_capacity(vertex.count.min(bytes / least + 1) as usize);
    let mut numbers = Numbers::new(file, header.encoding);
    let mut values = Vec::new();
    for row in 0..vertex.count {
        let place = numbers
            .point_with(vertex, &coordinates, &normals, &mut values)
            .map_err(|found| wrong(format!("vertex {row}: {found}")))?;
        match values[..] {
            [x, y, z] if place.iter().chain(&values).all(|c| c.is_finite()) => seen.push(Seen {
                place,
                normal: [x, y, z],
            }),
            _ => return Err(wrong(format!("vertex {row} is not finite"))),
        }
    }
    Ok(seen)
}

/// Number and type of the properties nx, ny and nz, if they are there in this order.
fn normals(vertex: &Element) -> Option<Vec<(usize, Scalar)>> {
    let place = |name: &str| {
        let mut all = vertex.properties.iter().enumerate();
        all.find_map(|(at, (own, property))| match property {
            Property::One(scalar) if own == name => Some((at, *scalar)),
            _ => None,
        })
    };
    let found = [place("nx")?, place("ny")?, place("nz")?];
    (found[0].0 < found[1].0 && found[1].0 < found[2].0).then(|| found.to_vec())
}
