//! Reading a large binary PLY mesh face by face, without holding it.

use std::{
    fs::File,
    io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use crate::error::{Error, Result};

/// Longest header.
const MOST_HEADER: u64 = 1 << 16;

/// Bytes of a triangle: their number and three corners.
const FACE: usize = 13;

/// A triangle mesh in a file: little-endian, vertices first, no lists but the corners of triangles.
#[derive(Debug)]
pub(crate) struct PlyStream {
    path: PathBuf,
    layout: Layout,
}

/// Where things are in the file.
#[derive(Debug)]
struct Layout {
    /// Bytes of the header.
    header: u64,
    vertices: u64,
    faces: u64,
    /// Bytes of a vertex.
    stride: usize,
    /// Of x, y and z: place in a vertex, and whether in double precision.
    places: [(usize, bool); 3],
}

impl PlyStream {
    /// Reads the header, and checks that the file is as long as it says.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, "open the mesh", e))?;
        let metadata = file
            .metadata()
            .map_err(|e| Error::io(path, "open the mesh", e))?;
        let text = header(BufReader::new(file)).map_err(|e| Error::io(path, "read", e))?;
        let layout = parse(&text)
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
                .map(|(at, double)| coordinate(&row[at..], double));
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
        let mut row = [0; FACE];
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
        let faces = self.faces.checked_mul(FACE as u64)?;
        self.header.checked_add(vertices)?.checked_add(faces)
    }
}

/// `bytes` has eight of them at least if the number is double, else four.
fn coordinate(bytes: &[u8], double: bool) -> f64 {
    if double {
        bytes
            .first_chunk()
            .map_or(f64::NAN, |b| f64::from_le_bytes(*b))
    } else {
        bytes
            .first_chunk()
            .map_or(f64::NAN, |b| f32::from_le_bytes(*b).into())
    }
}

/// The header with its last line, or as much as may be one.
fn header(file: impl BufRead) -> std::io::Result<Vec<u8>> {
    let mut file = file.take(MOST_HEADER);
    let mut text = Vec::new();
    loop {
        let start = text.len();
        if file.read_until(b'\n', &mut text)? == 0 || text[start..].trim_ascii() == b"end_header" {
            return Ok(text);
        }
    }
}

/// An element of the header.
struct Element<'a> {
    name: &'a str,
    count: u64,
    properties: Vec<Vec<&'a str>>,
}

fn parse(header: &[u8]) -> Result<Layout, String> {
    let text = String::from_utf8_lossy(header);
    let mut lines = text.lines().map(str::trim_ascii);
    if lines.next() != Some("ply") {
        return Err("no PLY header".to_owned());
    }
    if !text.trim_ascii_end().ends_with("end_header") {
        return Err("no end of the header".to_owned());
    }
    let mut elements: Vec<Element<'_>> = Vec::new();
    for line in lines {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (words.as_slice(), elements.last_mut()) {
            (["format", "binary_little_endian", _], _)
            | ([] | ["comment" | "obj_info" | "end_header", ..], _) => {}
            (["format", name, ..], _) => {
                return Err(format!("format {name}, expected binary_little_endian"));
            }
            (["element", name, count], _) => elements.push(Element {
                name,
                count: count
                    .parse()
                    .map_err(|_| format!("{count} is no number of elements"))?,
                properties: Vec::new(),
            }),
            (["property", rest @ ..], Some(element)) => element.properties.push(rest.to_vec()),
            _ => return Err(format!("header line {line:?} is not understood")),
        }
    }
    match elements.as_slice() {
        [vertex, face] if (vertex.name, face.name) == ("vertex", "face") => {
            layout(header.len() as u64, vertex, face)
        }
        _ => Err("expected the elements vertex and face".to_owned()),
    }
}

fn layout(header: u64, vertex: &Element<'_>, face: &Element<'_>) -> Result<Layout, String> {
    let corners = face.properties.iter().map(Vec::as_slice);
    let fits = |property: &[&str]| {
        matches!(
            property,
            [
                "list",
                "uchar" | "uint8",
                "int" | "uint" | "int32" | "uint32",
                _
            ]
        )
    };
    if face.properties.len() != 1 || !corners.clone().all(fits) {
        return Err("faces must have one property, a list uchar int or uchar uint".to_owned());
    }
    let (mut stride, mut places) = (0, [None; 3]);
    for property in &vertex.properties {
        let &[kind, name] = property.as_slice() else {
            return Err("vertices must not have lists".to_owned());
        };
        let size = size(kind).ok_or_else(|| format!("unknown type {kind}"))?;
        if let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) {
            if !matches!(kind, "float" | "float32" | "double" | "float64") {
                return Err(format!("{name} must be float or double"));
            }
            if places[axis].replace((stride, size == 8)).is_some() {
                return Err(format!("two properties {name}"));
            }
        }
        stride += size;
    }
    let [Some(x), Some(y), Some(z)] = places else {
        return Err("vertices must have x, y and z".to_owned());
    };
    Ok(Layout {
        header,
        vertices: vertex.count,
        faces: face.count,
        stride,
        places: [x, y, z],
    })
}

/// Bytes of a number.
fn size(kind: &str) -> Option<usize> {
    Some(match kind {
        "char" | "uchar" | "int8" | "uint8" => 1,
        "short" | "ushort" | "int16" | "uint16" => 2,
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => 4,
        "double" | "float64" => 8,
        _ => return None,
    })
}
