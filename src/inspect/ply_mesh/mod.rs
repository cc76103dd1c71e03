//! Streaming reader of triangle meshes in PLY files: ascii and binary of either byte order.
//!
//! Vertices are the properties `x`, `y`, `z` (any scalar type) of element `vertex`; faces are the
//! list `vertex_indices` or `vertex_index` of element `face`. Everything else is skipped. The file
//! is read once, front to back, in a buffer of fixed size; what the header claims is checked
//! against the size of the file before anything is read on its account.

mod ascii;
mod binary;
mod header;
mod source;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use header::{Element, Encoding, Header, Property};
use source::Source;
use std::path::Path;

/// Items handed to a [`Sink`] at a time, at most.
pub const SLICE: usize = 8192;

/// Index reported for every number in the file that no vertex of a mesh can have.
pub const NO_VERTEX: u32 = u32::MAX;

/// Takes in the mesh, slice by slice, in the order of the file.
pub trait Sink {
    /// The next vertices' positions.
    ///
    /// # Errors
    /// Whatever should end the reading.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()>;

    /// The next triangles' corners. Indices are as in the file, not checked against the number of
    /// vertices; those below 0 or above [`NO_VERTEX`] come as [`NO_VERTEX`].
    ///
    /// # Errors
    /// Whatever should end the reading.
    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()>;

    /// `count` more faces do not have exactly three corners.
    ///
    /// # Errors
    /// Whatever should end the reading.
    fn non_triangles(&mut self, count: u64) -> Result<()>;
}

/// A PLY mesh whose header was read and found plausible.
#[derive(Debug)]
pub struct PlyMesh {
    header: Header,
    source: Source,
}

/// True for a PLY file whose header announces faces: a mesh and not a cloud. What is no PLY file, or
/// has a header that cannot be read, is for others to judge.
///
/// # Errors
/// [`Error::Io`].
pub fn holds_faces(path: &Path) -> Result<bool> {
    let mut source = Source::open(path)?;
    if source.peek(3)?.get(..3) != Some(b"ply") {
        return Ok(false);
    }
    match Header::read(&mut source) {
        Ok(header) => Ok(header
            .elements
            .iter()
            .any(|e| e.name == "face" && e.count > 0)),
        Err(Error::Input { .. }) => Ok(false),
        Err(other) => Err(other),
    }
}

/// Where `x`, `y` and `z` are among the properties of element `vertex`.
type Axes = [usize; 3];

impl PlyMesh {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] if it is not a PLY mesh, or claims more than it can hold.
    pub fn open(path: &Path) -> Result<Self> {
        let mut source = Source::open(path)?;
        let header = Header::read(&mut source)?;
        let mesh = Self { header, source };
        mesh.check()?;
        Ok(mesh)
    }

    /// Number of vertices; less than [`NO_VERTEX`] + 1, so `u32` names them all.
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

    /// Checks that the elements a mesh needs are there and that their counts fit the file.
    fn check(&self) -> Result<()> {
        for name in ["vertex", "face"] {
            let known = || {
                let names: Vec<_> = self.header.elements.iter().map(|e| &*e.name).collect();
                format!("elements [{}]", names.join(", "))
            };
            match self
                .header
                .elements
                .iter()
                .filter(|e| e.name == name)
                .count()
            {
                0 => return Err(self.refuse("header", known(), &format!("an element {name}"))),
                1 => {}
                n => {
                    let found = format!("{n} elements named {name}");
                    return Err(self.refuse("header", found, "one"));
                }
            }
        }
        if self.vertices() > u64::from(NO_VERTEX) {
            let found = format!("{} vertices", self.vertices());
            return Err(self.refuse("header", found, "at most 4294967295"));
        }
        let body = self.source.length().saturating_sub(self.source.position());
        // The last number of an ascii file needs no character after it.
        let room = u128::from(body) + u128::from(self.header.encoding == Encoding::Ascii);
        let mut needed = 0u128;
        for element in &self.header.elements {
            self.header.check_properties(element, &self.source)?;
            let each = element.least_bytes(self.header.encoding);
            needed += u128::from(element.count) * u128::from(each);
            if needed > room {
                return Err(self.refuse(
                    &format!("header, element {}", element.name),
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
    /// What the sink returned; [`Error::Io`]; [`Error::Input`] with the byte offset at which the
    /// file ends early or does not hold what its header announced.
    pub fn read(mut self, sink: &mut impl Sink) -> Result<()> {
        for element in &self.header.elements {
            match self.header.encoding {
                Encoding::Ascii => ascii::element(element, &mut self.source, sink)?,
                Encoding::Little => binary::element::<false>(element, &mut self.source, sink)?,
                Encoding::Big => binary::element::<true>(element, &mut self.source, sink)?,
            }
        }
        Ok(())
    }
}

/// What an element means to the reader.
enum Role {
    Vertices(Axes),
    /// Faces whose corners are the property of this index.
    Faces(usize),
    Other,
}

impl Element {
    fn role(&self) -> Role {
        match self.name.as_str() {
            "vertex" => self.axes().map_or(Role::Other, Role::Vertices),
            "face" => self.corners().map_or(Role::Other, Role::Faces),
            _ => Role::Other,
        }
    }

    fn axes(&self) -> Option<Axes> {
        let find = |name| self.find(|p, n| n == name && matches!(p, Property::Scalar(_)));
        Some([find("x")?, find("y")?, find("z")?])
    }

    fn corners(&self) -> Option<usize> {
        self.find(|p, n| {
            (n == "vertex_indices" || n == "vertex_index") && matches!(p, Property::List { .. })
        })
    }

    fn find(&self, wanted: impl Fn(&Property, &str) -> bool) -> Option<usize> {
        let mut properties = self.properties.iter();
        properties.position(|(name, property)| wanted(property, name))
    }
}
