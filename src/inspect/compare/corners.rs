//! A mesh whose vertices do not fit into memory: corners are sorted to their vertices, take the
//! position with them, and are sorted back to their triangles.

use super::mesh::{Chooser, keyed, no_vertex, not_triangles, pages, shape, sorter};
use super::shape::{Choice, Shape, unusable, usable};
use super::vector::{Box3, V3};
use crate::error::Result;
use crate::inspect::ply_mesh::Sink;
use crate::spill::{Record, Sections, Sorted, Sorter};
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use std::path::Path;

/// Vertices of a section of positions.
const SECTION: usize = 1 << 14;

/// Vertex, and number of the corner (three times the triangle's number, and 0 to 2) in two words.
type Corner = Record<3>;

/// Number of the corner in two words, position.
type Placed = Record<8>;

/// Reads a mesh of any size, its elements in any order.
pub(super) struct Joined<'a> {
    path: &'a Path,
    name: &'a str,
    workspace: &'a Workspace,
    sorter: Sorter<3>,
    held: Reservation,
    positions: Sections<6>,
    pending: Vec<Record<6>>,
    bounds: Box3,
    vertices: u64,
    corners: u64,
    batch: Vec<Corner>,
}

impl<'a> Joined<'a> {
    pub(super) fn new(
        path: &'a Path,
        name: &'a str,
        vertices: u64,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let buffer = workspace.memory.available() / 5;
        let (sorter, held) = sorter(workspace, &format!("{name}.corners"), buffer)?;
        Ok(Self {
            path,
            name,
            workspace,
            sorter,
            held,
            positions: Sections::unpacked(workspace, &format!("{name}.positions"), 0)?,
            pending: Vec::with_capacity(SECTION),
            bounds: Box3::EMPTY,
            vertices,
            corners: 0,
            batch: Vec::new(),
        })
    }

    pub(super) fn finish(self, faces: u64, choice: Choice) -> Result<Shape> {
        let Self {
            path,
            name,
            workspace,
            ..
        } = self;
        if !self.pending.is_empty() {
            self.positions.append(&self.pending)?;
        }
        let sections = self.positions.count() as u64;
        let index = workspace.reserve("compare: positions", 64 * sections + (1 << 20))?;
        let corners = Corners::new(self.sorter.finish(workspace)?);

        workspace.observer.begin("corners", "corners", self.corners);
        let buffer = workspace.memory.available() / 4;
        let (placed, placed_held) = sorter::<8>(workspace, &format!("{name}.placed"), buffer)?;
        let mut used = 0u64;
        let mut last = None;
        let mut window = Window::new(&self.positions);
        corners.for_each(|[v, high, low]| {
            let p = window.get(v)?;
            let words: Record<6> = bytemuck::cast(p);
            if last != Some(v) {
                if !usable(p) {
                    return Err(unusable(path, &format!("vertex {v}"), p));
                }
                workspace.check_cancel()?;
                last = Some(v);
                used += 1;
            }
            let [a, b, c, d, e, f] = words;
            workspace.observer.advance(1);
            placed.push(&[[high, low, a, b, c, d, e, f]])
        })?;
        workspace.observer.end();

        let buffer = workspace.memory.available() / 2;
        let (keys, keys_held) = sorter(workspace, &format!("{name}.order"), buffer)?;
        let mut triangle = [[0.0; 3]; 3];
        placed.finish(workspace)?.for_each(|record: Placed| {
            let [_, low, words @ ..] = record;
            let number = u64::from(record[0]) << 32 | u64::from(low);
            let corner = (number % 3) as usize;
            triangle[corner] = bytemuck::cast(words);
            if corner == 2 {
                keys.push(&[keyed(triangle, &self.bounds)])?;
            }
            Ok(())
        })?;
        drop(placed_held);
        let triangles = pages(keys, name, faces, workspace)?;
        drop(keys_held);

        let mut chooser = Chooser::new(workspace, name, used, triangles.1, choice)?;
        let mut last = None;
        let mut window = Window::new(&self.positions);
        corners.for_each(|[v, ..]| {
            if last != Some(v) {
                last = Some(v);
                chooser.offer(window.get(v)?)?;
            }
            Ok(())
        })?;
        drop((self.held, index));
        Ok(shape(path, triangles, [used, faces], chooser.finish()?))
    }
}

impl Sink for Joined<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        self.workspace.check_cancel()?;
        let good = positions.iter().filter(|p| usable(**p));
        self.bounds = good.fold(self.bounds, |b, p| b.with(*p));
        for p in positions {
            self.pending.push(bytemuck::cast(*p));
            if self.pending.len() == SECTION {
                self.positions.append(&self.pending)?;
                self.pending.clear();
            }
        }
        self.workspace.observer.advance(positions.len() as u64);
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        self.batch.clear();
        for &v in triangles.iter().flatten() {
            if u64::from(v) >= self.vertices {
                return Err(no_vertex(self.path, self.vertices));
            }
            let number = self.corners;
            self.batch.push([v, (number >> 32) as u32, number as u32]);
            self.corners += 1;
        }
        self.sorter.push(&self.batch)?;
        self.workspace.observer.advance(triangles.len() as u64);
        Ok(())
    }

    fn non_triangles(&mut self, count: u64) -> Result<()> {
        Err(not_triangles(self.path, count))
    }
}

/// All corners by vertex; can be gone through more than once.
enum Corners {
    Memory(Vec<Corner>),
    Disk(Sorted<3>),
}

impl Corners {
    fn new(sorted: Sorted<3>) -> Self {
        match sorted.in_memory() {
            Ok(all) => Self::Memory(all),
            Err(sorted) => Self::Disk(sorted),
        }
    }

    fn for_each(&self, mut each: impl FnMut(Corner) -> Result<()>) -> Result<()> {
        match self {
            Self::Memory(all) => all.iter().try_for_each(|c| each(*c)),
            Self::Disk(sorted) => sorted.for_range(None, None, each),
        }
    }
}

/// Positions of ascending vertices.
struct Window<'a> {
    positions: &'a Sections<6>,
    section: usize,
    records: Vec<Record<6>>,
}

impl<'a> Window<'a> {
    fn new(positions: &'a Sections<6>) -> Self {
        Self {
            positions,
            section: usize::MAX,
            records: Vec::new(),
        }
    }

    fn get(&mut self, v: u32) -> Result<V3> {
        let section = v as usize / SECTION;
        if section != self.section {
            self.positions.get_into(section, &mut self.records)?;
            self.section = section;
        }
        Ok(bytemuck::cast(self.records[v as usize % SECTION]))
    }
}
