//! Vertices and triangles as they come, and the PLY file that they become.

use super::Mesh;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Files, Workspace};
use outcrop_ply::{Encoding, Layout, NO_VERTEX, Scalar, TRIANGLE, put_triangle};
use std::path::PathBuf;
use std::sync::Arc;

/// Bytes that are written or read at a time.
const CHUNK: usize = 1 << 20;

/// Bytes of a vertex on the way: a position and a colour.
const VERTEX: usize = 3 * 8 + 3;

/// The material of a vertex that no triangle has, or of a triangle without one.
pub(super) const NO_MATERIAL: u16 = u16::MAX;

/// Colour of what has none in a mesh that has colours.
const WHITE: [u8; 3] = [255; 3];

/// The names of colours in PLY.
const COLOURS: [(&str, Scalar); 3] = [
    ("red", Scalar::U8),
    ("green", Scalar::U8),
    ("blue", Scalar::U8),
];

/// Bytes that are appended to a scratch file chunk by chunk, from one thread.
struct Stream {
    file: Arc<ScratchFile>,
    name: String,
    files: Files,
    buffer: Vec<u8>,
    begin: Option<Place>,
    bytes: u64,
}

impl Stream {
    fn new(name: String, workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            file: workspace.files.open(&name, false)?,
            name,
            files: workspace.files.clone(),
            buffer: Vec::with_capacity(CHUNK + TRIANGLE.max(VERTEX)),
            begin: None,
            bytes: 0,
        })
    }

    fn push(&mut self, bytes: &[u8]) -> Result<()> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= CHUNK {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        let place = self.file.append(self.files.worker(), &self.buffer, 0)?;
        if !self.buffer.is_empty() {
            self.begin.get_or_insert(place);
        }
        self.bytes += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }

    /// Passes on what was written, in chunks of whole records of `record` bytes.
    fn read(
        &self,
        record: usize,
        workspace: &Workspace,
        mut take: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some(begin) = self.begin else {
            return Ok(());
        };
        let chunk = (CHUNK / record * record) as u64;
        let mut bytes = Vec::new();
        let mut at = 0;
        while at < self.bytes {
            workspace.check_cancel()?;
            bytes.resize(chunk.min(self.bytes - at) as usize, 0);
            self.file
                .read(begin.segment, begin.offset + at, &mut bytes)?;
            take(&bytes)?;
            at += bytes.len() as u64;
        }
        Ok(())
    }

    fn release(self) -> Result<()> {
        self.files.release(&self.name)
    }
}

/// The finished file `name` of this workspace, if there is one.
pub(super) fn finished(name: &str, workspace: &Workspace) -> Result<Option<PathBuf>> {
    let file = workspace.files.open(name, false)?;
    let worker = workspace.files.worker();
    // Nothing is appended; this tells the segment.
    let place = file.append(worker, &[], 0)?;
    Ok((file.bytes() > 0).then(|| file.path(place.segment)))
}

/// Receives a mesh.
pub(super) struct Spool<'a> {
    mesh: &'a Mesh<'a>,
    /// The name of the file, and the beginning of those of others.
    pub name: String,
    vertices: Stream,
    triangles: Stream,
    /// Material of each triangle.
    materials: Stream,
    /// The colour of each material, if it has one.
    pub palette: Vec<Option<[u8; 3]>>,
    /// Coordinates are written as 32-bit floats.
    pub floats: bool,
    has_colours: bool,
    vertex_count: u64,
    triangle_count: u64,
    /// Faces with more than three corners.
    polygons: u64,
    /// Faces with less than three corners.
    lines: u64,
    /// The kinds of data in the file that are not read, such as textures.
    pub left_out: Vec<&'static str>,
    _held: Reservation,
}

