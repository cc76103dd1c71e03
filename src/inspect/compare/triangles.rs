//! Triangles of a mesh as pages in curve order, and the choice of its vertices: shared by both readers of
//! meshes.

use super::pages::{PageWriter, Pages};
use super::shape::{Choice, Items, Kind, Shape, side};
use super::vector::{Box3, V3, add, cross, dot, scale, sub};
use crate::error::{Error, Result};
use crate::spill::{Row, Sorter, Table, row};
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use oorandom::Rand64;
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
pub(super) const BLOCK: usize = 4096;

/// A sorter with its memory: while a buffer grows, the old and the new one exist.
pub(super) fn sorter<R: Row>(
    workspace: &Workspace,
    name: &str,
    buffer: u64,
) -> Result<(Sorter<R>, Reservation)> {
    let held = workspace.reserve("compare: sort buffers", buffer + buffer / 2)?;
    Ok((Sorter::new(workspace, name, buffer), held))
}

/// The error for faces that do not have three corners.
pub(super) fn not_triangles(path: &Path, count: u64) -> Error {
    let found = format!("{count} that are not triangles");
    Error::input(path, "faces", found, "triangles; split them first")
}

/// The error for a corner whose index is no vertex.
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

/// Writes the sorted triangles to pages; returns their area too.
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

/// Chooses vertices with equal chances, in order of the file.
pub(super) struct Chooser {
    rng: Rand64,
    /// Number of vertices to come, and of those to choose.
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
        // Half of the samples, but all if there is no surface for the others.
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
