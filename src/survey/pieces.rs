//! A mesh as triangles with the positions of their corners, piece by piece, on all threads.
//!
//! Triangles come in the order of the file. The vertices stay in memory if they fit a quarter of what is free.
//! Otherwise each piece reads those that it needs, in runs: few, in meshes whose triangles have vertices with
//! numbers near each other, such as all that the program writes.

use outcrop_codecs::ply_mesh::{AnyPlace, PlyMesh};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_geom::vector::{Box3, V3, sub};
use outcrop_ply::Scalar;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Triangles of a piece: few enough that all its buffers stay near the processor, many enough that runs of
/// vertices are long.
const PIECE: usize = 1 << 15;

/// Vertices read at a time.
const SLICE: usize = 1 << 16;

/// Vertices between two that are needed, up to which both are read at once: reading them takes less than a
/// second request.
const GAP: u32 = 64;

/// Largest coordinate: no product of three lengths overflows.
const LARGEST: f64 = 1e70;

type InPlace = Box<dyn Fn(V3) -> V3 + Send + Sync>;

/// Values of the wanted columns at a vertex, at most four, as bytes.
pub(crate) type Marks = [u8; 4];

/// All vertices: positions, values of wanted columns if there are any, and their reservation.
type Held = (Vec<V3>, Vec<Marks>, Reservation);

/// A column, and the factor that makes its values bytes.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    column: usize,
    factor: f64,
}

/// A mesh that can be read at any place.
pub(crate) struct Surface {
    path: PathBuf,
    /// It keeps the file of a compressed mesh.
    _mesh: PlyMesh,
    fixed: AnyPlace,
    /// To the coordinates of the cloud, if the mesh has an origin of its own.
    place: Option<InPlace>,
    vertices: u64,
    faces: u64,
    /// The columns whose values are read.
    wanted: Vec<Wanted>,
    /// Box around all vertices with usable coordinates.
    bounds: Box3,
    /// All vertices, if they fit.
    held: Option<Held>,
}

/// Vertices as they are read: bytes of the file, positions, and values of wanted columns if there are any.
#[derive(Default)]
struct Run {
    bytes: Vec<u8>,
    positions: Vec<V3>,
    marks: Vec<Marks>,
}

/// A piece of a mesh.
#[derive(Default)]
pub(crate) struct Piece {
    /// Numbers of the corners.
    pub corners: Vec<[u32; 3]>,
    /// Positions of the corners, from the origin on.
    pub triangles: Vec<[V3; 3]>,
    /// Values of wanted columns at the corners; none if no column is wanted.
    pub marks: Vec<[Marks; 3]>,
    /// Corners by vertex: number, and place in the piece.
    order: Vec<u64>,
    run: Run,
}

/// How all triangles are read.
pub(crate) struct Pass {
    /// What the progress calls it.
    pub step: &'static str,
    /// The name of its reservations.
    pub name: &'static str,
    /// From where on positions are; none if they are not read.
    pub origin: Option<V3>,
    /// Bytes that the work on a piece takes beside it.
    pub more: u64,
}

impl Surface {
    /// Opens a mesh and reads its vertices.
    pub fn open(path: &Path, workspace: &Workspace) -> Result<Self> {
        Self::wanting(path, &[], workspace)
    }

