//! Reading a large binary PLY mesh face by face, in bounded memory.

use std::{
    fs::File,
    io::{BufReader, ErrorKind, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use outcrop_ply::{Element, Encoding, Header, Property, Scalar, TRIANGLE, real};

use crate::error::{Error, Result};

/// A triangle mesh in a file: little-endian, vertices first, no lists except the corners of triangles.
#[derive(Debug)]
pub(crate) struct PlyStream {
    path: PathBuf,
    layout: Layout,
}

/// Layout of the file.
#[derive(Debug)]
struct Layout {
    /// Bytes of the header.
    header: u64,
    vertices: u64,
    faces: u64,
    /// Bytes of a vertex.
    stride: usize,
    /// Offset in a vertex and type of x, y and z.
    places: [(usize, Scalar); 3],
}

impl PlyStream {
    /// Reads the header, and checks the length of the file.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, "open the mesh", e))?;
        let metadata = file
            .metadata()
            .map_err(|e| Error::io(path, "open the mesh", e))?;
        let header = Header::read(&mut BufReader::new(file));
        let header = header.map_err(|e| Error::mesh(path, e.to_string()))?;
        let layout = layout(&header)
            .and_then(|layout| {
                let need = layout.length().ok_or("too many vertices or faces")?;
                match metadata.len() {
                    length if length < need => {
                        Err(format!("{length} bytes, where its header asks for {need}"))
                    }
                    _ => Ok(layout),
                }
            })
            .map_err(|what| Error::mesh(path, what))?;
        Ok(PlyStream {
            path: path.to_path_buf(),
            layout,
        })
    }

    /// Number of vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.layout.vertices as usize
    }

    /// Number of faces.
    pub(crate) fn faces(&self) -> usize {
        self.layout.faces as usize
    }

    /// All vertices.
    pub(crate) fn vertices(&self) -> Result<Vec<[f64; 3]>> {
        let layout = &self.layout;
        let mut file = self.at(layout.header)?;
        let mut vertices = Vec::with_capacity(layout.vertices as usize);
        let mut row = vec![0; layout.stride];
        for _ in 0..layout.vertices {
            self.fill(&mut file, &mut row)?;
            let place = layout
                .places
                .map(|(at, scalar)| real(scalar, &row[at..], false));
            if place.iter().any(|c| !c.is_finite()) {
                return Err(Error::mesh(&self.path, "a vertex that is not finite"));
            }
            vertices.push(place);
        }
        Ok(vertices)
    }

    /// Calls `take` with the corners of each face.
    pub(crate) fn for_each_face(&self, mut take: impl FnMut(usize, [u32; 3])) -> Result<()> {
        let layout = &self.layout;
        let mut file = self.at(layout.header + layout.vertices * layout.stride as u64)?;
        let mut row = [0; TRIANGLE];
        for face in 0..self.faces() {
            self.fill(&mut file, &mut row)?;
            if row[0] != 3 {
                let what = format!(
                    "a face of {} corners, where only triangles are read",
                    row[0]
                );
                return Err(Error::mesh(&self.path, what));
            }
            let corner =
                |at: usize| u32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
            let corners = [corner(1), corner(5), corner(9)];
            if corners.iter().any(|&v| u64::from(v) >= layout.vertices) {
                let what = format!("a corner beyond the {} vertices", layout.vertices);
                return Err(Error::mesh(&self.path, what));
            }
            take(face, corners);
        }
        Ok(())
    }

    fn at(&self, place: u64) -> Result<BufReader<File>> {
        let mut file =
            File::open(&self.path).map_err(|e| Error::io(&self.path, "open the mesh", e))?;
        file.seek(SeekFrom::Start(place))
            .map_err(|e| Error::io(&self.path, "read", e))?;
        Ok(BufReader::with_capacity(1 << 18, file))
    }

    fn fill(&self, file: &mut impl Read, row: &mut [u8]) -> Result<()> {
        file.read_exact(row).map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => Error::mesh(&self.path, "it ends too early"),
            _ => Error::io(&self.path, "read", e),
        })
    }
}

impl Layout {
    /// Bytes of the file.
    fn length(&self) -> Option<u64> {
        let vertices = self.vertices.checked_mul(self.stride as u64)?;
        let faces = self.faces.checked_mul(TRIANGLE as u64)?;
        self.header.checked_add(vertices)?.checked_add(faces)
    }
}

fn layout(header: &Header) -> Result<Layout, String> {
    if header.encoding != Encoding::Little {
        let name = header.encoding.name();
        return Err(format!("format {name}, expected binary_little_endian"));
    }
    let [vertex, face] = header.elements.as_slice() else {
        return Err("expected the elements vertex and face".to_owned());
    };
    if (&*vertex.name, &*face.name) != ("vertex", "face") {
        return Err("expected the elements vertex and face".to_owned());
    }
    let fits = |property: Property| {
        matches!(
            property,
            Property::List {
                count: Scalar::U8,
                item: Scalar::I32 | Scalar::U32,
            }
        )
    };
    if face.properties.len() != 1 || !face.properties.iter().all(|p| fits(p.1)) {
        return Err("faces must have one property, a list uchar int or uchar uint".to_owned());
    }
    let stride = vertex.record_bytes();
    Ok(Layout {
        header: header.bytes,
        vertices: vertex.count,
        faces: face.count,
        stride: stride.ok_or("vertices must not have lists")?,
        places: places(vertex)?,
    })
}

fn places(vertex: &Element) -> Result<[(usize, Scalar); 3], String> {
    let coordinates = vertex.coordinates().map_err(|e| e.to_string())?;
    if coordinates.iter().any(|c| c.1.is_integer()) {
        return Err("x, y and z must be float or double".to_owned());
    }
    Ok(coordinates.map(|(at, scalar)| (vertex.bytes_before(at).unwrap_or(0), scalar)))
}
