//! Streaming reader of triangle meshes: ascii and binary of either byte order.

mod ascii;
mod binary;
mod fixed;
mod source;
#[cfg(test)]
mod tests;
mod values;

use crate::error::{Error, FileError, Result};
use crate::header::{Element, Field, Header};
use crate::place::Place;
use crate::system::System;
use crate::types::{Encoding, Property, Scalar};
use source::Source;
use std::path::Path;

pub use fixed::FixedMesh;

/// Largest number of items in a [`Part`].
pub const SLICE: usize = 8192;

/// Index reported for a number that is no index of any mesh.
pub const NO_VERTEX: u32 = u32::MAX;

/// A part of a mesh; parts follow each other as in the file.
#[derive(Debug, Clone, Copy)]
pub enum Part<'a> {
    /// The positions of the next vertices, at most [`SLICE`].
    Vertices(&'a [[f64; 3]]),
    /// The values of the columns that are wanted, of the vertices that came last, vertex by vertex.
    Values(&'a [f64]),
    /// The corners of the next triangles, at most [`SLICE`]; a face with more corners is divided from its first
    /// one. Indices are as in the file, not checked against the number of vertices; those below 0 or above
    /// [`NO_VERTEX`] are reported as [`NO_VERTEX`].
    Triangles(&'a [[u32; 3]]),
    /// The number of corners of a face that is no triangle.
    Polygon(u64),
}

/// A mesh with a checked header, to be read once, front to back, in a buffer of fixed size.
///
/// Vertices are the properties `x`, `y`, `z` (any scalar type) of element `vertex`; faces are the list
/// `vertex_indices` or `vertex_index` of element `face`. All other data are skipped. The counts of the header
/// are checked against the size of the file before reading.
#[derive(Debug)]
pub struct MeshStream {
    header: Header,
    source: Source,
    /// Indices and types of the vertices' properties that are wanted, ascending.
    columns: Vec<Field>,
}

fn index(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(NO_VERTEX)
}

impl MeshStream {
    /// True for a PLY file whose header has faces: a mesh and not a cloud. False for other files and for
    /// headers that cannot be read.
    ///
    /// # Errors
    /// [`FileError::Io`].
    pub fn holds_faces(path: &Path) -> Result<bool, FileError> {
        let mut source = Source::open(path)?;
        if !source.peek(3)?.starts_with(b"ply") {
            return Ok(false);
        }
        match source.header() {
            Ok(header) => Ok(header.holds_faces()),
            Err(FileError::Content { .. }) => Ok(false),
            Err(other) => Err(other),
        }
    }

    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`FileError::Io`]; [`FileError::Content`] if it is no PLY mesh, or has counts that do not fit its size.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        Self::open_as(path, path)
    }

    /// As [`MeshStream::open`]; errors name the file `shown`.
    ///
    /// # Errors
    /// See [`MeshStream::open`].
    pub fn open_as(path: &Path, shown: &Path) -> Result<Self, FileError> {
        let mut source = Source::open(path)?.shown_as(shown);
        let header = source.header()?;
        let columns = Vec::new();
        let mesh = Self {
            header,
            source,
            columns,
        };
        mesh.check().map_err(|e| mesh.source.wrong(e))?;
        Ok(mesh)
    }

    /// The name of the file in errors.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.source.path()
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

    /// The reference system, as far as the header tells it.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.header.system
    }

    /// True if all vertices come before the first face.
    #[must_use]
    pub fn vertices_first(&self) -> bool {
        let mut names = self.header.elements.iter().map(|e| &*e.name);
        names.find(|n| ["vertex", "face"].contains(n)) == Some("vertex")
    }

    /// The place of the coordinates, if the header gives one. Positions are passed on as they are in the file.
    #[must_use]
    pub fn place(&self) -> Place {
        self.header.place
    }

    /// Types of the properties x, y and z.
    #[must_use]
    pub fn types(&self) -> Option<[Scalar; 3]> {
        let (_, vertex) = self.header.element("vertex").ok()??;
        Some(vertex.coordinates().ok()?.map(|(_, scalar)| scalar))
    }

    /// Index, name and type of each property of the vertices that is one number and no coordinate.
    #[must_use]
    pub fn columns(&self) -> Vec<(usize, &str, Scalar)> {
        let Ok(Some((_, vertex))) = self.header.element("vertex") else {
            return Vec::new();
        };
        let properties = vertex.properties.iter().enumerate();
        let columns = properties.filter_map(|(at, (name, property))| match property {
            Property::One(_) if ["x", "y", "z"].contains(&&**name) => None,
            Property::One(scalar) => Some((at, &**name, *scalar)),
            Property::List { .. } => None,
        });
        columns.collect()
    }

    /// Reads the values of these of the [`MeshStream::columns`] as well, given by index and type, ascending.
    #[must_use]
    pub fn wanting(mut self, columns: Vec<Field>) -> Self {
        self.columns = columns;
        self
    }

    fn count(&self, name: &str) -> u64 {
        let mut elements = self.header.elements.iter();
        elements.find(|e| e.name == name).map_or(0, |e| e.count)
    }

    /// Checks that the required elements exist and that their counts fit the file.
    fn check(&self) -> Result<()> {
        let refuse = |place: &str, found, expected: &str| Err(Error::input(place, found, expected));
        let elements = &self.header.elements;
        for name in ["vertex", "face"] {
            if self.header.element(name)?.is_none() {
                let names: Vec<_> = elements.iter().map(|e| &*e.name).collect();
                let found = format!("elements [{}]", names.join(", "));
                return refuse("PLY header", found, &format!("an element {name}"));
            }
        }
        if self.vertices() > u64::from(NO_VERTEX) {
            let found = format!("{} vertices", self.vertices());
            return refuse("PLY header", found, "at most 4294967295");
        }
        let body = self.source.left();
        // The last number of an ascii file needs no separator after it.
        let room = u128::from(body) + u128::from(self.header.encoding == Encoding::Ascii);
        let mut needed = 0u128;
        for element in elements {
            Role::of(element)?;
            let each = element.least_bytes(self.header.encoding);
            needed += u128::from(element.count) * u128::from(each);
            if needed > room {
                return refuse(
                    &format!("PLY header, element {}", element.name),
                    format!("{} entries of {each} bytes or more", element.count),
                    &format!("what fits into the {body} bytes after the header"),
                );
            }
        }
        Ok(())
    }

    /// Reads the whole mesh; `take` receives its parts.
    ///
    /// # Errors
    /// Errors of `take`, which end the reading; [`FileError::Io`]; [`FileError::Content`] with the byte offset
    /// at which the file ends early or does not match its header.
    pub fn read<E: From<FileError>>(
        mut self,
        mut take: impl FnMut(Part<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        for element in &self.header.elements {
            let source = &mut self.source;
            match Role::of(element).map_err(|e| source.wrong(e))? {
                Role::Vertices(axes) => {
                    vertices(source, element, (axes, &self.columns), &mut take)?;
                }
                Role::Faces(list) => faces(source, element, list, &mut take)?,
                Role::Other => skip(source, element)?,
            }
        }
        Ok(())
    }
}

