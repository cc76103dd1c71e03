//! A surface as its vertices, each with its share of the triangles around it: in curve order, in pages on disk.

use super::patch::Point;
use crate::compare::pages::{Item, PageWriter, Pages, Searcher};
use crate::compare::shape::{Items, Shape, usable};
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Sorter, row};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_geom::vector::{Box3, V3, add, cross, dot, scale, sub};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::Mutex;

/// Vertices of a piece of the curve, which one thread measures.
pub(super) const PIECE: usize = 1 << 14;

/// Vertices in memory at a time while they are made.
const WAVE: usize = 1 << 16;

/// Most vertices of a group.
const TOGETHER: usize = 2048;

/// Largest side of the cell of a group, in radii, so that the surface around it, which is read too, is not much more
/// than what is in it.
const WIDEST: f64 = 12.0;

row! {
    /// A vertex with the key of its position; rows sort by key.
    pub(super) struct KeyedVertex {
        /// The key on the curve.
        key: [u32; 3],
        /// The bits of three `f64`, so that vertices at the same place follow each other.
        position: [u32; 6],
        /// Its number in the file.
        index: u32,
    }
    unpacked
}

/// Sends the vertices of a mesh to a sorter.
struct Vertices<'a> {
    sorter: &'a Sorter<KeyedVertex>,
    bounds: Box3,
    next: u32,
    rows: Vec<KeyedVertex>,
    workspace: &'a Workspace,
}

impl Sink for Vertices<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        self.rows.clear();
        for position in positions {
            // What is not finite is no corner of a triangle: those are checked.
            if usable(*position) {
                self.rows.push(KeyedVertex {
                    key: self.bounds.key(*position),
                    // 0 and -0 are one place.
                    position: bytemuck::cast(position.map(|c| c + 0.0)),
                    index: self.next,
                });
            }
            self.next = self.next.wrapping_add(1);
        }
        self.workspace.check_cancel()?;
        self.sorter.push(&self.rows)
    }

    fn triangles(&mut self, _: &[[u32; 3]]) -> Result<()> {
        Ok(())
    }
}

/// The vertices of a mesh, to be sorted along the curve.
fn vertices(shape: &Shape, workspace: &Workspace) -> Result<(Sorter<KeyedVertex>, Reservation)> {
    let mesh = PlyMesh::open_any(&shape.side.path, workspace)?;
    let bytes = mesh.vertices() * size_of::<KeyedVertex>() as u64;
    let buffer = bytes.min(workspace.memory.available() / 8) + (1 << 20);
    let held = workspace.reserve("change: sort buffers", buffer + buffer / 2)?;
    let sorter = Sorter::new(workspace, &format!("{}.vertices", shape.name), buffer);
    mesh.read_in_place(&mut Vertices {
        sorter: &sorter,
        bounds: shape.side.bounds(),
        next: 0,
        rows: Vec::new(),
        workspace,
    })?;
    Ok((sorter, held))
}

row! {
    /// A vertex with its share of the triangles around it.
    pub(super) struct Vertex {
        /// Its number in the file.
        index: u32,
        /// 1 if the vertex before it is at the same place.
        copy: u32,
        /// The bits of three `f64`.
        position: [u32; 6],
        /// The bits of [`Point::facing`].
        facing: [u32; 6],
        /// The bits of [`Point::weight`].
        weight: [u32; 2],
    }
    unpacked
}

impl Vertex {
    /// Its number in the file.
    pub fn number(&self) -> u32 {
        self.index
    }

    /// True if the vertex before it is at the same place.
    pub fn is_copy(&self) -> bool {
        self.copy != 0
    }

    pub fn position(&self) -> V3 {
        bytemuck::cast(self.position)
    }

    pub fn point(&self) -> Point {
        Point {
            position: self.position(),
            facing: bytemuck::cast(self.facing),
            weight: bytemuck::cast(self.weight),
        }
    }
}

impl Item for Vertex {
    #[inline]
    fn bounds(&self) -> Box3 {
        self.position().bounds()
    }

    fn distance2(&self, p: V3) -> f64 {
        let d = sub(self.position(), p);
        dot(d, d)
    }
}

/// The cells of a surface whose vertices are measured together. Such a cell is one piece of the curve.
pub(super) struct Cells {
    min: V3,
    side: f64,
}

impl Cells {
    pub fn of(bounds: &Box3, radius: f64) -> Self {
        let longest = (0..3).fold(0.0, |s: f64, i| s.max(bounds.max[i] - bounds.min[i]));
        let mut side = longest;
        while side > WIDEST * radius {
            side /= 2.0;
        }
        Self {
            min: bounds.min,
            side,
        }
    }

    fn cell(&self, p: V3) -> [i64; 3] {
        [0, 1, 2].map(|axis| ((p[axis] - self.min[axis]) / self.side) as i64)
    }

    /// Splits rows that follow each other on the curve.
    pub fn groups<'a, T>(&self, rows: &'a [T], position: impl Fn(&T) -> V3) -> Vec<&'a [T]> {
        let same = |a: &T, b: &T| self.cell(position(a)) == self.cell(position(b));
        let cells = rows.chunk_by(same);
        cells.flat_map(|cell| cell.chunks(TOGETHER)).collect()
    }
}

/// A surface that is measured.
pub(super) struct Surface<'a> {
    pub shape: &'a Shape,
    pub items: Points<'a>,
    pub cells: Cells,
}

