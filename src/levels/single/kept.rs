//! The mesh that a pass leaves: vertices by block of their old numbers, triangles by cell.

use crate::intake::BLOCK;
use crate::quadric::{NUMBERS, Quadric};
use crate::rows::{CellTriangle, KeptValue, KeptVertex};
use outcrop_codecs::ply_mesh::{SLICE, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Shuffle, Table};
use outcrop_disk::workspace::{Unit, Workspace};

/// The mesh that a pass leaves.
#[derive(Debug)]
pub(super) struct Kept {
    pub vertices: u64,
    pub triangles: u64,
    pub cells: usize,
    /// Vertices of the mesh before.
    pub before: u64,
    /// Columns of values.
    pub width: usize,
    pub table: Table<CellTriangle>,
    pub sent: Shuffle<KeptVertex>,
    pub values: Shuffle<KeptValue>,
}

/// New numbers of vertices: how many with a smaller old number are kept.
struct Numbers {
    /// A bit for each old number.
    bits: Vec<u64>,
    /// How many are kept before each word of bits.
    before: Vec<u32>,
}

impl Numbers {
    fn bytes(vertices: u64) -> u64 {
        vertices.div_ceil(64) * 12
    }

    fn of(&self, old: u32) -> u32 {
        let (word, bit) = (old as usize / 64, old % 64);
        self.before[word] + (self.bits[word] & ((1 << bit) - 1)).count_ones()
    }

    fn count(&mut self) {
        let mut sum = 0;
        self.before = Vec::with_capacity(self.bits.len());
        for word in &self.bits {
            self.before.push(sum);
            sum += word.count_ones();
        }
    }
}

/// Vertices on their way to a sink.
struct Slice<'a, S> {
    sink: &'a mut S,
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
}

impl<S: Sink> Slice<'_, S> {
    fn put(&mut self) -> Result<()> {
        self.sink.vertices(&self.positions)?;
        if !self.values.is_empty() {
            self.sink.values(&self.values)?;
        }
        self.positions.clear();
        self.values.clear();
        Ok(())
    }
}

impl Kept {
    fn blocks(&self) -> usize {
        self.before.div_ceil(BLOCK as u64) as usize
    }

    /// Reads the mesh, with the quadrics of its vertices after their values, if asked for.
    pub fn read(&self, sink: &mut impl Sink, with_quadrics: bool, unit: &Unit<'_>) -> Result<()> {
        let bytes = Numbers::bytes(self.before);
        let _held = unit.reserve("simplify: numbers", bytes)?;
        let mut numbers = Numbers {
            bits: vec![0; self.before.div_ceil(64) as usize],
            before: Vec::new(),
        };
        self.read_vertices(sink, with_quadrics, &mut numbers, unit)?;
        numbers.count();
        let mut batch = Vec::with_capacity(SLICE);
        for cell in 0..self.cells {
            unit.check_cancel()?;
            let rows = self.table.get(unit, cell)?;
            for part in rows.chunks(SLICE) {
                batch.clear();
                batch.extend(part.iter().map(|row| row.corners.map(|v| numbers.of(v))));
                sink.triangles(&batch)?;
            }
        }
        Ok(())
    }

    fn read_vertices(
        &self,
        sink: &mut impl Sink,
        with_quadrics: bool,
        numbers: &mut Numbers,
        unit: &Unit<'_>,
    ) -> Result<()> {
        let sent = self.sent.open(unit, self.blocks())?;
        let values = match self.width {
            0 => None,
            _ => Some(self.values.open(unit, self.blocks())?),
        };
        let mut slice = Slice {
            sink,
            positions: Vec::new(),
            values: Vec::new(),
        };
        for block in 0..self.blocks() {
            unit.check_cancel()?;
            let all_values = values.as_ref().map_or(0, |all| all.rows(block));
            let bytes = (2 * sent.rows(block) * size_of::<KeptVertex>()
                + 2 * all_values * size_of::<KeptValue>()) as u64;
            let _held = unit.reserve("simplify: vertices", bytes + (1 << 20))?;
            let rows = sent.get(unit, block)?;
            let others = values.as_ref().map(|all| all.get(unit, block));
            let others = others.transpose()?.unwrap_or_default();
            let mut others = others.chunk_by(|a, b| a.vertex == b.vertex);
            for same in rows.chunk_by(|a, b| a.vertex == b.vertex) {
                let first = &same[0];
                numbers.bits[first.vertex as usize / 64] |= 1 << (first.vertex % 64);
                slice.positions.push(first.position);
                if self.width > 0 {
                    let own = others.next().and_then(|own| own.get(..self.width));
                    let own = own.filter(|own| own[0].vertex == first.vertex);
                    let own = own.ok_or_else(|| self.missing(block))?;
                    slice.values.extend(own.iter().map(|row| row.value));
                }
                if with_quadrics {
                    let parts = same.iter().map(|row| Quadric::of_numbers(&row.quadric));
                    let sum = parts.fold(Quadric::default(), |sum, part| sum.plus(&part));
                    let all: [f64; NUMBERS] = sum.numbers();
                    slice.values.extend(all);
                }
                if slice.positions.len() == SLICE {
                    slice.put()?;
                }
            }
        }
        slice.put()
    }

    fn missing(&self, block: usize) -> Error {
        let error = std::io::Error::other(format!("block {block} has vertices without values"));
        Error::io(std::path::Path::new("simplify"), "read back", error)
    }

    /// Deletes the files.
    pub fn release(&self, workspace: &Workspace) -> Result<()> {
        self.table.release(workspace)?;
        self.sent.release(workspace)?;
        match self.width {
            0 => Ok(()),
            _ => self.values.release(workspace),
        }
    }
}