/// The use of an element.
enum Role {
    /// Vertices: positions and types of `x`, `y` and `z` among the properties.
    Vertices([Field; 3]),
    /// Faces: position of the property with the corners, and the types of its count and its items.
    Faces((usize, Scalar, Scalar)),
    Other,
}

impl Role {
    fn of(element: &Element) -> Result<Self> {
        Ok(match element.name.as_str() {
            "vertex" => Self::Vertices(element.coordinates()?),
            "face" => Self::Faces(element.corners()?),
            _ => Self::Other,
        })
    }
}

fn skip(source: &mut Source, element: &Element) -> Result<(), FileError> {
    match element.record_bytes() {
        // Entries without properties, of any number.
        Some(0) => Ok(()),
        Some(each) if source.big().is_some() => {
            let bytes = element.count.saturating_mul(each as u64);
            source.skip(bytes, format_args!("element {}", element.name))
        }
        _ => (0..element.count).try_for_each(|_| {
            let mut properties = element.properties.iter();
            properties.try_for_each(|(name, property)| source.skip_property(name, *property))
        }),
    }
}

fn vertices<E: From<FileError>>(
    source: &mut Source,
    element: &Element,
    (axes, columns): ([Field; 3], &[Field]),
    take: &mut impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let (mut slice, mut values) = (Vec::with_capacity(SLICE), Vec::new());
    let mut left = element.count;
    while left > 0 {
        let most = left.min(SLICE as u64) as usize;
        slice.clear();
        values.clear();
        source.fixed_vertices(element, (axes, columns), most, (&mut slice, &mut values))?;
        if slice.is_empty() {
            for _ in 0..most {
                slice.push(source.vertex(element, axes, columns, &mut values)?);
            }
        }
        take(Part::Vertices(&slice))?;
        if !columns.is_empty() {
            take(Part::Values(&values))?;
        }
        left -= slice.len() as u64;
    }
    Ok(())
}

fn faces<E: From<FileError>>(
    source: &mut Source,
    element: &Element,
    list: (usize, Scalar, Scalar),
    take: &mut impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut slice = Vec::with_capacity(SLICE);
    let mut left = element.count;
    while left > 0 {
        let (most, old) = (left.min((SLICE - slice.len()) as u64), slice.len());
        source.fixed_triangles(element, list, most as usize, &mut slice)?;
        left -= (slice.len() - old) as u64;
        // One by one in text, at the end of the buffer, and if a face is not a triangle.
        if left > 0 && slice.len() < SLICE {
            for (at, (name, property)) in element.properties.iter().enumerate() {
                if at != list.0 {
                    source.skip_property(name, *property)?;
                    continue;
                }
                let corners = source.fan(name, list, |triangle| {
                    slice.push(triangle);
                    pass_on_full(&mut slice, take)
                })?;
                if corners != 3 {
                    take(Part::Polygon(corners))?;
                }
            }
            left -= 1;
        }
        pass_on_full(&mut slice, take)?;
    }
    take(Part::Triangles(&slice))
}

/// Passes on a slice of triangles if it is full.
fn pass_on_full<E>(
    slice: &mut Vec<[u32; 3]>,
    take: &mut impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E> {
    if slice.len() < SLICE {
        return Ok(());
    }
    take(Part::Triangles(slice))?;
    slice.clear();
    Ok(())
}
