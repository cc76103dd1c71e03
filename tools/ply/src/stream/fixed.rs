//! Meshes in binary files in which all entries have one size, read at any place.

use super::binary::{PLAIN, plain};
use super::{MeshStream, Role, SLICE, index};
use crate::error::FileError;
use crate::header::{Element, bytes_of};
use crate::numbers::{integer, real};
use crate::types::{Property, Scalar};
use outcrop_platform::FileAt;
use std::fs::File;
use std::path::PathBuf;

/// The entries of an element.
#[derive(Debug, Clone, Copy)]
struct Entries {
    /// Offset of the first in the file.
    at: u64,
    /// Bytes of each.
    each: usize,
}

/// A mesh whose vertices, and faces if they are triangles, have entries of one size each.
#[derive(Debug)]
pub struct FixedMesh {
    path: PathBuf,
    file: File,
    big: bool,
    vertices: Entries,
    /// Bytes before each coordinate in its entry, and its type.
    axes: [(usize, Scalar); 3],
    /// Bytes before each property of a vertex in its entry, and its type.
    properties: Vec<(usize, Scalar)>,
    faces: Entries,
    /// Number of faces.
    count: u64,
    /// Bytes before the list of corners, types of its count and of its items.
    list: (usize, Scalar, Scalar),
    /// True if the file ends where it does if all faces are triangles.
    fits: bool,
}

/// The types of the properties of an element whose entries have one size.
fn scalars(element: &Element) -> impl Iterator<Item = Scalar> {
    let properties = element.properties.iter();
    properties.map(|(_, property)| match property {
        Property::One(scalar) => *scalar,
        // There is none: entries with lists have no size.
        Property::List { count, .. } => *count,
    })
}

impl MeshStream {
    /// The mesh for reading at any place: if the file is binary, has no lists but that of the corners, and is
    /// long enough for faces that are triangles.
    ///
    /// # Errors
    /// [`FileError::Io`].
    pub fn fixed(&self) -> Result<Option<FixedMesh>, FileError> {
        let Some(big) = self.source.big() else {
            return Ok(None);
        };
        let (mut at, mut vertices, mut faces) = (self.header.bytes, None, None);
        let mut properties = Vec::new();
        for element in &self.header.elements {
            let role = Role::of(element).map_err(|e| self.source.wrong(e))?;
            let each = match role {
                Role::Faces((list, count, item)) => {
                    let (before, after) = element.properties.split_at(list);
                    let (Some(before), Some(after)) = (bytes_of(before), bytes_of(&after[1..]))
                    else {
                        return Ok(None);
                    };
                    let each = before + count.bytes() + 3 * item.bytes() + after;
                    faces = Some((Entries { at, each }, (before, count, item)));
                    each
                }
                Role::Vertices(axes) => {
                    let Some(each) = element.record_bytes() else {
                        return Ok(None);
                    };
                    let place = |(at, s)| (element.bytes_before(at).unwrap_or(0), s);
                    vertices = Some((Entries { at, each }, axes.map(place)));
                    properties = scalars(element).enumerate().map(place).collect();
                    each
                }
                Role::Other => match element.record_bytes() {
                    Some(each) => each,
                    None => return Ok(None),
                },
            };
            at = at.saturating_add(element.count.saturating_mul(each as u64));
        }
        let (Some((vertices, axes)), Some((faces, list))) = (vertices, faces) else {
            return Ok(None);
        };
        if at > self.source.bytes() {
            return Ok(None);
        }
        let (path, file) = self.source.again()?;
        Ok(Some(FixedMesh {
            path,
            file,
            big,
            vertices,
            axes,
            properties,
            faces,
            count: self.faces(),
            list,
            fits: at == self.source.bytes(),
        }))
    }

    /// True if the mesh can be read as it is, at any place: see [`MeshStream::fixed`]; its vertices come first, and
    /// all its faces are triangles. Where the size of the file says so, the faces are not read for it.
    ///
    /// # Errors
    /// [`FileError::Io`].
    pub fn is_plain(&self) -> Result<bool, FileError> {
        match self.fixed()? {
            Some(fixed) if self.vertices_first() => Ok(fixed.fits || fixed.are_triangles()?),
            _ => Ok(false),
        }
    }
}