/// Where its points are.
pub(super) enum Points<'a> {
    Mesh(Box<Pages<Vertex>>, &'a Pages<[V3; 3]>),
    Cloud(&'a Pages<V3>),
}

impl<'a> Surface<'a> {
    /// Finds the vertices of a mesh.
    pub fn of(shape: &'a Shape, radius: f64, workspace: &Workspace) -> Result<Self> {
        let cells = Cells::of(&shape.side.bounds(), radius);
        let items = match &shape.items {
            Items::Cloud(points) => Points::Cloud(points),
            Items::Mesh { triangles, .. } => {
                let name = format!("{}.points", shape.name);
                let points = Pages::once(workspace, &name, |unit| {
                    summed(shape, (triangles, &cells), &name, unit)
                })?;
                Points::Mesh(Box::new(points), triangles)
            }
        };
        Ok(Self {
            shape,
            items,
            cells,
        })
    }

    /// Bytes of a page of each kind.
    pub fn page_bytes(&self) -> u64 {
        match &self.items {
            Points::Mesh(points, triangles) => points.page_bytes() + triangles.page_bytes(),
            Points::Cloud(points) => points.page_bytes(),
        }
    }
}

/// The vertices of a mesh with their shares of the triangles, as pages.
fn summed(
    shape: &Shape,
    (triangles, cells): (&Pages<[V3; 3]>, &Cells),
    name: &str,
    unit: &Unit<'_>,
) -> Result<Pages<Vertex>> {
    let workspace: &Workspace = unit;
    let (sorter, held) = vertices(shape, workspace)?;
    let count = PlyMesh::open_any(&shape.side.path, workspace)?.vertices();
    let mut writer = PageWriter::new(workspace, name, count, Some(unit))?;
    let threads = workspace.threads as u64;
    let share = workspace.memory.available() / 8 / threads;
    let pages = (share / triangles.page_bytes()).clamp(1, 1 << 14);
    let wave = WAVE * (size_of::<KeyedVertex>() + size_of::<Vertex>());
    let group = TOGETHER * (2 * size_of::<([u64; 3], u32)>() + size_of::<Point>());
    let bytes = threads * (pages * triangles.page_bytes() + group as u64) + wave as u64;
    let _held = workspace.reserve("change: triangles at hand", bytes)?;
    let workers = Mutex::new(Vec::new());
    let one = |group: &[KeyedVertex]| {
        let worker = lock(&workers).pop();
        let mut worker = worker.unwrap_or_else(|| Summing {
            searcher: Searcher::new(pages as usize),
            numbers: FxHashMap::default(),
            points: Vec::new(),
        });
        let found = worker.group(group, triangles)?;
        lock(&workers).push(worker);
        Ok(found)
    };
    let mut last = [u32::MAX; 6];
    let mut flush = |wave: &mut Vec<KeyedVertex>| {
        workspace.check_cancel()?;
        let groups = cells.groups(wave, |row| bytemuck::cast(row.position));
        let found: Vec<Vec<Vertex>> = workspace.install(|| {
            let groups = groups.par_iter().with_max_len(1);
            groups.map(|group| one(group)).collect::<Result<_>>()
        })?;
        for row in found.iter().flatten() {
            let copy = u32::from(row.position == last);
            last = row.position;
            writer.push(Vertex { copy, ..*row })?;
        }
        wave.clear();
        Ok(())
    };
    let mut wave = Vec::with_capacity(WAVE);
    sorter.finish(workspace)?.for_each(|vertex| {
        wave.push(vertex);
        match wave.len() < WAVE {
            true => Ok(()),
            false => flush(&mut wave),
        }
    })?;
    drop(held);
    flush(&mut wave)?;
    writer.finish()
}

/// Sums up the triangles around vertices in one thread.
struct Summing {
    searcher: Searcher<[V3; 3]>,
    /// The number of the point at each position, given by its bits.
    numbers: FxHashMap<[u64; 3], u32>,
    points: Vec<Point>,
}

impl Summing {
    fn group(&mut self, group: &[KeyedVertex], triangles: &Pages<[V3; 3]>) -> Result<Vec<Vertex>> {
        let Self {
            searcher,
            numbers,
            points,
        } = self;
        numbers.clear();
        points.clear();
        let mut around = Box3::EMPTY;
        for vertex in group {
            let position: V3 = bytemuck::cast(vertex.position);
            around = around.with(position);
            numbers.entry(bits(position)).or_insert_with(|| {
                points.push(Point {
                    position,
                    facing: [0.0; 3],
                    weight: 0.0,
                });
                points.len() as u32 - 1
            });
        }
        triangles.meeting(&around, searcher, |corners| {
            let [a, b, c] = *corners;
            let facing = scale(cross(sub(b, a), sub(c, a)), 1.0 / 6.0);
            let weight = dot(facing, facing).sqrt();
            for corner in corners {
                let number = numbers.get(&bits(*corner));
                if let Some(point) = number.and_then(|n| points.get_mut(*n as usize)) {
                    point.facing = add(point.facing, facing);
                    point.weight += weight;
                }
            }
        })?;
        let vertex = |vertex: &KeyedVertex| {
            let number = numbers.get(&bits(bytemuck::cast(vertex.position)));
            let point = number.and_then(|n| points.get(*n as usize));
            let (facing, weight) = point.map_or(([0.0; 3], 0.0), |p| (p.facing, p.weight));
            Vertex {
                index: vertex.index,
                copy: 0,
                position: vertex.position,
                facing: bytemuck::cast(facing),
                weight: bytemuck::cast(weight),
            }
        };
        Ok(group.iter().map(vertex).collect())
    }
}

/// The bits of a position; 0 and -0 are one place.
fn bits(position: V3) -> [u64; 3] {
    position.map(|c| (c + 0.0).to_bits())
}