    /// The same, with the values of columns of these names, at most four. Colours become bytes as in pictures.
    pub fn wanting(path: &Path, names: &[&str], workspace: &Workspace) -> Result<Self> {
        let mesh = PlyMesh::open_any(path, workspace)?;
        let refuse = |found: &str| Error::input(path, "mesh", found, "triangles");
        if mesh.faces() == 0 || mesh.vertices() == 0 {
            return Err(refuse("no face"));
        }
        let fixed = mesh.fixed()?.ok_or_else(|| refuse("other faces"))?;
        let wanted = names.iter().map(|name| wanted(&mesh, path, name));
        let wanted = wanted.collect::<Result<_>>()?;
        let place = mesh.origin().is_some();
        let place = place.then(|| Box::new(mesh.place()) as InPlace);
        let mut surface = Self {
            path: path.to_path_buf(),
            vertices: mesh.vertices(),
            faces: mesh.faces(),
            _mesh: mesh,
            fixed,
            place,
            wanted,
            bounds: Box3::EMPTY,
            held: None,
        };
        surface.read_vertices(workspace)?;
        if surface.bounds.min[0] > surface.bounds.max[0] {
            return Err(surface.unusable(0, surface.position(0)?));
        }
        Ok(surface)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    pub fn faces(&self) -> u64 {
        self.faces
    }

    pub fn bounds(&self) -> Box3 {
        self.bounds
    }

    /// Reads all vertices: their box, and their positions and values if they fit.
    fn read_vertices(&mut self, workspace: &Workspace) -> Result<()> {
        let with_marks = !self.wanted.is_empty();
        let each = size_of::<V3>() + usize::from(with_marks) * size_of::<Marks>();
        let all = self.vertices * each as u64;
        let is_small = all <= workspace.memory.available() / 4;
        let held = is_small.then(|| workspace.reserve("volume: vertices", all));
        let held = held.transpose()?;
        let count = held.as_ref().map_or(0, |_| self.vertices as usize);
        let mut kept = vec![[0.0; 3]; count];
        let mut marks = vec![Marks::default(); if with_marks { count } else { 0 }];
        let units = self.vertices.div_ceil(SLICE as u64) as usize;
        let targets: Vec<_> = kept.chunks_mut(SLICE).map(Mutex::new).collect();
        let mark_targets: Vec<_> = marks.chunks_mut(SLICE).map(Mutex::new).collect();
        let bounds = Mutex::new(Box3::EMPTY);
        let size = (SLICE * (each + self.fixed.entries()[0])) as u64;
        workspace
            .observer
            .begin("read vertices", "vertices", self.vertices);
        workspace.for_each_unit(
            "volume: slices of vertices",
            units,
            |_| size,
            |unit| {
                let _held = unit.hold(size);
                let first = (unit.number() * SLICE) as u64;
                let count = (self.vertices - first).min(SLICE as u64) as usize;
                let mut run = Run::default();
                self.run((first, count), &mut run)?;
                let good = run.positions.iter().filter(|p| usable(**p));
                let found = good.fold(Box3::EMPTY, |b, p| b.with(*p));
                let mut bounds = lock(&bounds);
                *bounds = bounds.union(found);
                if let Some(target) = targets.get(unit.number()) {
                    lock(target).copy_from_slice(&run.positions);
                }
                if let Some(target) = mark_targets.get(unit.number()) {
                    lock(target).copy_from_slice(&run.marks);
                }
                unit.advance(count as u64);
                Ok(())
            },
        )?;
        workspace.observer.end();
        drop((targets, mark_targets));
        self.bounds = *lock(&bounds);
        self.held = held.map(|held| (kept, marks, held));
        Ok(())
    }

    /// Replaces `run` by some vertices.
    fn run(&self, range: (u64, usize), run: &mut Run) -> Result<()> {
        run.positions.clear();
        self.fixed
            .positions(range, &mut run.bytes, &mut run.positions)?;
        if let Some(place) = &self.place {
            run.positions.iter_mut().for_each(|p| *p = place(*p));
        }
        run.marks.clear();
        if self.wanted.is_empty() {
            return Ok(());
        }
        run.marks.resize(range.1, Marks::default());
        for (k, wanted) in self.wanted.iter().enumerate() {
            let values = self.fixed.values(&run.bytes, wanted.column);
            for (marks, value) in run.marks.iter_mut().zip(values) {
                // The cast takes what is below 0 to 0, and what is above 255 to 255.
                marks[k] = (value * wanted.factor).round() as u8;
            }
        }
        Ok(())
    }

    /// The position of a vertex.
    pub fn position(&self, vertex: u32) -> Result<V3> {
        let mut run = Run::default();
        self.run((vertex.into(), 1), &mut run)?;
        Ok(run.positions[0])
    }

    /// Bytes of the buffers of a piece.
    fn piece_bytes(&self) -> u64 {
        let [vertex, face] = self.fixed.entries();
        let marks = usize::from(!self.wanted.is_empty()) * size_of::<Marks>();
        let own = size_of::<[u32; 3]>() + size_of::<[V3; 3]>() + 3 * marks;
        // At most three vertices for each triangle, most of them read in one run, with gaps.
        let read = 3 * (size_of::<u64>() + size_of::<V3>() + marks + vertex);
        let read = if self.held.is_some() { 0 } else { 2 * read };
        (PIECE * (own + face + read)) as u64
    }

    /// Calls `work` with each piece, on all threads.
    pub fn for_each_piece(
        &self,
        Pass {
            step,
            name,
            origin,
            more,
        }: Pass,
        workspace: &Workspace,
        work: impl Fn(&Unit<'_>, &Piece) -> Result<()> + Sync,
    ) -> Result<()> {
        let size = self.piece_bytes() + more;
        let spare = Mutex::new(Vec::<Piece>::new());
        let units = self.faces.div_ceil(PIECE as u64) as usize;
        workspace.observer.begin(step, "triangles", self.faces);
        workspace.for_each_unit(
            name,
            units,
            |_| size,
            |unit| {
                let _held = unit.hold(size);
                let mut piece = lock(&spare).pop().unwrap_or_default();
                self.read_piece(unit.number(), origin, &mut piece)?;
                work(unit, &piece)?;
                unit.advance(piece.corners.len() as u64);
                lock(&spare).push(piece);
                Ok(())
            },
        )?;
        workspace.observer.end();
        Ok(())
    }

    fn read_piece(&self, number: usize, origin: Option<V3>, piece: &mut Piece) -> Result<()> {
        let first = (number * PIECE) as u64;
        let count = (self.faces - first).min(PIECE as u64) as usize;
        piece.corners.clear();
        self.fixed
            .triangles((first, count), &mut piece.run.bytes, &mut piece.corners)?;
        let largest = piece.corners.as_flattened().iter().max();
        if largest.is_some_and(|vertex| u64::from(*vertex) >= self.vertices) {
            let expected = format!("vertices below {}", self.vertices);
            let found = "a corner that is no vertex";
            return Err(Error::input(&self.path, "faces", found, expected));
        }
        piece.triangles.clear();
        piece.marks.clear();
        let Some(origin) = origin else {
            return Ok(());
        };
        match &self.held {
            Some((all, marks, _)) => {
                let at = |vertex: u32| sub(all[vertex as usize], origin);
                let corners = piece.corners.iter();
                piece.triangles.extend(corners.clone().map(|t| t.map(at)));
                if !marks.is_empty() {
                    let marked = corners.map(|t| t.map(|vertex| marks[vertex as usize]));
                    piece.marks.extend(marked);
                }
            }
            None => self.fetch(origin, piece)?,
        }
        self.check(piece)
    }

    /// Reads the vertices of a piece.
    fn fetch(&self, origin: V3, piece: &mut Piece) -> Result<()> {
        piece.triangles.resize(piece.corners.len(), [[0.0; 3]; 3]);
        if !self.wanted.is_empty() {
            let none = [Marks::default(); 3];
            piece.marks.resize(piece.corners.len(), none);
        }
        let corners = piece.corners.as_flattened().iter().zip(0u64..);
        piece.order.clear();
        piece
            .order
            .extend(corners.map(|(vertex, place)| u64::from(*vertex) << 32 | place));
        piece.order.sort_unstable();
        let vertex = |entry: u64| (entry >> 32) as u32;
        let targets = piece.triangles.as_flattened_mut();
        let marks = piece.marks.as_flattened_mut();
        let near = |a: &u64, b: &u64| vertex(*b) - vertex(*a) <= GAP;
        for chunk in piece.order.chunk_by(near) {
            let first = vertex(chunk[0]);
            for part in chunk.chunk_by(|a, b| {
                (vertex(*a) - first) as usize / SLICE == (vertex(*b) - first) as usize / SLICE
            }) {
                let (low, high) = (vertex(part[0]), vertex(part[part.len() - 1]));
                let range = (u64::from(low), (high - low) as usize + 1);
                self.run(range, &mut piece.run)?;
                for entry in part {
                    let (at, place) = ((vertex(*entry) - low) as usize, *entry as u32 as usize);
                    targets[place] = sub(piece.run.positions[at], origin);
                    if let Some(target) = marks.get_mut(place) {
                        *target = piece.run.marks[at];
                    }
                }
            }
        }
        Ok(())
    }

    /// An error for corners without usable coordinates.
    fn check(&self, piece: &Piece) -> Result<()> {
        let corners = piece.triangles.as_flattened();
        let Some(bad) = corners.iter().position(|p| !usable(*p)) else {
            return Ok(());
        };
        let vertex = piece.corners.as_flattened()[bad];
        Err(self.unusable(vertex, self.position(vertex)?))
    }

    fn unusable(&self, vertex: u32, [x, y, z]: V3) -> Error {
        let found = format!("a position {x} {y} {z}");
        let expected = format!("coordinates up to {LARGEST:e}");
        Error::input(&self.path, format!("vertex {vertex}"), found, expected)
    }
}

/// The column of this name.
fn wanted(mesh: &PlyMesh, path: &Path, name: &str) -> Result<Wanted> {
    let columns = mesh.columns();
    let found = columns.iter().find(|(_, own, _)| *own == name);
    let Some((column, _, scalar)) = found else {
        let expected = format!("one, as of a mesh made with --attributes {name}");
        return Err(Error::input(
            path,
            "columns",
            format!("no {name}"),
            expected,
        ));
    };
    let is_colour = ["red", "green", "blue"].contains(&name);
    let factor = match scalar {
        Scalar::U16 if is_colour => 1.0 / 257.0,
        Scalar::F32 | Scalar::F64 if is_colour => 255.0,
        _ => 1.0,
    };
    let column = *column;
    Ok(Wanted { column, factor })
}

/// True if volumes can be computed from this position.
fn usable(p: V3) -> bool {
    p.iter().all(|c| c.abs() <= LARGEST)
}
