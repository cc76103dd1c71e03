//! A mesh whose vertices do not fit into memory: its corners are sorted by vertex, receive their positions,
//! and are sorted back by triangle.

use super::shape::Shape;
use super::triangles::Reading;
use outcrop_codecs::ply_mesh::Sink;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, Sorted, Sorter, row};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::vector::V3;

/// Vertices per section of the positions.
const SECTION: usize = 1 << 14;

row! {
    /// A corner of a triangle.
    pub(super) struct Corner {
        /// The vertex.
        vertex: u32,
        /// Three times the triangle's number, and 0 to 2; the upper 32 bits first.
        number: [u32; 2],
    }
    unpacked
}

row! {
    /// The position of a corner.
    pub(super) struct PlacedCorner {
        /// Number of the corner, as in [`Corner`].
        number: [u32; 2],
        /// The bits of three `f64`.
        position: [u32; 6],
    }
    unpacked
}

/// Reads a mesh of any size, its elements in any order.
pub(super) struct Joined<'a> {
    reading: Reading<'a>,
    sorter: Sorter<Corner>,
    held: Reservation,
    positions: LocalTable<V3>,
    pending: Vec<V3>,
    corners: u64,
    batch: Vec<Corner>,
}

impl<'a> Joined<'a> {
    pub(super) fn new(reading: Reading<'a>) -> Result<Self> {
        let workspace = reading.workspace;
        let (sorter, held) = reading.sorter("corners", workspace.memory.available() / 5)?;
        let name = format!("{}.positions", reading.name);
        Ok(Self {
            reading,
            sorter,
            held,
            positions: LocalTable::create(workspace, &name)?,
            pending: Vec::with_capacity(SECTION),
            corners: 0,
            batch: Vec::new(),
        })
    }

    pub(super) fn finish(self) -> Result<Shape> {
        let reading = self.reading;
        let workspace = reading.workspace;
        if !self.pending.is_empty() {
            self.positions.append(&self.pending)?;
        }
        let sections = self.positions.count() as u64;
        let index = workspace.reserve("compare: positions", 64 * sections + (1 << 20))?;
        let corners = Corners::new(self.sorter.finish(workspace)?);

        let buffer = workspace.memory.available() / 4;
        let (placed, placed_held) = reading.sorter("placed", buffer)?;
        workspace.observer.begin("corners", "corners", self.corners);
        let used = place(&corners, &self.positions, &placed, &reading)?;
        workspace.observer.end();

        let buffer = workspace.memory.available() / 2;
        let (keys, keys_held) = reading.sorter("order", buffer)?;
        let mut triangle = [[0.0; 3]; 3];
        placed.finish(workspace)?.for_each(|placed: PlacedCorner| {
            let [high, low] = placed.number.map(u64::from);
            let corner = (high << 32 | low) % 3;
            triangle[corner as usize] = bytemuck::cast(placed.position);
            if corner == 2 {
                keys.push(&[reading.keyed(triangle)])?;
            }
            Ok(())
        })?;
        drop(placed_held);
        let triangles = reading.pages(keys)?;
        drop(keys_held);

        let shape = reading.shape(triangles, used, |chooser| {
            corners.for_each_vertex(&self.positions, |_, p| chooser.offer(p))
        })?;
        corners.release()?;
        drop((self.held, index));
        Ok(shape)
    }
}

/// Sends the position of every corner to its triangle; returns the number of vertices with corners.
fn place(
    corners: &Corners,
    positions: &LocalTable<V3>,
    placed: &Sorter<PlacedCorner>,
    reading: &Reading<'_>,
) -> Result<u64> {
    let mut used = 0;
    corners.for_each_vertex(positions, |v, p| {
        used += 1;
        reading.check(v, p)?;
        reading.workspace.check_cancel()
    })?;
    let mut window = Window::new(positions);
    corners.for_each(|Corner { vertex, number }| {
        let position = bytemuck::cast(window.get(vertex)?);
        reading.workspace.observer.advance(1);
        placed.push(&[PlacedCorner { number, position }])
    })?;
    Ok(used)
}

impl Sink for Joined<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        for p in positions {
            self.pending.push(*p);
            if self.pending.len() == SECTION {
                self.positions.append(&self.pending)?;
                self.pending.clear();
            }
        }
        self.reading.see(positions)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.batch.clear();
        for &vertex in triangles.iter().flatten() {
            if u64::from(vertex) >= self.reading.vertices {
                return Err(self.reading.no_vertex());
            }
            let number = [(self.corners >> 32) as u32, self.corners as u32];
            self.batch.push(Corner { vertex, number });
            self.corners += 1;
        }
        self.sorter.push(&self.batch)?;
        self.reading.advance(triangles.len())
    }
}

/// All corners by vertex; they can be read more than once.
enum Corners {
    Memory(Vec<Corner>),
    Disk(Sorted<Corner>),
}

impl Corners {
    fn new(sorted: Sorted<Corner>) -> Self {
        match sorted.in_memory() {
            Ok((all, _)) => Self::Memory(all),
            Err(sorted) => Self::Disk(sorted),
        }
    }

    /// Deletes the corners on disk.
    fn release(self) -> Result<()> {
        match self {
            Self::Memory(_) => Ok(()),
            Self::Disk(sorted) => sorted.release(),
        }
    }

    fn for_each(&self, mut each: impl FnMut(Corner) -> Result<()>) -> Result<()> {
        match self {
            Self::Memory(all) => all.iter().try_for_each(|c| each(*c)),
            Self::Disk(sorted) => sorted.for_range(None, None, each),
        }
    }

    /// Calls `each` with every vertex that has corners, ascending, and its position.
    fn for_each_vertex(
        &self,
        positions: &LocalTable<V3>,
        mut each: impl FnMut(u32, V3) -> Result<()>,
    ) -> Result<()> {
        let mut last = None;
        let mut window = Window::new(positions);
        self.for_each(|Corner { vertex: v, .. }| {
            if last == Some(v) {
                return Ok(());
            }
            last = Some(v);
            each(v, window.get(v)?)
        })
    }
}

/// Positions of ascending vertices.
struct Window<'a> {
    positions: &'a LocalTable<V3>,
    section: usize,
    rows: Vec<V3>,
}

impl<'a> Window<'a> {
    fn new(positions: &'a LocalTable<V3>) -> Self {
        Self {
            positions,
            section: usize::MAX,
            rows: Vec::new(),
        }
    }

    fn get(&mut self, v: u32) -> Result<V3> {
        let section = v as usize / SECTION;
        if section != self.section {
            self.positions.get_into(section, &mut self.rows)?;
            self.section = section;
        }
        Ok(self.rows[v as usize % SECTION])
    }
}