impl<'a> Spool<'a> {
    pub fn new(mesh: &'a Mesh<'a>, name: &str) -> Result<Self> {
        let workspace = mesh.workspace;
        let stream = |part: &str| Stream::new(format!("{name} {part}"), workspace);
        Ok(Self {
            mesh,
            name: name.to_owned(),
            vertices: stream("vertices")?,
            triangles: stream("triangles")?,
            materials: stream("materials")?,
            palette: Vec::new(),
            floats: false,
            has_colours: false,
            vertex_count: 0,
            triangle_count: 0,
            polygons: 0,
            lines: 0,
            left_out: Vec::new(),
            _held: workspace.reserve("mesh: reading", 8 * CHUNK as u64)?,
        })
    }

    /// Vertices so far.
    pub fn vertices(&self) -> u64 {
        self.vertex_count
    }

    /// Takes the next vertex. A mesh in which one vertex has a colour has colours.
    pub fn vertex(&mut self, position: [f64; 3], colour: Option<[u8; 3]>) -> Result<()> {
        let mut bytes = [0; VERTEX];
        for (axis, x) in position.iter().enumerate() {
            bytes[8 * axis..8 * axis + 8].copy_from_slice(&x.to_le_bytes());
        }
        bytes[24..].copy_from_slice(&colour.unwrap_or(WHITE));
        self.has_colours |= colour.is_some();
        self.vertex_count += 1;
        if self.vertex_count > u64::from(NO_VERTEX) {
            let found = format!("more than {NO_VERTEX}");
            let expected = format!("at most {NO_VERTEX}, which 32-bit numbers can name");
            return Err(self.mesh.error("vertices", found, &expected));
        }
        self.vertices.push(&bytes)
    }

    /// Takes the next face, which is divided into triangles from its first corner.
    pub fn face(&mut self, corners: &[u32], material: u16) -> Result<()> {
        match corners.len() {
            0..3 => self.lines += 1,
            3 => {}
            _ => self.polygons += 1,
        }
        for pair in corners.windows(2).skip(1) {
            self.triangle([corners[0], pair[0], pair[1]], material)?;
        }
        Ok(())
    }

    /// Takes the next triangle.
    pub fn triangle(&mut self, corners: [u32; 3], material: u16) -> Result<()> {
        let mut bytes = Vec::with_capacity(TRIANGLE);
        put_triangle(corners, &mut bytes);
        self.triangles.push(&bytes)?;
        self.materials.push(&material.to_le_bytes())?;
        self.triangle_count += 1;
        Ok(())
    }

    /// Writes the PLY file, and says what of the mesh is not in it.
    pub fn finish(mut self) -> Result<PathBuf> {
        if self.vertex_count == 0 || self.triangle_count == 0 {
            let found = format!(
                "{} vertices and {} triangles",
                self.vertex_count, self.triangle_count
            );
            return Err(self.mesh.error("content", found, "a mesh"));
        }
        [&mut self.vertices, &mut self.triangles, &mut self.materials]
            .into_iter()
            .try_for_each(Stream::flush)?;
        self.tell();
        let is_painted = !self.has_colours && self.palette.iter().any(Option::is_some);
        let columns = if self.has_colours || is_painted {
            &COLOURS[..]
        } else {
            &[]
        };
        let layout = Layout {
            encoding: Encoding::Little,
            comments: &[],
            vertices: self.vertex_count,
            coordinates: if self.floats {
                Scalar::F32
            } else {
                Scalar::F64
            },
            columns,
            triangles: Some((self.triangle_count, Scalar::U32)),
        };
        let workspace = self.mesh.workspace;
        let mut out = Stream::new(self.name.clone(), workspace)?;
        out.push(layout.header().as_bytes())?;
        match is_painted {
            true => self.paint(&mut out)?,
            false => self.write_vertices(&mut out)?,
        }
        self.vertices.release()?;
        self.materials.release()?;
        self.triangles
            .read(TRIANGLE, workspace, |bytes| out.push(bytes))?;
        self.triangles.release()?;
        out.flush()?;
        let segment = out.begin.map_or(0, |place| place.segment);
        Ok(out.file.path(segment))
    }

