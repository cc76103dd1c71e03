//! The boundary of the surface in a block: triangles, steps of boundary loops and pinched vertices.

use super::SurfaceTriangle;
use super::fill::Corner;
use super::loops::{Step, neighbors, steps};
use super::rows::RimBits;
use super::surface::Surface;
use crate::error::Result;
use crate::spill::{Id, Table, row};
use crate::stages::blocks::Blocks;
use crate::stages::located::{Located, Places};
use crate::stages::surface::star::Star;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, Reservation, bytes_of, hold};
use crate::workspace::persist::{Persist, Saved, persist};
use std::ops::Range;

row! {
    /// 64 bits, one for each point: set if it is a vertex of the mesh.
    pub struct UsedBits {
        /// The lower 32 bits.
        low: u32,
        /// The upper 32 bits.
        high: u32,
    }
    unpacked
}

row! {
    /// A step of a boundary loop that leaves its block, repeated for each vertex of its one-ring.
    pub struct FragmentRow {
        /// The vertex.
        id: u32,
        /// The vertex opposite the boundary edge.
        apex: u32,
        /// 1 if the vertex has several fans.
        pinched: u32,
        /// A vertex of its one-ring.
        neighbor: u32,
    }
    packed Above Above Above Above
}

/// The input for numbering the vertices and triangles of the mesh.
#[derive(Debug)]
pub struct NumberingInput {
    /// One bit for each point, 64 in a word: set if it is a vertex.
    pub used: Vec<u64>,
    /// For each block, the number of triangles whose smallest vertex is in it, without those that fill holes.
    pub faces: Vec<u32>,
    /// Edges with exactly one triangle, after holes were filled.
    pub boundary_edges: u64,
    /// For each block, the vertices that had several fans before holes were filled.
    pub pinches: Table<Id>,
    /// All triangles at these vertices before holes were filled, oriented.
    pub pinched: Table<SurfaceTriangle>,
    /// The bits of `used`, by block.
    bits: Table<UsedBits>,
    blocks: Blocks,
    _held: Reservation,
}

/// The tables to which blocks write their boundary.
#[derive(Debug)]
pub(super) struct RimFiles {
    bits: Table<UsedBits>,
    pinches: Table<Id>,
    pinched: Table<SurfaceTriangle>,
}

/// Counts of a block's boundary.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RimCounts {
    faces: u32,
    steps: u64,
}

persist!(RimCounts { faces, steps });

impl RimFiles {
    /// Creates the tables.
    pub(super) fn create(workspace: &Workspace, count: usize) -> Result<Self> {
        Ok(Self {
            bits: Table::create(workspace, "repair.used", count)?,
            pinches: Table::create(workspace, "repair.pinches", count)?,
            pinched: Table::create(workspace, "repair.pinched", count)?,
        })
    }

    /// Writes the boundary of a block.
    pub(super) fn put(&self, block: usize, found: &BlockRim) -> Result<RimCounts> {
        let words = found.used.iter();
        let bits = |word: &u64| UsedBits {
            low: *word as u32,
            high: (*word >> 32) as u32,
        };
        self.bits.put(block, &words.map(bits).collect::<Vec<_>>())?;
        self.pinches.put(block, &found.pinches)?;
        self.pinched.put(block, &found.pinched())?;
        Ok(RimCounts {
            faces: found.faces,
            steps: found.steps.len() as u64,
        })
    }

    /// Collects the boundaries of all blocks.
    pub(super) fn numbering_input(
        self,
        found: &[RimCounts],
        blocks: Blocks,
        workspace: &Workspace,
    ) -> Result<NumberingInput> {
        let faces = found.iter().map(|counts| counts.faces).collect();
        let boundary_edges = found.iter().map(|counts| counts.steps).sum();
        let (used, held) = bits(&self.bits, blocks, workspace)?;
        Ok(NumberingInput {
            used,
            faces,
            boundary_edges,
            pinches: self.pinches,
            pinched: self.pinched,
            bits: self.bits,
            blocks,
            _held: held,
        })
    }
}

