//! Reading of a mesh: vertices into parts that can be read one by one, triangles to the blocks of their
//! smallest vertices.

use super::columns::Columns;
use super::lattice::{Finder, LARGEST, Lattice};
use super::outlook::all;
use super::rows::{BlockTriangle, LevelWord};
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Shuffle, Table};
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Vertices of a block, the receiver of triangles.
pub(super) const BLOCK: usize = 1 << 16;

/// Vertices of a part, which is read as a whole.
pub(super) const PART: usize = 1 << 10;

/// Triangles that are sorted by block at a time.
const BATCH: usize = 1 << 18;

/// What is stored of a vertex beside its position.
pub(super) trait Stored {
    /// Words of a vertex.
    fn words(&self) -> usize;

    /// Values of a vertex that [`Stored::store`] takes.
    fn values(&self) -> usize;

    /// Appends the words of a vertex with these values.
    fn store(&mut self, values: &[f64], put: impl FnMut(u32));
}

impl Stored for Columns {
    fn words(&self) -> usize {
        self.stored()
    }

    fn values(&self) -> usize {
        self.wanted().len()
    }

    fn store(&mut self, values: &[f64], put: impl FnMut(u32)) {
        Self::store(self, values, put);
    }
}

/// What is known of a mesh before it is read, and the names of the scratch files of its vertices and triangles.
pub(super) struct About<'a, C> {
    pub path: &'a Path,
    pub vertices: u64,
    /// True if all coordinates are 32-bit floats.
    pub floats: bool,
    pub columns: C,
    pub names: [&'a str; 2],
}

/// A mesh that was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Intake<C = Columns> {
    pub vertices: u64,
    pub triangles: u64,
    pub lattice: Lattice,
    pub columns: C,
    /// Places of the parts.
    parts: Vec<Place>,
    table: Table<LevelWord>,
    pub sent: Shuffle<BlockTriangle>,
}

/// Words of a vertex: its position as three `f64`, and its values.
fn words(columns: &impl Stored) -> usize {
    6 + columns.words()
}

/// Bytes of memory that reading takes.
pub(super) fn bytes(columns: &impl Stored, vertices: u64) -> u64 {
    let block = 3 * 4 * (BLOCK * words(columns)) as u64;
    let places = 2 * vertices.div_ceil(PART as u64) * size_of::<Place>() as u64;
    block + places + 4 * (BATCH * size_of::<BlockTriangle>()) as u64 + (4 << 20)
}

/// Reads a mesh.
pub(super) fn read(path: &Path, workspace: &Workspace) -> Result<Intake> {
    workspace.once("read", |unit| {
        let mesh = PlyMesh::open_any(path, workspace)?;
        let columns = Columns::of(&mesh);
        let _held = workspace.reserve("levels: reading", bytes(&columns, mesh.vertices()))?;
        let total = mesh.vertices() + mesh.faces();
        if !workspace.is_shared() {
            let stages = all(mesh.faces(), workspace.threads);
            workspace.observer.plan(&stages);
        }
        workspace
            .observer
            .begin("read mesh", "vertices and faces", total);
        let about = About {
            path,
            vertices: mesh.vertices(),
            floats: mesh.has_plain_floats(),
            columns,
            names: ["levels.vertices", "levels.triangles"],
        };
        let mut reader = Reader::new(about, unit);
        let mesh = mesh.wanting(reader.intake.columns.wanted());
        mesh.read_in_place(&mut reader)?;
        let intake = reader.finish()?;
        workspace.observer.end();
        Ok(intake)
    })
}

/// Takes a mesh, slice by slice.
pub(super) struct Reader<'a, C> {
    path: &'a Path,
    unit: &'a Unit<'a>,
    intake: Intake<C>,
    finder: Finder,
    /// Positions whose values are to come.
    positions: Vec<[f64; 3]>,
    /// The parts of the current block.
    block: Vec<Vec<LevelWord>>,
    taken: u64,
    batch: Vec<BlockTriangle>,
    senders: usize,
}

impl<'a, C: Stored> Reader<'a, C> {
    pub fn new(about: About<'a, C>, unit: &'a Unit<'a>) -> Self {
        let blocks = about.vertices.div_ceil(BLOCK as u64) as usize;
        let [vertices, triangles] = about.names;
        Self {
            path: about.path,
            unit,
            intake: Intake {
                vertices: about.vertices,
                triangles: 0,
                lattice: Finder::default().finish(),
                columns: about.columns,
                parts: Vec::new(),
                table: Table::new(vertices, blocks),
                sent: Shuffle::new(triangles),
            },
            finder: match about.floats {
                true => Finder::of_floats(),
                false => Finder::default(),
            },
            positions: Vec::new(),
            block: Vec::new(),
            taken: 0,
            batch: Vec::with_capacity(BATCH),
            senders: 0,
        }
    }