    fn tell(&mut self) {
        let (observer, shown) = (&self.mesh.workspace.observer, self.mesh.shown.display());
        if self.polygons > 0 {
            let count = self.polygons;
            let words =
                "with more than three corners were divided into triangles from their first one";
            observer.warn(&format!("{shown}: {count} faces {words}"));
        }
        if self.lines > 0 {
            let count = self.lines;
            let words = "with less than three corners were left out";
            observer.warn(&format!("{shown}: {count} faces {words}"));
        }
        if !self.left_out.is_empty() {
            let what = self.left_out.join(", ");
            observer.warn(&format!("{shown}: not read: {what}"));
        }
    }

    /// Appends a vertex to the file.
    fn put(&self, vertex: &[u8], colour: Option<[u8; 3]>, bytes: &mut Vec<u8>) {
        match self.floats {
            true => {
                for x in vertex[..24].chunks_exact(8) {
                    let x = f64::from_le_bytes(x.try_into().unwrap_or_default());
                    bytes.extend((x as f32).to_le_bytes());
                }
            }
            false => bytes.extend_from_slice(&vertex[..24]),
        }
        match colour {
            Some(colour) => bytes.extend(colour),
            None if self.has_colours => bytes.extend_from_slice(&vertex[24..]),
            None => {}
        }
    }

    fn write_vertices(&self, out: &mut Stream) -> Result<()> {
        let mut one = Vec::with_capacity(VERTEX);
        self.vertices.read(VERTEX, self.mesh.workspace, |vertices| {
            vertices.chunks_exact(VERTEX).try_for_each(|vertex| {
                one.clear();
                self.put(vertex, None, &mut one);
                out.push(&one)
            })
        })
    }

    /// As [`Spool::write_vertices`], with the colours of materials: each vertex has that of its first triangle with
    /// a material. The materials of a range of vertices are in memory at a time.
    fn paint(&self, out: &mut Stream) -> Result<()> {
        let workspace = self.mesh.workspace;
        let all = self.vertex_count as usize;
        let range = (workspace.memory.available() / 8) as usize;
        let range = range.clamp(CHUNK, all.max(CHUNK));
        let _held = workspace.reserve("mesh: materials", 2 * range as u64)?;
        let mut of_range = Vec::new();
        let (mut begin, mut at) = (0, 0);
        let mut one = Vec::with_capacity(VERTEX);
        self.vertices.read(VERTEX, workspace, |vertices| {
            vertices.chunks_exact(VERTEX).try_for_each(|vertex| {
                if at == begin + of_range.len() {
                    begin = at;
                    self.materials_of(begin, range.min(all - begin), &mut of_range)?;
                }
                let material = usize::from(of_range[at - begin]);
                let colour = self.palette.get(material).copied().flatten();
                one.clear();
                self.put(vertex, Some(colour.unwrap_or(WHITE)), &mut one);
                at += 1;
                out.push(&one)
            })
        })
    }

    /// The materials of the `count` vertices from `begin`.
    fn materials_of(&self, begin: usize, count: usize, of: &mut Vec<u16>) -> Result<()> {
        let workspace = self.mesh.workspace;
        of.clear();
        of.resize(count, NO_MATERIAL);
        let mut at = 0;
        self.triangles.read(TRIANGLE, workspace, |triangles| {
            let Some(first) = self.materials.begin else {
                return Ok(());
            };
            let mut materials = vec![0; 2 * (triangles.len() / TRIANGLE)];
            self.materials
                .file
                .read(first.segment, first.offset + at, &mut materials)?;
            at += materials.len() as u64;
            let materials = materials.chunks_exact(2);
            for (triangle, material) in triangles.chunks_exact(TRIANGLE).zip(materials) {
                let material = u16::from_le_bytes([material[0], material[1]]);
                for corner in triangle[1..].chunks_exact(4) {
                    let corner = u32::from_le_bytes(corner.try_into().unwrap_or_default());
                    let place = (corner as usize).checked_sub(begin);
                    match place.and_then(|place| of.get_mut(place)) {
                        Some(now) if *now == NO_MATERIAL => *now = material,
                        _ => {}
                    }
                }
            }
            Ok(())
        })
    }

    /// An error for a corner that is no vertex.
    pub fn no_vertex(&self, place: String, found: String) -> Error {
        self.mesh.error(place, found, "the number of a vertex")
    }
}
