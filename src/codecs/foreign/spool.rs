//! Vertices and triangles as they come, and the PLY file that they become.

use super::Mesh;
use super::stream::{CHUNK, Stream};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_ply::{Encoding, Layout, NO_VERTEX, Scalar, TRIANGLE, put_triangle};
use std::path::PathBuf;

/// Bytes of a position on the way; the values of the vertex follow it.
const POSITION: usize = 3 * 8;

/// The material of a vertex that no triangle has, or of a triangle without one.
pub(super) const NO_MATERIAL: u16 = u16::MAX;

/// Colour of what has none in a mesh that has colours.
const WHITE: [u8; 3] = [255; 3];

/// The names of colours in PLY.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

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
    /// Material of each triangle up to the last one that has any.
    materials: Stream,
    material_count: u64,
    /// The colour of each material, if it has one.
    pub palette: Vec<Option<[u8; 3]>>,
    /// Coordinates are written as 32-bit floats.
    pub floats: bool,
    /// Comments of the file that is written.
    pub comments: Vec<String>,
    /// Names and types of the values of vertices: colours, unless a format has others. They are set before the
    /// first vertex.
    pub columns: Vec<(String, Scalar)>,
    has_values: bool,
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
            material_count: 0,
            palette: Vec::new(),
            floats: false,
            comments: Vec::new(),
            columns: COLOURS.map(|name| (name.to_owned(), Scalar::U8)).into(),
            has_values: false,
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
        self.has_values |= colour.is_some();
        self.put_vertex(position, &colour.unwrap_or(WHITE))
    }

    /// Takes the next vertex, with the values of the columns.
    pub fn vertex_with(&mut self, position: [f64; 3], values: &[u8]) -> Result<()> {
        self.has_values = true;
        self.put_vertex(position, values)
    }

    fn put_vertex(&mut self, position: [f64; 3], values: &[u8]) -> Result<()> {
        self.vertex_count += 1;
        if self.vertex_count > u64::from(NO_VERTEX) {
            let found = format!("more than {NO_VERTEX}");
            let expected = format!("at most {NO_VERTEX}, which 32-bit numbers can name");
            return Err(self.mesh.error("vertices", found, &expected));
        }
        for x in position {
            self.vertices.push(&x.to_le_bytes())?;
        }
        self.vertices.push(values)
    }

    /// Bytes of a vertex on the way.
    fn vertex_bytes(&self) -> usize {
        let values = self.columns.iter().map(|(_, scalar)| scalar.bytes());
        POSITION + values.sum::<usize>()
    }

    /// Takes the next face, which is divided into triangles from its first corner.
    pub fn face(&mut self, corners: &[u32], material: u16) -> Result<()> {
        self.count(corners.len() as u64);
        for pair in corners.windows(2).skip(1) {
            self.triangle([corners[0], pair[0], pair[1]], material)?;
        }
        Ok(())
    }

    /// Takes note of a face with this number of corners.
    pub fn count(&mut self, corners: u64) {
        match corners {
            0..3 => self.lines += 1,
            3 => {}
            _ => self.polygons += 1,
        }
    }

    /// Takes the next triangle.
    pub fn triangle(&mut self, corners: [u32; 3], material: u16) -> Result<()> {
        let mut bytes = Vec::with_capacity(TRIANGLE);
        put_triangle(corners, &mut bytes);
        self.triangles.push(&bytes)?;
        if material != NO_MATERIAL {
            while self.material_count < self.triangle_count {
                self.materials.push(&NO_MATERIAL.to_le_bytes())?;
                self.material_count += 1;
            }
            self.materials.push(&material.to_le_bytes())?;
            self.material_count += 1;
        }
        self.triangle_count += 1;
        Ok(())
    }

    /// Refuses a file without a mesh.
    pub fn check_content(&self) -> Result<()> {
        let (vertices, triangles) = (self.vertex_count, self.triangle_count);
        if vertices > 0 && triangles > 0 {
            return Ok(());
        }
        let found = format!("{vertices} vertices and {triangles} triangles");
        Err(self.mesh.error("content", found, "a mesh"))
    }

    /// Writes the PLY file, and says what of the mesh is not in it.
    pub fn finish(mut self) -> Result<PathBuf> {
        [&mut self.vertices, &mut self.triangles, &mut self.materials]
            .into_iter()
            .try_for_each(Stream::flush)?;
        self.tell();
        let is_painted = !self.has_values && self.palette.iter().any(Option::is_some);
        let workspace = self.mesh.workspace;
        let mut out = Stream::new(self.name.clone(), workspace)?;
        out.push(self.header(is_painted).as_bytes())?;
        match is_painted {
            true => self.paint(&mut out)?,
            false => self.write_vertices(&mut out)?,
        }
        self.vertices.release()?;
        self.materials.release()?;
        self.triangles
            .read(TRIANGLE, workspace, |bytes| out.push(bytes))?;
        self.triangles.release()?;
        out.finish()
    }

    fn header(&self, is_painted: bool) -> String {
        let columns = self.columns.iter().map(|(name, scalar)| (&**name, *scalar));
        let columns = columns.filter(|_| self.has_values || is_painted);
        let comments = self.comments.iter().map(|comment| &**comment);
        let layout = Layout {
            encoding: Encoding::Little,
            comments: &comments.collect::<Vec<_>>(),
            vertices: self.vertex_count,
            coordinates: match self.floats {
                true => Scalar::F32,
                false => Scalar::F64,
            },
            columns: &columns.collect::<Vec<_>>(),
            triangles: Some((self.triangle_count, Scalar::U32)),
        };
        layout.header()
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
        let (position, values) = vertex.split_at(POSITION);
        match self.floats {
            true => {
                for x in position.as_chunks().0 {
                    bytes.extend((f64::from_le_bytes(*x) as f32).to_le_bytes());
                }
            }
            false => bytes.extend_from_slice(position),
        }
        match colour {
            Some(colour) => bytes.extend(colour),
            None if self.has_values => bytes.extend_from_slice(values),
            None => {}
        }
    }

    fn write_vertices(&self, out: &mut Stream) -> Result<()> {
        let (size, mut one) = (self.vertex_bytes(), Vec::new());
        self.vertices.read(size, self.mesh.workspace, |vertices| {
            vertices.chunks_exact(size).try_for_each(|vertex| {
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
        let (size, mut one) = (self.vertex_bytes(), Vec::new());
        self.vertices.read(size, workspace, |vertices| {
            vertices.chunks_exact(size).try_for_each(|vertex| {
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
        let (mut at, mut materials) = (0, Vec::new());
        self.triangles.read(TRIANGLE, workspace, |triangles| {
            let count = triangles.len() / TRIANGLE;
            self.materials.read_at(at, &mut materials, 2 * count)?;
            at += 2 * count as u64;
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
