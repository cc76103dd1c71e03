//! A mesh as pages of triangles in curve order, and a choice of its vertices.
//!
//! The vertices stay in memory while triangles look up their corners, if a quarter of the free memory
//! holds them. Else corners are sorted to their vertices and back to their triangles, on disk.
//! Both ways give the same pages and the same choice.

use super::corners::Joined;
use super::pages::{PageWriter, Pages};
use super::shape::{Choice, Items, Kind, Shape, side, unusable, usable};
use super::vector::{Box3, V3, add, cross, dot, scale, sub};
use crate::error::{Error, Result};
use crate::inspect::ply_mesh::{PlyMesh, Sink};
use crate::spill::{Row, Sorter, Table, row};
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use oorandom::Rand64;
use std::path::Path;

row! {
    /// A triangle with the key of its centroid; sorts by key.
    pub(super) struct KeyedTriangle {
        /// The key on the curve.
        key: [u32; 3],
        /// The bits of nine `f64`: three corners.
        corners: [u32; 18],
    }
    unpacked
}

/// Bytes of a vertex in memory, with its bit.
const VERTEX: u64 = 25;

/// Chosen vertices written at a time.
pub(super) const BLOCK: usize = 4096;

/// A sorter with its memory: growing a buffer holds the old and the new one for a moment.
pub(super) fn sorter<R: Row>(
    workspace: &Workspace,
    name: &str,
    buffer: u64,
) -> Result<(Sorter<R>, Reservation)> {
    let held = workspace.reserve("compare: sort buffers", buffer + buffer / 2)?;
    Ok((Sorter::new(workspace, name, buffer), held))
}

/// Reads a mesh.
pub(super) fn read(
    mesh: PlyMesh,
    path: &Path,
    name: &str,
    choice: Choice,
    workspace: &Workspace,
) -> Result<Shape> {
    let (vertices, faces) = (mesh.vertices(), mesh.faces());
    let total = vertices + faces;
    let observer = &workspace.observer;
    let free = workspace.memory.available();
    let small = vertices * VERTEX <= free / 4 && mesh.vertices_first();
    observer.begin("read mesh", "vertices and faces", total);
    if small {
        let _held = workspace.reserve("compare: vertices", vertices * VERTEX)?;
        let mut direct = Direct::new(path, name, vertices, faces, workspace)?;
        mesh.read(&mut direct)?;
        observer.end();
        direct.finish(choice)
    } else {
        let mut joined = Joined::new(path, name, vertices, workspace)?;
        mesh.read(&mut joined)?;
        observer.end();
        joined.finish(faces, choice)
    }
}

/// The error for faces that have not three corners.
pub(super) fn not_triangles(path: &Path, count: u64) -> Error {
    let found = format!("{count} that are not triangles");
    Error::input(path, "faces", found, "triangles; split them first")
}

/// The error for a corner that is no vertex.
pub(super) fn no_vertex(path: &Path, vertices: u64) -> Error {
    let expected = format!("vertices below {vertices}");
    Error::input(path, "faces", "a corner that is no vertex", expected)
}

/// A triangle with its key on the curve through `bounds`.
pub(super) fn keyed(triangle: [V3; 3], bounds: &Box3) -> KeyedTriangle {
    let [a, b, c] = triangle;
    KeyedTriangle {
        key: bounds.key(scale(add(add(a, b), c), 1.0 / 3.0)),
        corners: bytemuck::cast(triangle),
    }
}

/// Area of a triangle.
pub(super) fn area([a, b, c]: &[V3; 3]) -> f64 {
    let normal = cross(sub(*b, *a), sub(*c, *a));
    dot(normal, normal).sqrt() / 2.0
}

/// The sorted triangles in pages, and their area.
pub(super) fn pages(
    sorter: Sorter<KeyedTriangle>,
    name: &str,
    count: u64,
    workspace: &Workspace,
) -> Result<(Pages<[V3; 3]>, f64)> {
    let observer = &workspace.observer;
    observer.begin("order", "triangles", count);
    let mut writer = PageWriter::new(workspace, name, count)?;
    let mut all = 0.0;
    let mut ticks = 0u64;
    sorter.finish(workspace)?.for_each(|keyed| {
        let triangle = bytemuck::cast(keyed.corners);
        all += area(&triangle);
        ticks += 1;
        if ticks.is_multiple_of(BLOCK as u64) {
            workspace.check_cancel()?;
            observer.advance(BLOCK as u64);
        }
        writer.push(triangle)
    })?;
    observer.end();
    Ok((writer.finish()?, all))
}

/// Chooses vertices, each with the same chance, as they come by in order of the file.
pub(super) struct Chooser {
    rng: Rand64,
    /// Still to be seen, still to be chosen.
    left: u64,
    wanted: u64,
    chosen: Table<V3>,
    block: Vec<V3>,
}

