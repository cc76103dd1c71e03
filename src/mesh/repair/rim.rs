//! The boundary of the surface in a block: triangles, steps of boundary loops and pinched vertices.

use super::fill::Corner;
use super::loops::{InComponent, Step, neighbors, steps};
use super::rows::RimBits;
use super::surface::Surface;
use super::{SurfaceTriangle, ascending};
use crate::surface::star::Star;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, release, row};
use outcrop_disk::workspace::memory::{Reservation, bytes_of};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Ids, TriangleIndex};
use outcrop_stages::located::{Located, Places};
use serde::{Deserialize, Serialize};

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
        id: Id,
        /// The vertex opposite the boundary edge.
        apex: Id,
        /// 1 if the vertex has several fans.
        pinched: u32,
        /// A vertex of its one-ring.
        neighbor: Id,
    }
    packed Above Above Above Above
}

/// The input for numbering the vertices and triangles of the mesh.
#[derive(Debug, Serialize, Deserialize)]
pub struct NumberingInput {
    /// For each block, the number of triangles whose smallest vertex is in it, without those that fill holes.
    pub faces: Vec<u32>,
    /// Edges with exactly one triangle, after holes were filled.
    pub boundary_edges: u64,
    /// For each block, the vertices that had several fans before holes were filled.
    pub pinches: Table<Id>,
    /// All triangles at these vertices before holes were filled, oriented.
    pub pinched: Table<SurfaceTriangle>,
    /// The points that are vertices, by block.
    bits: Table<UsedBits>,
    blocks: Blocks,
}

release!(NumberingInput: pinches, pinched, bits);

/// The points that are vertices of the mesh.
#[derive(Debug)]
pub struct Vertices {
    /// One bit for each point, 64 in a word: set if it is a vertex.
    pub used: Vec<u64>,
    _held: Reservation,
}

/// Counts of a block's boundary.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct RimCounts {
    /// Number of triangles whose smallest vertex is in the block.
    pub faces: u32,
    /// Number of steps of boundary loops.
    pub steps: u64,
}

impl NumberingInput {
    /// The tables to which the blocks write their boundary, without counts.
    pub(super) fn new(blocks: Blocks) -> Self {
        let count = blocks.count();
        Self {
            faces: Vec::new(),
            boundary_edges: 0,
            pinches: Table::new("repair.pinches", count),
            pinched: Table::new("repair.pinched", count),
            bits: Table::new("repair.used", count),
            blocks,
        }
    }

    /// Writes the boundary of a block.
    pub(super) fn put(&self, unit: &Unit<'_>, found: &BlockRim) -> Result<RimCounts> {
        let block = unit.number();
        let bits = |word: &u64| UsedBits {
            low: *word as u32,
            high: (*word >> 32) as u32,
        };
        let words: Vec<_> = found.used.iter().map(bits).collect();
        self.bits.put(unit, block, &words)?;
        self.pinches.put(unit, block, &found.pinches)?;
        self.pinched.put(unit, block, &found.pinched())?;
        Ok(RimCounts {
            faces: found.faces,
            steps: found.steps.len() as u64,
        })
    }

    /// Reads which points are vertices.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`].
    pub fn open(&self, workspace: &Workspace) -> Result<Vertices> {
        let (blocks, unit) = (self.blocks, workspace.unit());
        let (words, count) = (blocks.points().div_ceil(64) + 1, blocks.count());
        let held = workspace.reserve("vertices", (words * 8 + count * 4) as u64)?;
        let mut used = vec![0u64; words];
        for block in 0..count {
            let ids = blocks.ids(block);
            let (first, shift) = (ids.start.index() / 64, ids.start.index() % 64);
            let bits = self.bits.get(&unit, block)?.into_iter();
            for (n, UsedBits { low, high }) in bits.enumerate() {
                let word = u64::from(high) << 32 | u64::from(low);
                used[first + n] |= word << shift;
                if shift > 0 {
                    used[first + n + 1] |= word >> (64 - shift);
                }
            }
        }
        Ok(Vertices { used, _held: held })
    }
}