impl FixedMesh {
    /// Bytes of a face that is a triangle.
    #[must_use]
    pub fn face_bytes(&self) -> usize {
        self.faces.each
    }

    /// Bytes of a vertex.
    #[must_use]
    pub fn vertex_bytes(&self) -> usize {
        self.vertices.each
    }

    fn read(
        &self,
        entries: Entries,
        (first, count): (u64, usize),
        bytes: &mut Vec<u8>,
    ) -> Result<(), FileError> {
        bytes.resize(count * entries.each, 0);
        let offset = entries.at + first * entries.each as u64;
        let read = self.file.read_exact_at(bytes, offset);
        read.map_err(|e| FileError::io(&self.path, "read", e))
    }

    /// Appends the positions of `count` vertices from `first` on. They are vertices of the mesh; `bytes` is
    /// memory for them as they are in the file.
    ///
    /// # Errors
    /// [`FileError::Io`].
    pub fn positions(
        &self,
        (first, count): (u64, usize),
        bytes: &mut Vec<u8>,
        positions: &mut Vec<[f64; 3]>,
    ) -> Result<(), FileError> {
        self.read(self.vertices, (first, count), bytes)?;
        let (rows, big) = (bytes.chunks_exact(self.vertices.each), self.big);
        let [x, y, z] = self.axes.map(|(at, _)| at);
        let with = |scalar| {
            move |row: &[u8]| [x, y, z].map(|at| real(scalar, &row[at..at + scalar.bytes()], big))
        };
        // The usual types have loops of their own.
        match self.axes.map(|(_, scalar)| scalar) {
            [Scalar::F32, Scalar::F32, Scalar::F32] => {
                positions.extend(rows.map(with(Scalar::F32)))
            }
            [Scalar::F64, Scalar::F64, Scalar::F64] => {
                positions.extend(rows.map(with(Scalar::F64)))
            }
            _ => {
                let axis =
                    |row: &[u8], (at, scalar): (usize, Scalar)| real(scalar, &row[at..], big);
                positions.extend(rows.map(|row| self.axes.map(|a| axis(row, a))));
            }
        }
        Ok(())
    }

    /// The values of a column of the vertices that [`FixedMesh::positions`] read last, from the `bytes` that it left:
    /// the index of the column is that of [`MeshStream::columns`].
    pub fn values<'a>(&'a self, bytes: &'a [u8], column: usize) -> impl Iterator<Item = f64> + 'a {
        let (at, scalar) = self.properties[column];
        let rows = bytes.chunks_exact(self.vertices.each);
        rows.map(move |row| real(scalar, &row[at..], self.big))
    }

    /// True if all faces are triangles.
    fn are_triangles(&self) -> Result<bool, FileError> {
        let (mut bytes, mut triangles) = (Vec::new(), Vec::new());
        for first in (0..self.count).step_by(SLICE) {
            let count = (self.count - first).min(SLICE as u64) as usize;
            if !self.triangles((first, count), &mut bytes, &mut triangles)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Replaces `triangles` by `count` faces of the mesh from `first` on, indices as in
    /// [`super::Part::Triangles`]. False if one of them is no triangle: then it and those after it are
    /// elsewhere.
    ///
    /// # Errors
    /// [`FileError::Io`].
    pub fn triangles(
        &self,
        (first, count): (u64, usize),
        bytes: &mut Vec<u8>,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<bool, FileError> {
        self.read(self.faces, (first, count), bytes)?;
        triangles.clear();
        let (list, length, item) = self.list;
        let (big, size) = (self.big, item.bytes());
        if (list, length, item, big, self.faces.each) == (0, Scalar::U8, Scalar::I32, false, PLAIN)
        {
            let rows = bytes.as_chunks::<PLAIN>().0.iter();
            triangles.extend(rows.clone().map(plain));
            return Ok(rows.fold(true, |all, row| all & (row[0] == 3)));
        }
        let rows = bytes.chunks_exact(self.faces.each);
        let begin = list + length.bytes();
        let corner = |row: &[u8], k: usize| index(integer(item, &row[begin + k * size..], big));
        let sound = rows
            .clone()
            .all(|row| integer(length, &row[list..], big) == 3);
        triangles.extend(rows.map(|row| [corner(row, 0), corner(row, 1), corner(row, 2)]));
        Ok(sound)
    }
}
