//! Streaming reader of triangle meshes in PLY files; see [`MeshStream`].

use crate::failure::{Failure, converted};
use crate::foreign::{as_plain_ply, as_ply, is_foreign};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::compressed::{Beginning, Content};
use outcrop_platform::FileAt;
use outcrop_ply::{FixedMesh, Header, MeshStream, Part, Scalar, System};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

pub use outcrop_ply::{NO_VERTEX, SLICE};

/// Receives the mesh, slice by slice, in the order of the file.
pub trait Sink {
    /// Receives the positions of the next vertices, at most [`SLICE`].
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()>;

    /// Receives the values of the wanted columns of the vertices that came last, vertex by vertex.
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn values(&mut self, _values: &[f64]) -> Result<()> {
        Ok(())
    }

    /// Receives the corners of the next triangles, at most [`SLICE`]. Indices are as in the file, not checked
    /// against the number of vertices; those below 0 or above [`NO_VERTEX`] are reported as [`NO_VERTEX`].
    ///
    /// # Errors
    /// Any error; it ends the reading.
    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()>;
}

/// A PLY mesh with a checked header.
#[derive(Debug)]
pub struct PlyMesh {
    stream: MeshStream,
    /// The file that the stream reads if the mesh is compressed; it is deleted at the end.
    _content: Option<Content>,
}

/// True for a PLY file whose header has faces, and for the other formats of meshes: a mesh and not a cloud. False for
/// other files and for headers that cannot be read; their readers report the error.
///
/// # Errors
/// [`Error::Io`].
pub fn holds_faces(path: &Path) -> Result<bool> {
    let compressed = match Beginning::of(path, &is_mesh, Header::LONGEST) {
        Err(Error::Input { .. }) => return Ok(false),
        beginning => beginning?,
    };
    let mut head = [0; 4];
    if let Some(beginning) = &compressed {
        let known = beginning.bytes.len().min(head.len());
        head[..known].copy_from_slice(&beginning.bytes[..known]);
    } else {
        let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
        let _short = file.read_exact_at(&mut head, 0);
    }
    if is_foreign(path, &head) {
        return Ok(true);
    }
    let Some(beginning) = compressed else {
        return MeshStream::holds_faces(path).map_err(converted);
    };
    let header = Header::read(&mut &beginning.bytes[..]);
    Ok(header.is_ok_and(|header| header.holds_faces()))
}

/// True for the name and the first bytes of a mesh.
fn is_mesh(path: &Path, head: &[u8], _: bool) -> bool {
    head.starts_with(b"ply") || is_foreign(path, head)
}

/// The reference system in the comments of a mesh; nothing of a file whose header cannot be read: its readers report
/// the error.
///
/// # Errors
/// [`Error::Io`].
pub fn system(path: &Path) -> Result<System> {
    let compressed = match Beginning::of(path, &is_mesh, Header::LONGEST) {
        Err(Error::Input { .. }) => return Ok(System::default()),
        beginning => beginning?,
    };
    let header = match compressed {
        Some(beginning) => Header::read(&mut &beginning.bytes[..]),
        None => {
            let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
            Header::read(&mut BufReader::new(file))
        }
    };
    Ok(header.map(|header| header.system).unwrap_or_default())
}