    fn store(&mut self, values: &[f64]) -> Result<()> {
        let each = self.intake.columns.values();
        let words = words(&self.intake.columns);
        for number in 0..self.positions.len() {
            let position = self.positions[number];
            if !self.finder.see(position) {
                let [x, y, z] = position;
                let place = format!("vertex {}", self.taken);
                let expected = format!("coordinates up to {LARGEST:e}");
                let found = format!("a position {x} {y} {z}");
                return Err(Error::input(self.path, place, found, expected));
            }
            if self.block.last().is_none_or(|p| p.len() == PART * words) {
                if self.block.len() == BLOCK / PART {
                    self.write()?;
                }
                self.block.push(Vec::with_capacity(PART * words));
            }
            let Some(part) = self.block.last_mut() else {
                continue;
            };
            for x in position {
                let bits = x.to_bits();
                let halves = [bits as u32, (bits >> 32) as u32];
                part.extend(halves.map(|word| LevelWord { word }));
            }
            let values = &values[number * each..][..each];
            let columns = &mut self.intake.columns;
            columns.store(values, |word| part.push(LevelWord { word }));
            self.taken += 1;
        }
        self.unit.advance(self.positions.len() as u64);
        self.positions.clear();
        self.unit.check_cancel()
    }

    /// Writes the block.
    fn write(&mut self) -> Result<()> {
        let number = self.intake.parts.len() / (BLOCK / PART);
        let places = self
            .intake
            .table
            .put_parts(self.unit, number, &self.block)?;
        self.intake.parts.extend(places);
        self.block.clear();
        Ok(())
    }

    fn send(&mut self) -> Result<()> {
        let batch = std::mem::replace(&mut self.batch, Vec::with_capacity(BATCH));
        self.intake.sent.send(self.unit, self.senders, batch)?;
        self.senders += 1;
        Ok(())
    }

    /// Ends the reading.
    pub fn finish(mut self) -> Result<Intake<C>> {
        if !self.block.is_empty() {
            self.write()?;
        }
        self.send()?;
        self.intake.lattice = self.finder.finish();
        Ok(self.intake)
    }
}

impl<C: Stored> Sink for Reader<'_, C> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.positions.extend_from_slice(positions);
        match self.intake.columns.values() {
            0 => self.store(&[]),
            _ => Ok(()),
        }
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.store(values)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        for &[a, b, c] in triangles {
            if u64::from(a.max(b).max(c)) >= self.intake.vertices {
                let found = format!("a triangle {a} {b} {c}");
                let expected = format!("vertices below {}", self.intake.vertices);
                return Err(Error::input(self.path, "faces", found, expected));
            }
            let corners = match a.min(b).min(c) {
                least if least == a => [a, b, c],
                least if least == b => [b, c, a],
                _ => [c, a, b],
            };
            let block = corners[0] / BLOCK as u32;
            self.batch.push(BlockTriangle { block, corners });
            if self.batch.len() == BATCH {
                self.send()?;
            }
        }
        self.intake.triangles += triangles.len() as u64;
        self.unit.advance(triangles.len() as u64);
        self.unit.check_cancel()
    }
}

/// A vertex as it was read.
pub(super) struct Vertex<'a> {
    /// Its position.
    pub position: [f64; 3],
    /// Its place on the lattice.
    pub point: [u32; 3],
    /// Its other words.
    pub stored: &'a [u32],
}

impl<C: Stored> Intake<C> {
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.vertices.div_ceil(BLOCK as u64) as usize
    }

    /// Calls `each` with the vertices of these numbers, which ascend.
    pub fn vertices(
        &self,
        unit: &Unit<'_>,
        numbers: impl Iterator<Item = u32>,
        mut each: impl FnMut(Vertex<'_>),
    ) -> Result<()> {
        let words = words(&self.columns);
        let (mut part, mut at) = (Vec::new(), usize::MAX);
        for number in numbers {
            let (wanted, inside) = (number as usize / PART, number as usize % PART);
            if wanted != at {
                self.table.read(unit, self.parts[wanted], &mut part)?;
                at = wanted;
            }
            let all: &[u32] = bytemuck::cast_slice(&part);
            let vertex = &all[inside * words..][..words];
            let position = std::array::from_fn(|axis| {
                let half = |n| u64::from(vertex[2 * axis + n]);
                f64::from_bits(half(0) | half(1) << 32)
            });
            each(Vertex {
                position,
                point: self.lattice.index(position),
                stored: &vertex[6..],
            });
        }
        Ok(())
    }

    /// Bytes of a part in memory.
    pub fn part_bytes(&self) -> u64 {
        4 * (PART * words(&self.columns)) as u64
    }

    /// Deletes the vertices.
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.table.release(workspace)
    }
}