/// The bits of all blocks, concatenated.
fn bits(
    bits: &Table<UsedBits>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(Vec<u64>, Reservation)> {
    let (words, count) = (blocks.points().div_ceil(64) + 1, blocks.count());
    let held = workspace.reserve("vertices", (words * 8 + count * 4) as u64)?;
    let mut used = vec![0u64; words];
    // In a finished run the bits are not read any more.
    let count = if bits.is_gone() { 0 } else { count };
    for block in 0..count {
        let ids = blocks.ids(block);
        let (first, shift) = (ids.start as usize / 64, ids.start % 64);
        for (n, UsedBits { low, high }) in bits.get(block)?.into_iter().enumerate() {
            let word = u64::from(high) << 32 | u64::from(low);
            used[first + n] |= word << shift;
            if shift > 0 {
                used[first + n + 1] |= word >> (64 - shift);
            }
        }
    }
    Ok((used, held))
}

impl Persist for NumberingInput {
    fn save(&self, out: &mut Vec<u8>) {
        self.faces.save(out);
        self.boundary_edges.save(out);
        self.pinches.save(out);
        self.pinched.save(out);
        self.bits.save(out);
        self.blocks.save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (faces, boundary_edges) = Persist::load(from)?;
        let (pinches, pinched) = Persist::load(from)?;
        let (files, blocks) = <(Table<UsedBits>, Blocks)>::load(from)?;
        let (used, held) = bits(&files, blocks, from.workspace)?;
        Ok(Self {
            used,
            faces,
            boundary_edges,
            pinches,
            pinched,
            bits: files,
            blocks,
            _held: held,
        })
    }
}

/// The boundary of the surface in a block.
pub struct BlockRim {
    ids: Range<u32>,
    /// One bit for each vertex of the block, set if it has a triangle.
    used: Vec<u64>,
    /// Number of triangles whose smallest vertex is in the block.
    faces: u32,
    /// All triangles at vertices with a boundary edge, each with its component.
    triangles: Vec<[u32; 4]>,
    star: Star,
    shape: Located,
    /// Positions in the file, if they differ from the shape.
    file: Option<Located>,
    /// Steps of boundary loops, ascending.
    pub steps: Vec<Step>,
    /// Vertices with several fans, ascending.
    pub pinches: Vec<Id>,
    held: Holding,
}

impl BlockRim {
    pub(super) fn load(
        places: Places<'_>,
        surface: &Surface,
        blocks: Blocks,
        block: usize,
    ) -> Result<Self> {
        let ids = blocks.ids(block);
        let rims = surface.rims(block)?;
        let mut rim = Self {
            used: vec![0; ids.len().div_ceil(64)],
            faces: 0,
            triangles: Vec::new(),
            star: Star::of(ids.start..ids.start, &[]),
            shape: Located::default(),
            file: None,
            steps: Vec::new(),
            pinches: Vec::new(),
            held: Holding::default(),
            ids: ids.clone(),
        };
        rim.pick(surface, block, &rims)?;
        if rim.triangles.is_empty() {
            return Ok(rim);
        }
        let plain = || rim.triangles.iter().map(|t| [t[0], t[1], t[2]]);
        rim.star = Star::of(ids.clone(), &plain().collect::<Vec<_>>());
        rim.shape = Located::load(places.shape, blocks, block, plain().flatten())?;
        rim.file = if places.differ() {
            Some(Located::load(
                places.file,
                blocks,
                block,
                plain().flatten(),
            )?)
        } else {
            None
        };
        let on_rim = |v: &u32| bit(&rims, v - ids.start);
        let mut pinches = Vec::new();
        let position = |v| rim.shape.at(v);
        let pinch = |id| pinches.push(Id { id });
        let vertices = ids.clone().filter(on_rim);
        rim.steps = steps(vertices, &rim.star, &rim.triangles, position, pinch);
        rim.pinches = pinches;
        rim.held
            .set(bytes_of(&rim.triangles) + bytes_of(&rim.steps) + bytes_of(&rim.used));
        Ok(rim)
    }

    /// Selects the triangles at vertices with a boundary edge from all triangles of the block.
    fn pick(&mut self, surface: &Surface, block: usize, rims: &[RimBits]) -> Result<()> {
        let (triangles, runs) = surface.load(block)?;
        let mut held = hold(bytes_of(&triangles) + bytes_of(&runs));
        let size = self.ids.len() as u32;
        let mut rest = &triangles[..];
        for run in runs {
            let (these, later) = rest.split_at(run.count);
            rest = later;
            for t in these {
                let mut at_rim = false;
                for v in t {
                    let local = v.wrapping_sub(self.ids.start);
                    if local < size {
                        self.used[local as usize / 64] |= 1 << (local % 64);
                        at_rim |= bit(rims, local);
                    }
                }
                self.faces += u32::from(t[0].wrapping_sub(self.ids.start) < size);
                if at_rim {
                    self.triangles.push([t[0], t[1], t[2], run.component]);
                }
            }
        }
        held.set(bytes_of(&triangles) + bytes_of(&self.triangles));
        Ok(())
    }

    /// The corner of a boundary loop that belongs to a step.
    pub fn corner(&self, step: &Step) -> Corner {
        Corner {
            id: step.at,
            at: self.shape.at(step.at),
            apex: self.shape.at(step.apex),
            file: self.file.as_ref().unwrap_or(&self.shape).at(step.at),
            pinched: step.pinched,
        }
    }

    /// True if the mesh has the edge from `a`, which must be a vertex of a step, to `b`.
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.star
            .at(a)
            .iter()
            .any(|&n| self.triangles[n as usize][..3].contains(&b))
    }

    /// All triangles at pinched vertices, ascending by sorted ids.
    pub fn pinched(&self) -> Vec<SurfaceTriangle> {
        let at = |v: &Id| self.star.at(v.id).iter().copied();
        let mut numbers: Vec<u32> = self.pinches.iter().flat_map(at).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let row = |n: u32| {
            let [a, b, c, _] = self.triangles[n as usize];
            let corners = [a, b, c];
            SurfaceTriangle { corners }
        };
        numbers.into_iter().map(row).collect()
    }

    /// Loops inside the block, and the fragments of loops that leave it.
    pub fn trace(&self) -> (Vec<Vec<Step>>, Vec<Vec<Step>>) {
        let mut seen = vec![false; self.steps.len()];
        let next = |step: &Step| {
            let key = (step.at, step.to);
            let at = self.steps.partition_point(|s| (s.from, s.at) < key);
            (at < self.steps.len() && (self.steps[at].from, self.steps[at].at) == key).then_some(at)
        };
        let mut follow = |start: usize| {
            let mut part = Vec::new();
            let mut at = Some(start);
            while let Some(index) = at.filter(|i| !seen[*i]) {
                seen[index] = true;
                part.push(self.steps[index]);
                at = next(&self.steps[index]);
            }
            part
        };
        let enters = |s: &Step| !self.ids.contains(&s.from);
        let open = (0..self.steps.len())
            .filter(|&i| enters(&self.steps[i]))
            .map(&mut follow)
            .collect();
        let loops = (0..self.steps.len())
            .map(&mut follow)
            .filter(|part: &Vec<Step>| !part.is_empty());
        (loops.collect(), open)
    }

    /// Converts steps to rows.
    pub fn rows(&self, part: &[Step]) -> Vec<FragmentRow> {
        let mut rows = Vec::new();
        for step in part {
            let around = neighbors(&self.star, &self.triangles, step.at);
            rows.extend(around.into_iter().map(|neighbor| FragmentRow {
                id: step.at,
                apex: step.apex,
                pinched: step.pinched.into(),
                neighbor,
            }));
        }
        rows
    }
}

fn bit(words: &[RimBits], local: u32) -> bool {
    words[local as usize / 32].bits >> (local % 32) & 1 == 1
}