impl Chooser {
    pub(super) fn new(
        workspace: &Workspace,
        name: &str,
        of: u64,
        area: f64,
        choice: Choice,
    ) -> Result<Self> {
        // Half of the samples, but all if there is no surface to put the others on.
        let most = if area > 0.0 {
            choice.samples.div_ceil(2)
        } else {
            choice.samples
        };
        Ok(Self {
            rng: Rand64::new(u128::from(choice.seed)),
            left: of,
            wanted: of.min(most),
            chosen: Table::create(workspace, &format!("{name}.vertices"), 0)?,
            block: Vec::with_capacity(BLOCK),
        })
    }

    pub(super) fn offer(&mut self, p: V3) -> Result<()> {
        // Exactly as many as wanted are chosen (Knuth, algorithm S).
        if self.wanted > 0 && self.rng.rand_range(0..self.left) < self.wanted {
            self.wanted -= 1;
            self.block.push(p);
            if self.block.len() == BLOCK {
                self.chosen.append(&self.block)?;
                self.block.clear();
            }
        }
        self.left = self.left.saturating_sub(1).max(1);
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Table<V3>> {
        if !self.block.is_empty() {
            self.chosen.append(&self.block)?;
        }
        Ok(self.chosen)
    }
}

/// The finished shape.
pub(super) fn shape(
    path: &Path,
    triangles: (Pages<[V3; 3]>, f64),
    counts: [u64; 2],
    vertices: Table<V3>,
) -> Shape {
    let (triangles, area) = triangles;
    let mut side = side(path, Kind::Mesh, triangles.bounds());
    [side.points, side.triangles] = counts;
    side.area = area;
    Shape {
        side,
        items: Items::Mesh {
            triangles,
            vertices,
        },
    }
}

/// Reads a mesh whose vertices fit into memory and come before the faces.
struct Direct<'a> {
    path: &'a Path,
    name: &'a str,
    workspace: &'a Workspace,
    sorter: Sorter<KeyedTriangle>,
    _held: Reservation,
    bounds: Box3,
    expected: u64,
    vertices: Vec<V3>,
    referenced: Vec<u64>,
    triangles: u64,
    batch: Vec<KeyedTriangle>,
}

impl<'a> Direct<'a> {
    fn new(
        path: &'a Path,
        name: &'a str,
        vertices: u64,
        faces: u64,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let wanted = faces * size_of::<KeyedTriangle>() as u64;
        let buffer = wanted.min(workspace.memory.available() / 3) + (1 << 20);
        let (sorter, held) = sorter(workspace, &format!("{name}.order"), buffer)?;
        let mut all = Vec::new();
        all.reserve_exact(vertices as usize);
        Ok(Self {
            path,
            name,
            workspace,
            sorter,
            _held: held,
            bounds: Box3::EMPTY,
            expected: vertices,
            vertices: all,
            referenced: vec![0; vertices.div_ceil(64) as usize],
            triangles: 0,
            batch: Vec::new(),
        })
    }

    fn finish(self, choice: Choice) -> Result<Shape> {
        let Self {
            name,
            path,
            workspace,
            ..
        } = self;
        let triangles = pages(self.sorter, name, self.triangles, workspace)?;
        let used = self.referenced.iter().map(|w| u64::from(w.count_ones()));
        let used = used.sum();
        let mut chooser = Chooser::new(workspace, name, used, triangles.1, choice)?;
        for (v, p) in self.vertices.iter().enumerate() {
            if self.referenced[v / 64] >> (v % 64) & 1 == 1 {
                chooser.offer(*p)?;
            }
        }
        let counts = [used, self.triangles];
        Ok(shape(path, triangles, counts, chooser.finish()?))
    }
}

impl Sink for Direct<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        self.workspace.check_cancel()?;
        let good = positions.iter().filter(|p| usable(**p));
        self.bounds = good.fold(self.bounds, |b, p| b.with(*p));
        self.vertices.extend_from_slice(positions);
        self.workspace.observer.advance(positions.len() as u64);
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        self.batch.clear();
        for corners in triangles {
            let mut triangle = [[0.0; 3]; 3];
            for (at, &v) in triangle.iter_mut().zip(corners) {
                let Some(&p) = self.vertices.get(v as usize) else {
                    return Err(no_vertex(self.path, self.expected));
                };
                if !usable(p) {
                    return Err(unusable(self.path, &format!("vertex {v}"), p));
                }
                self.referenced[v as usize / 64] |= 1 << (v % 64);
                *at = p;
            }
            self.batch.push(keyed(triangle, &self.bounds));
        }
        self.triangles += triangles.len() as u64;
        self.sorter.push(&self.batch)?;
        self.workspace.observer.advance(triangles.len() as u64);
        Ok(())
    }

    fn non_triangles(&mut self, count: u64) -> Result<()> {
        Err(not_triangles(self.path, count))
    }
}
