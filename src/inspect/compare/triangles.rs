//! Triangles of a mesh as pages in curve order, and the choice of its vertices: shared by both readers of
//! meshes.

use super::Options;
use super::pages::{PageWriter, Pages};
use super::shape::{Items, Kind, Shape, side, unusable, usable};
use oorandom::Rand64;
use outcrop_codecs::ply_mesh::PlyMesh;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{LocalTable, Row, Sorter, row};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::{Box3, V3, add, cross, dot, scale, sub};
use std::path::Path;

row! {
    /// A triangle with the key of its centroid; rows sort by key.
    pub(super) struct KeyedTriangle {
        /// The key on the curve.
        key: [u32; 3],
        /// The bits of nine `f64`: three corners.
        corners: [u32; 18],
    }
    unpacked
}

/// Chosen vertices written at a time.
const BLOCK: usize = 4096;

/// A sorter with its memory: while a buffer grows, the old and the new one exist.
pub(super) fn sorter<R: Row>(
    workspace: &Workspace,
    name: &str,
    buffer: u64,
) -> Result<(Sorter<R>, Reservation)> {
    let held = workspace.reserve("compare: sort buffers", buffer + buffer / 2)?;
    Ok((Sorter::new(workspace, name, buffer), held))
}

/// Area of a triangle.
pub(super) fn area([a, b, c]: &[V3; 3]) -> f64 {
    let normal = cross(sub(*b, *a), sub(*c, *a));
    dot(normal, normal).sqrt() / 2.0
}

/// A mesh that is being read, for both readers.
pub(super) struct Reading<'a> {
    pub(super) path: &'a Path,
    /// Begins the names of scratch files.
    pub(super) name: &'static str,
    pub(super) options: &'a Options,
    pub(super) workspace: &'a Workspace,
    /// See [`PageWriter::new`].
    pub(super) unit: Option<&'a Unit<'a>>,
    /// Number of vertices in the header.
    pub(super) vertices: u64,
    /// Number of faces in the header.
    pub(super) faces: u64,
    /// Box around the vertices read so far.
    pub(super) bounds: Box3,
}

impl<'a> Reading<'a> {
    /// A mesh of which nothing was read yet, and whose pages do not survive the attempt.
    pub(super) fn of(
        mesh: &PlyMesh,
        path: &'a Path,
        name: &'static str,
        options: &'a Options,
        workspace: &'a Workspace,
    ) -> Self {
        Self {
            path,
            name,
            options,
            workspace,
            unit: None,
            vertices: mesh.vertices(),
            faces: mesh.faces(),
            bounds: Box3::EMPTY,
        }
    }

    /// See [`sorter`]; `part` is the end of the name.
    pub(super) fn sorter<R: Row>(
        &self,
        part: &str,
        buffer: u64,
    ) -> Result<(Sorter<R>, Reservation)> {
        sorter(self.workspace, &format!("{}.{part}", self.name), buffer)
    }

    /// Counts vertices and extends the box.
    pub(super) fn see(&mut self, positions: &[V3]) -> Result<()> {
        let good = positions.iter().filter(|p| usable(**p));
        self.bounds = good.fold(self.bounds, |b, p| b.with(*p));
        self.advance(positions.len())
    }

    /// Reports progress.
    pub(super) fn advance(&self, count: usize) -> Result<()> {
        self.workspace.observer.advance(count as u64);
        self.workspace.check_cancel()
    }

    /// The error for a corner whose index is no vertex.
    pub(super) fn no_vertex(&self) -> Error {
        let expected = format!("vertices below {}", self.vertices);
        Error::input(self.path, "faces", "a corner that is no vertex", expected)
    }

    /// An error if distances from vertex `v` cannot be computed.
    pub(super) fn check(&self, v: u32, p: V3) -> Result<()> {
        if usable(p) {
            Ok(())
        } else {
            Err(unusable(self.path, &format!("vertex {v}"), p))
        }
    }

    /// A triangle with its key on the curve through the box.
    pub(super) fn keyed(&self, triangle: [V3; 3]) -> KeyedTriangle {
        let [a, b, c] = triangle;
        KeyedTriangle {
            key: self.bounds.key(scale(add(add(a, b), c), 1.0 / 3.0)),
            corners: bytemuck::cast(triangle),
        }
    }

    /// Writes the sorted triangles to pages; returns their area too.
    pub(super) fn pages(&self, sorter: Sorter<KeyedTriangle>) -> Result<(Pages<[V3; 3]>, f64)> {
        let (observer, workspace) = (&self.workspace.observer, self.workspace);
        observer.begin("order", "triangles", self.faces);
        let mut writer = PageWriter::new(workspace, self.name, self.faces, self.unit)?;
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

    /// The finished shape; `offer` gives its `used` vertices to the chooser.
    pub(super) fn shape(
        &self,
        (triangles, area): (Pages<[V3; 3]>, f64),
        used: u64,
        offer: impl FnOnce(&mut Chooser) -> Result<()>,
    ) -> Result<Shape> {
        let mut chooser = Chooser::new(self, used, area)?;
        offer(&mut chooser)?;
        let mut side = side(self.path, Kind::Mesh, triangles.bounds());
        (side.points, side.triangles, side.area) = (used, self.faces, area);
        Ok(Shape {
            name: self.name,
            side,
            items: Items::Mesh {
                triangles,
                vertices: chooser.finish()?,
            },
        })
    }
}

/// Chooses vertices with equal chances, in order of the file.
pub(super) struct Chooser {
    rng: Rand64,
    /// Number of vertices to come, and of those to choose.
    left: u64,
    wanted: u64,
    chosen: LocalTable<V3>,
    block: Vec<V3>,
}

impl Chooser {
    fn new(reading: &Reading<'_>, of: u64, area: f64) -> Result<Self> {
        let Options { samples, seed } = *reading.options;
        // Half of the samples, but all if there is no surface for the others.
        let most = if area > 0.0 {
            samples.div_ceil(2)
        } else {
            samples
        };
        let name = format!("{}.vertices", reading.name);
        Ok(Self {
            rng: Rand64::new(seed.into()),
            left: of,
            wanted: of.min(most),
            chosen: LocalTable::create(reading.workspace, &name)?,
            block: Vec::with_capacity(BLOCK),
        })
    }

    pub(super) fn offer(&mut self, p: V3) -> Result<()> {
        // Chooses exactly the wanted number (Knuth, algorithm S).
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

    fn finish(self) -> Result<LocalTable<V3>> {
        if !self.block.is_empty() {
            self.chosen.append(&self.block)?;
        }
        Ok(self.chosen)
    }
}