impl PlyMesh {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] if it is no PLY mesh, or has counts that do not fit its size.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self {
            stream: MeshStream::open(path).map_err(converted)?,
            _content: None,
        })
    }

    /// As [`PlyMesh::open`], also for a compressed file, and for meshes in OBJ, STL and GLB. A mesh that is not
    /// in binary PLY, its vertices before its faces and these all triangles, is read from the scratch folder. So
    /// it can be read at any place ([`PlyMesh::fixed`]), and all faces are triangles.
    ///
    /// # Errors
    /// See [`PlyMesh::open`] and [`Content::of`].
    pub fn open_any(path: &Path, workspace: &Workspace) -> Result<Self> {
        let content = Content::of(path, &is_mesh, workspace)?;
        let plain = content.as_ref().map_or(path, |content| &content.path);
        let ply = match as_ply(path, plain, workspace)? {
            Some(ply) => ply,
            None => {
                let stream = MeshStream::open_as(plain, path).map_err(converted)?;
                if stream.is_plain().map_err(converted)? {
                    let _content = content;
                    return Ok(Self { stream, _content });
                }
                as_plain_ply(path, plain, workspace)?
            }
        };
        let stream = MeshStream::open_as(&ply, path).map_err(converted)?;
        let _content = None;
        Ok(Self { stream, _content })
    }

    /// Number of vertices; at most [`NO_VERTEX`], so that indices fit `u32`.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.stream.vertices()
    }

    /// Number of faces, of any number of corners.
    #[must_use]
    pub fn faces(&self) -> u64 {
        self.stream.faces()
    }

    /// The position of the cloud that is the origin of the mesh's coordinates, if its header gives one.
    #[must_use]
    pub fn origin(&self) -> Option<[f64; 3]> {
        self.stream.place().origin()
    }

    /// True if all coordinates are `f32` in the file, and not moved by an origin.
    #[must_use]
    pub fn has_plain_floats(&self) -> bool {
        self.origin().is_none() && self.has_floats()
    }

    /// True if all coordinates are `f32` in the file.
    #[must_use]
    pub fn has_floats(&self) -> bool {
        self.stream.types() == Some([Scalar::F32; 3])
    }

    /// Index, name and type of each property of the vertices that is one number and no coordinate.
    #[must_use]
    pub fn columns(&self) -> Vec<(usize, &str, Scalar)> {
        self.stream.columns()
    }

    /// Reads the values of these columns as well, given by index and type, ascending.
    #[must_use]
    pub fn wanting(self, columns: Vec<(usize, Scalar)>) -> Self {
        let stream = self.stream.wanting(columns);
        Self { stream, ..self }
    }

    /// The map of positions in the file to the coordinates of the cloud.
    pub fn place(&self) -> impl Fn([f64; 3]) -> [f64; 3] + use<> {
        let (place, types) = (self.stream.place(), self.stream.types());
        move |position| match types {
            Some(types) => place.position(position, types),
            None => position,
        }
    }

    /// As [`PlyMesh::read`], with the coordinates of the cloud instead of those from the mesh's origin.
    ///
    /// # Errors
    /// See [`PlyMesh::read`].
    pub fn read_in_place(self, sink: &mut impl Sink) -> Result<()> {
        if self.origin().is_none() {
            return self.read(sink);
        }
        let (place, positions) = (self.place(), Vec::with_capacity(SLICE));
        self.read(&mut InPlace {
            sink,
            place,
            positions,
        })
    }

    /// Reads the whole mesh.
    ///
    /// # Errors
    /// Errors of the sink; [`Error::Io`]; [`Error::Input`] with the byte offset at which the file ends early
    /// or does not match its header.
    pub fn read(self, sink: &mut impl Sink) -> Result<()> {
        let path = self.stream.path().to_path_buf();
        // The size of a file may look as if all faces were triangles.
        let polygon = |corners| {
            let found = format!("one of {corners} corners");
            Err(Error::input(&path, "faces", found, "triangles only"))
        };
        let mut take = |part: Part<'_>| match part {
            Part::Vertices(positions) => sink.vertices(positions),
            Part::Values(values) => sink.values(values),
            Part::Triangles(triangles) => sink.triangles(triangles),
            Part::Polygon(corners) => polygon(corners),
        };
        let read = self.stream.read(|part| take(part).map_err(Failure::from));
        read.map_err(converted)
    }
}

/// A mesh read at any place, by many threads; see [`PlyMesh::fixed`].
#[derive(Debug)]
pub struct AnyPlace(FixedMesh);

impl PlyMesh {
    /// The mesh for reading at any place, as long as the mesh itself lives: if its vertices have entries of one
    /// size, and its faces if they are triangles.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn fixed(&self) -> Result<Option<AnyPlace>> {
        Ok(self.stream.fixed().map_err(converted)?.map(AnyPlace))
    }
}

impl AnyPlace {
    /// Bytes of a vertex, and of a face that is a triangle.
    #[must_use]
    pub fn entries(&self) -> [usize; 2] {
        [self.0.vertex_bytes(), self.0.face_bytes()]
    }

    /// See [`FixedMesh::positions`].
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn positions(
        &self,
        range: (u64, usize),
        bytes: &mut Vec<u8>,
        positions: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        let read = self.0.positions(range, bytes, positions);
        read.map_err(converted)
    }

    /// See [`FixedMesh::values`].
    pub fn values<'a>(&'a self, bytes: &'a [u8], column: usize) -> impl Iterator<Item = f64> + 'a {
        self.0.values(bytes, column)
    }

    /// See [`FixedMesh::triangles`].
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn triangles(
        &self,
        range: (u64, usize),
        bytes: &mut Vec<u8>,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<bool> {
        let read = self.0.triangles(range, bytes, triangles);
        read.map_err(converted)
    }
}

/// Passes on positions with the coordinates of the cloud.
struct InPlace<'a, S, P> {
    sink: &'a mut S,
    place: P,
    positions: Vec<[f64; 3]>,
}

impl<S: Sink, P: Fn([f64; 3]) -> [f64; 3]> Sink for InPlace<'_, S, P> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.positions.clear();
        self.positions
            .extend(positions.iter().map(|p| (self.place)(*p)));
        self.sink.vertices(&self.positions)
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.sink.values(values)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.sink.triangles(triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_keep_their_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        let said = |error: Error| {
            let text = error.to_string();
            text.strip_prefix(&format!("{}: ", path.display()))
                .unwrap()
                .to_owned()
        };
        let missing = PlyMesh::open(&path).unwrap_err();
        assert!(matches!(missing, Error::Io { .. }));
        assert!(said(missing).starts_with("cannot open: "));
        std::fs::write(&path, "ply\nformat ascii 1.0\nend_header\n").unwrap();
        let empty = PlyMesh::open(&path).unwrap_err();
        assert!(matches!(empty, Error::Input { .. }));
        let words = "PLY header: found elements [], expected an element vertex";
        assert_eq!(said(empty), words);
    }
}
