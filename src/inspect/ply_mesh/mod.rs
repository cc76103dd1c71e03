//! Streaming reader of triangle meshes in PLY files: ascii and binary of either byte order.
//!
//! Vertices are the properties `x`, `y`, `z` (any scalar type) of element `vertex`; faces are the list
//! `vertex_indices` or `vertex_index` of element `face`. All other data are skipped. The file is read once,
//! front to back, in a buffer of fixed size. The counts of the header are checked against the size of the
//! file before reading.

mod ascii;
mod binary;
mod source;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use outcrop_ply::{Element, Encoding, Header, Scalar};
use source::Source;
use std::path::Path;

/// Largest number of items passed to a [`Sink`] at a time.
pub const SLICE: usize = 8192;

/// Index reported for a number that is no index of any mesh.
pub const NO_VERTEX: u32 = u32::MAX;

/// Receives the mesh, slice by slice, in the order of the file.
pub trait Sink {
    /// Receives the positions of the next vertices.
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()>;

    /// Receives the corners of the next triangles. Indices are as in the file, not checked against the number
    /// of vertices; those below 0 or above [`NO_VERTEX`] are reported as [`NO_VERTEX`].
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()>;

    /// Counts `count` further faces without exactly three corners.
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn non_triangles(&mut self, count: u64) -> Result<()>;
}

/// A PLY mesh with a checked header.
#[derive(Debug)]
pub struct PlyMesh {
    header: Header,
    source: Source,
}

/// True for a PLY file whose header has faces: a mesh and not a cloud. False for other files and for headers
/// that cannot be read; their readers report the error.
///
/// # Errors
/// [`Error::Io`].
pub fn holds_faces(path: &Path) -> Result<bool> {
    let mut source = Source::open(path)?;
    if source.peek(3)?.get(..3) != Some(b"ply") {
        return Ok(false);
    }
    match read_header(&mut source) {
        Ok(header) => Ok(header
            .elements
            .iter()
            .any(|e| e.name == "face" && e.count > 0)),
        Err(Error::Input { .. }) => Ok(false),
        Err(other) => Err(other),
    }
}

fn read_header(source: &mut Source) -> Result<Header> {
    let header = Header::read(&mut source.peek(Header::LONGEST)?);
    let header = header.map_err(|e| Error::ply(source.path(), e))?;
    source.consume(header.bytes as usize);
    Ok(header)
}

impl PlyMesh {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] if it is no PLY mesh, or has counts that do not fit its size.
    pub fn open(path: &Path) -> Result<Self> {
        let mut source = Source::open(path)?;
        let header = read_header(&mut source)?;
        let mesh = Self { header, source };
        mesh.check()?;
        Ok(mesh)
    }

    /// Number of vertices; at most [`NO_VERTEX`], so that indices fit `u32`.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.count("vertex")
    }

    /// Number of faces, of any number of corners.
    #[must_use]
    pub fn faces(&self) -> u64 {
        self.count("face")
    }

    /// True if all vertices come before the first face.
    #[must_use]
    pub fn vertices_first(&self) -> bool {
        let mut elements = self.header.elements.iter();
        elements
            .find(|e| e.name == "vertex" || e.name == "face")
            .is_some_and(|e| e.name == "vertex")
    }

    fn count(&self, name: &str) -> u64 {
        let mut elements = self.header.elements.iter();
        elements.find(|e| e.name == name).map_or(0, |e| e.count)
    }

    fn refuse(&self, place: &str, found: String, expected: &str) -> Error {
        Error::input(self.source.path(), place, found, expected)
    }

    /// Checks that the required elements exist and that their counts fit the file.
    fn check(&self) -> Result<()> {
        let wrong = |e| Error::ply(self.source.path(), e);
        let elements = &self.header.elements;
        for name in ["vertex", "face"] {
            if self.header.element(name).map_err(wrong)?.is_none() {
                let names: Vec<_> = elements.iter().map(|e| &*e.name).collect();
                let found = format!("elements [{}]", names.join(", "));
                return Err(self.refuse("PLY header", found, &format!("an element {name}")));
            }
        }
        if self.vertices() > u64::from(NO_VERTEX) {
            let found = format!("{} vertices", self.vertices());
            return Err(self.refuse("PLY header", found, "at most 4294967295"));
        }
        let body = self.source.length().saturating_sub(self.source.position());
        // The last number of an ascii file needs no separator after it.
        let room = u128::from(body) + u128::from(self.header.encoding == Encoding::Ascii);
        let mut needed = 0u128;
        for element in elements {
            Role::of(element).map_err(wrong)?;
            let each = element.least_bytes(self.header.encoding);
            needed += u128::from(element.count) * u128::from(each);
            if needed > room {
                return Err(self.refuse(
                    &format!("PLY header, element {}", element.name),
                    format!("{} entries of {each} bytes or more", element.count),
                    &format!("what fits into the {body} bytes after the header"),
                ));
            }
        }
        Ok(())
    }

    /// Reads the whole mesh.
    ///
    /// # Errors
    /// Errors of the sink; [`Error::Io`]; [`Error::Input`] with the byte offset at which the file ends early
    /// or does not match its header.
    pub fn read(mut self, sink: &mut impl Sink) -> Result<()> {
        let source = &mut self.source;
        for element in &self.header.elements {
            let role = Role::of(element).map_err(|e| Error::ply(source.path(), e))?;
            match self.header.encoding {
                Encoding::Ascii => ascii::element(element, role, source, sink)?,
                Encoding::Little => binary::element::<false>(element, role, source, sink)?,
                Encoding::Big => binary::element::<true>(element, role, source, sink)?,
            }
        }
        Ok(())
    }
}

/// Positions and types of `x`, `y` and `z` among the properties of element `vertex`.
type Axes = [(usize, Scalar); 3];

/// The use of an element.
enum Role {
    Vertices(Axes),
    /// Faces: position of the property with the corners, and the types of its count and its items.
    Faces(usize, Scalar, Scalar),
    Other,
}

impl Role {
    fn of(element: &Element) -> outcrop_ply::Result<Self> {
        Ok(match element.name.as_str() {
            "vertex" => Self::Vertices(element.coordinates()?),
            "face" => {
                let (at, count, item) = element.corners()?;
                Self::Faces(at, count, item)
            }
            _ => Self::Other,
        })
    }
}
