//! A mesh as pages of triangles in curve order, and a choice of its vertices.
//!
//! The vertices stay in memory while the triangles obtain their positions, if they fit a quarter of the free
//! memory. Otherwise corners are sorted by vertex and back by triangle, on disk. Both ways give the same
//! pages and the same choice.

use super::corners::Joined;
use super::shape::{Choice, Shape, unusable, usable};
use super::triangles::{
    Chooser, KeyedTriangle, keyed, no_vertex, not_triangles, pages, shape, sorter,
};
use super::vector::{Box3, V3};
use crate::error::Result;
use crate::inspect::ply_mesh::{PlyMesh, Sink};
use crate::spill::Sorter;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use std::path::Path;

/// Bytes of a vertex in memory, with a bit for its use.
const VERTEX: u64 = 25;

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

/// Reads a mesh whose vertices fit into memory and precede the faces.
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