/// The boundary of the surface in a block.
pub struct BlockRim {
    ids: Ids,
    /// One bit for each vertex of the block, set if it has a triangle.
    used: Vec<u64>,
    /// Number of triangles whose smallest vertex is in the block.
    faces: u32,
    /// All triangles at vertices with a boundary edge, each with its component.
    triangles: Vec<InComponent>,
    star: Star,
    shape: Located,
    /// Positions in the file, if they differ from the shape.
    file: Option<Located>,
    /// Steps of boundary loops, ascending.
    pub steps: Vec<Step>,
    /// Vertices with several fans, ascending.
    pub pinches: Vec<Id>,
}

impl BlockRim {
    pub(super) fn load(
        unit: &Unit<'_>,
        places: Places<'_>,
        surface: &Surface<'_>,
        blocks: Blocks,
    ) -> Result<Self> {
        let block = unit.number();
        let ids = blocks.ids(block);
        let rims = surface.rims(unit, block)?;
        let mut rim = Self {
            used: vec![0; ids.len().div_ceil(64)],
            faces: 0,
            triangles: Vec::new(),
            star: Star::of(Ids::default(), &[]),
            shape: Located::default(),
            file: None,
            steps: Vec::new(),
            pinches: Vec::new(),
            ids,
        };
        rim.pick(unit, surface, &rims)?;
        if rim.triangles.is_empty() {
            return Ok(rim);
        }
        let plain = || rim.triangles.iter().map(|t| t.0);
        rim.star = Star::of(ids, &plain().collect::<Vec<_>>());
        let load = |store| Located::load(store, blocks, block, plain().flatten());
        rim.shape = load(places.shape)?;
        rim.file = places.differ().then(|| load(places.file)).transpose()?;
        let on_rim = |v: &Id| bit(&rims, ids.place(*v));
        let mut pinches = Vec::new();
        let position = |v| rim.shape.at(v);
        let pinch = |id| pinches.push(id);
        let vertices = ids.iter().filter(on_rim);
        rim.steps = steps(vertices, &rim.star, &rim.triangles, position, pinch);
        rim.pinches = pinches;
        Ok(rim)
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        let lists = bytes_of(&self.triangles) + bytes_of(&self.steps) + bytes_of(&self.used);
        let file = self.file.as_ref().map_or(0, Located::bytes);
        lists + self.star.bytes() + self.shape.bytes() + file
    }

    /// Selects the triangles at vertices with a boundary edge from all triangles of the block.
    fn pick(&mut self, unit: &Unit<'_>, surface: &Surface<'_>, rims: &[RimBits]) -> Result<()> {
        let (triangles, runs) = surface.load(unit, unit.number())?;
        let mut held = unit.hold(bytes_of(&triangles) + bytes_of(&runs));
        let size = self.ids.len();
        let mut rest = &triangles[..];
        for run in runs {
            let (these, later) = rest.split_at(run.count);
            rest = later;
            for t in these {
                let mut at_rim = false;
                for v in t {
                    let local = self.ids.find(*v);
                    if local < size {
                        self.used[local / 64] |= 1 << (local % 64);
                        at_rim |= bit(rims, local);
                    }
                }
                self.faces += u32::from(self.ids.find(t[0]) < size);
                if at_rim {
                    self.triangles.push((*t, run.component));
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
    pub fn has_edge(&self, a: Id, b: Id) -> bool {
        self.star
            .at(a)
            .iter()
            .any(|&n| self.triangles[n.index()].0.contains(&b))
    }

    /// All triangles at pinched vertices, ascending by sorted ids.
    pub fn pinched(&self) -> Vec<SurfaceTriangle> {
        let at = |v: &Id| self.star.at(*v).iter().copied();
        let numbers = ascending(self.pinches.iter().flat_map(at));
        let row = |n: TriangleIndex| SurfaceTriangle {
            corners: self.triangles[n.index()].0,
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

fn bit(words: &[RimBits], local: usize) -> bool {
    words[local / 32].bits >> (local % 32) & 1 == 1
}
