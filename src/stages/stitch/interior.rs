//! T12 insertion inside blocks (paper, section 3.5, second part): candidates whose vertices are all in one
//! block. Blocks are independent.

use super::admissibility::Neighborhood;
use super::base::Base;
use super::components::{BaseComponents, BlockComponents, Merge};
use super::insertion::{Candidate, CandidateRow, Mesh, insert_candidates};
use super::stats::InsertStats;
use crate::error::Result;
use crate::geom::Point;
use crate::spill::{Table, row};
use crate::stages::blocks::Blocks;
use crate::stages::cells::CountedTriple;
use crate::stages::located::{Located, Places};
use crate::stages::surface::parity::{OrientationConstraint, ParitySets};
use crate::stages::surface::rows::{LabelledTo, LabelledTriangle, TriangleRow, TriangleTo};
use crate::stages::surface::star::{ByVertex, Triangle, others};
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, bytes_of, hold};
use std::ops::Range;

row! {
    /// A triangle and its component.
    pub struct TriangleIn {
        /// Ids, ascending.
        triangle: Triangle,
        /// See [`ComponentRef`](super::components::ComponentRef).
        component: u32,
    }
    packed Above Rising Rising Above
}

row! {
    /// A vertex and its position.
    pub struct VertexAt {
        /// The vertex.
        id: u32,
        /// Its position.
        position: Point,
    }
    packed Above Above Above Above
}

/// Output of the blocks, for the insertion across blocks.
#[derive(Debug)]
pub struct Interior {
    /// Interior triangles of the mesh, ascending, by block.
    pub mesh: Table<TriangleRow>,
    /// Tentative merges, in the order of insertion.
    pub merges: Table<Merge>,
    /// Interior triangles at context vertices.
    pub context: Table<TriangleIn>,
    /// Vertices of these triangles and of the crossing base, and the context vertices, ascending.
    pub vertices: Table<VertexAt>,
    /// Crossing candidates with their smallest vertex in the block, and interior ones that failed test I only
    /// and touch a crossing triple; ascending.
    pub ranked: Table<CandidateRow>,
}

impl Interior {
    /// Creates the tables.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn create(workspace: &Workspace, count: usize) -> Result<Self> {
        Ok(Self {
            mesh: Table::create(workspace, "stitch.mesh", count)?,
            merges: Table::create(workspace, "stitch.merges", count)?,
            context: Table::create(workspace, "stitch.context", count)?,
            vertices: Table::create(workspace, "stitch.vertices", count)?,
            ranked: Table::create(workspace, "stitch.ranked", count)?,
        })
    }
}

/// Upper estimate of the bytes for a block.
pub fn block_bytes(base: &Base, block: usize) -> u64 {
    let triangles = base.surface.interior.rows(block) + base.surface.crossing.rows(block);
    let candidates = base.candidates.rows(block) + base.crossing.rows(block);
    let records = triangles + candidates + base.visiting.rows(block);
    180 * records as u64 + (4 << 20)
}

/// Work that follows the finished blocks, interleaved with the work inside other blocks.
pub trait Follower: Sync {
    /// The blocks in the order in which they are needed.
    fn order(&self) -> &[u32];
    /// Records that a block is finished.
    fn finished(&self, block: u32);
    /// Advances as far as the finished blocks allow. A thread calls this between two blocks.
    fn go_on(&self) -> Result<()>;
}

/// Inserts the interior candidates of all blocks; returns the counts.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`], and those of `follower`.
pub fn insert_all(
    places: Places<'_>,
    base: &Base,
    out: &Interior,
    blocks: Blocks,
    cos_max_angle: f64,
    follower: &impl Follower,
    workspace: &Workspace,
) -> Result<InsertStats> {
    let order = follower.order();
    let mut all = InsertStats {
        unfit: base.flat_candidates,
        ..InsertStats::default()
    };
    let work = |unit: usize| {
        let block = order[unit];
        let counts = insert(places, base, out, blocks, block as usize, cos_max_angle)?;
        workspace.advance(1);
        follower.finished(block);
        follower.go_on()?;
        Ok(counts)
    };
    let bytes = |unit: usize| block_bytes(base, order[unit] as usize);
    workspace.units("stitch: block", order.len(), bytes, work, |unit, counts| {
        // The block may have been finished in an earlier attempt.
        follower.finished(order[unit]);
        all.add(&counts);
        Ok(())
    })?;
    Ok(all)
}

/// Inserts the interior candidates of a block; returns the counts.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`].
pub fn insert(
    places: Places<'_>,
    base: &Base,
    out: &Interior,
    blocks: Blocks,
    block: usize,
    cos_max_angle: f64,
) -> Result<InsertStats> {
    let mut work = BlockWork::load(places, base, blocks, block)?;
    let mut counts = InsertStats {
        unfit: work.flat,
        cut: work.cut,
        ..InsertStats::default()
    };
    let mut undecided = std::mem::take(&mut work.candidates);
    insert_candidates(&mut work, &mut undecided, cos_max_angle, &mut counts);
    let _undecided = hold(bytes_of(&undecided));
    work.write(out, block, &undecided, &mut counts)?;
    Ok(counts)
}

/// Mark of a vertex: it is in a crossing triple.
const CROSSING: u8 = 1;
/// Mark of a vertex: it is in a crossing triple that is not in the base and may be a candidate.
const OPEN: u8 = 2;

/// The marks [`CROSSING`] and [`OPEN`] of the vertices of a block; `crossing` is the crossing base around it.
fn marks(base: &Base, crossing: &[LabelledTo], ids: &Range<u32>, block: usize) -> Result<Vec<u8>> {
    let mut marks = vec![0; ids.len()];
    let mut mark = |t: Triangle, count: u32| {
        let in_base = || crossing.binary_search_by_key(&t, |c| c.triangle);
        let open = count < 3 || in_base().is_err();
        for v in t.into_iter().filter(|v| ids.contains(v)) {
            marks[(v - ids.start) as usize] |= if open { CROSSING | OPEN } else { CROSSING };
        }
    };
    for t in &base.visiting.get(block)? {
        mark(t.triple, t.count);
    }
    for t in &base.crossing.get(block)? {
        mark(t.triple, t.count);
    }
    Ok(marks)
}

/// The mesh around a block during insertion.
struct BlockWork {
    ids: Range<u32>,
    /// The interior triangles of the base.
    mesh: Vec<Triangle>,
    /// For each vertex of a candidate (*active* vertices), the number and the other two vertices, ascending,
    /// of each triangle there.
    stars: ByVertex<(u32, [u32; 2])>,
    /// For each vertex of the block, the time of the last insertion there.
    changed: Vec<u32>,
    /// The interior triangles of the base that touch a candidate or a crossing triple, then those of the
    /// crossing base, then inserted ones.
    triangles: Vec<Triangle>,
    components: BlockComponents,
    interior_base: usize,
    base: usize,
    candidates: Vec<Candidate>,
    crossing_candidates: Vec<Candidate>,
    located: Located,
    /// For each vertex of the block, the marks [`CROSSING`] and [`OPEN`].
    marks: Vec<u8>,
    /// Triangles of the base that were removed at edges where two labels are not oriented alike.
    cut: u64,
    /// Crossing candidates whose points are collinear in the file.
    flat: u64,
    held: Holding,
}

impl Neighborhood for BlockWork {
    fn star(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])> {
        self.stars.at(v).iter().copied()
    }

    fn count(&self, v: u32) -> usize {
        self.stars.at(v).len()
    }

    fn position(&self, v: u32) -> Point {
        self.located.at(v)
    }
}

impl Mesh for BlockWork {
    fn changed(&self, v: u32) -> u32 {
        self.changed[(v - self.ids.start) as usize]
    }

    fn component(&mut self, number: u32) -> OrientationConstraint {
        self.components.find(number)
    }

    fn components(&mut self) -> &mut ParitySets {
        &mut self.components.joined
    }

    fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint], now: u32) {
        self.components.insert(t, constraints);
        self.enter(t);
        for v in t {
            self.changed[(v - self.ids.start) as usize] = now;
        }
    }
}

impl BlockWork {
    fn load(places: Places<'_>, base: &Base, blocks: Blocks, block: usize) -> Result<Self> {
        let ids = blocks.ids(block);
        let located = Located::load(places.shape, blocks, block, std::iter::empty())?;
        let mut candidates: Vec<Candidate> = Vec::with_capacity(base.candidates.rows(block));
        for &CountedTriple { triple, count } in &base.candidates.get(block)? {
            let at = triple.map(|v| located.at(v));
            candidates.push(Candidate::new(triple, count, at));
        }
        candidates.sort_unstable();
        let mut active = vec![false; ids.len()];
        for v in candidates.iter().flat_map(|c| c.ids) {
            active[(v - ids.start) as usize] = true;
        }
        let (interior, cut) = base.surface.inside(block)?;
        let crossing = base.surface.crossing.get(block)?;
        let marks = marks(base, &crossing, &ids, block)?;
        let inside = interior.iter().map(|t| t.triangle);
        let across = crossing.iter().map(|t| t.triangle);
        let all = inside.chain(across).chain(candidates.iter().map(|c| c.ids));
        let is_active = |v: &u32| active.get(v.wrapping_sub(ids.start) as usize) == Some(&true);
        let stars = ByVertex::with_room(ids.clone(), all.flatten().filter(is_active));
        let mut work = Self {
            mesh: Vec::with_capacity(interior.len()),
            stars,
            changed: vec![0; ids.len()],
            triangles: Vec::new(),
            components: BlockComponents::default(),
            interior_base: 0,
            base: 0,
            candidates,
            crossing_candidates: Vec::new(),
            located,
            marks,
            cut,
            flat: 0,
            held: Holding::default(),
            ids,
        };
        work.add_base(&interior, &crossing, &active, base, block);
        work.report_usage(bytes_of(&interior) + bytes_of(&crossing) + bytes_of(&active));
        drop((interior, crossing));
        work.load_crossing_candidates(places, base, blocks, block)?;
        Ok(work)
    }

    /// Reports the bytes of its lists and `more` bytes.
    fn report_usage(&mut self, more: u64) {
        let triangles = bytes_of(&self.mesh) + bytes_of(&self.triangles);
        let candidates = bytes_of(&self.candidates) + bytes_of(&self.crossing_candidates);
        let vertices = bytes_of(&self.changed) + bytes_of(&self.marks);
        self.held
            .set(triangles + candidates + self.components.bytes() + vertices + more);
    }

    /// Determines which crossing triples are candidates, and the positions of their vertices.
    fn load_crossing_candidates(
        &mut self,
        places: Places<'_>,
        base: &Base,
        blocks: Blocks,
        block: usize,
    ) -> Result<()> {
        let flags = base.flags.get(block)?;
        let mut candidates = base.crossing.get(block)?;
        candidates.retain(|candidate| {
            let (to, triangle) = (block as u32, candidate.triple);
            candidate.count < 3 || flags.binary_search(&TriangleTo { to, triangle }).is_ok()
        });
        let open = candidates.iter().flat_map(|c| c.triple);
        let in_base = self.triangles[self.interior_base..].iter().flatten();
        let all: Vec<u32> = open.chain(in_base.copied()).collect();
        self.located.add(places.shape, all.iter().copied())?;
        if places.limit_triangles() {
            let moved = places
                .differ()
                .then(|| Located::load(places.file, blocks, block, all.into_iter()))
                .transpose()?;
            let file = moved.as_ref().unwrap_or(&self.located);
            self.flat = places.drop_unfit(&mut candidates, file);
        }
        let new = |&CountedTriple { triple, count }: &CountedTriple| {
            Candidate::new(triple, count, triple.map(|v| self.position(v)))
        };
        self.crossing_candidates = candidates.iter().map(new).collect();
        self.report_usage(bytes_of(&candidates));
        Ok(())
    }

    fn add_base(
        &mut self,
        interior: &[LabelledTriangle],
        crossing: &[LabelledTo],
        active: &[bool],
        base: &Base,
        block: usize,
    ) {
        let mut components = BaseComponents::of(&base.surface, block);
        let mut of = Vec::new();
        for &LabelledTriangle {
            triangle: t,
            label_flip,
        } in interior
        {
            self.mesh.push(t);
            let slots = t.map(|v| (v - self.ids.start) as usize);
            if slots.iter().any(|&v| active[v] || self.marks[v] != 0) {
                of.push(components.interior(label_flip));
                self.enter(t);
            }
        }
        self.interior_base = self.triangles.len();
        for t in crossing {
            of.push(components.crossing(t.label_flip));
            self.enter(t.triangle);
        }
        self.base = self.triangles.len();
        self.components = BlockComponents::new(components, of);
    }

    /// Adds a triangle with the next number.
    fn enter(&mut self, t: Triangle) {
        let number = self.triangles.len() as u32;
        self.triangles.push(t);
        for v in t {
            self.stars.push(v, (number, others(t, v)));
        }
    }

    fn write(
        &mut self,
        out: &Interior,
        block: usize,
        undecided: &[Candidate],
        counts: &mut InsertStats,
    ) -> Result<()> {
        let slot = |v: u32| (v - self.ids.start) as usize;
        let mut context: Vec<bool> = self.marks.iter().map(|m| m & OPEN != 0).collect();
        let mut ranked = std::mem::take(&mut self.crossing_candidates);
        for candidate in undecided {
            if candidate.ids.iter().any(|&v| self.marks[slot(v)] != 0) {
                ranked.push(*candidate);
                candidate.ids.iter().for_each(|&v| context[slot(v)] = true);
            } else {
                counts.unconnected += 1;
            }
        }
        ranked.sort_unstable();
        self.report_usage(bytes_of(&ranked) + 20 * ranked.len() as u64);
        let ranked: Vec<_> = ranked.iter().map(Candidate::row).collect();
        out.ranked.put(block, &ranked)?;
        drop(ranked);
        let around = self.around_context(&context);
        out.context.put(block, &around)?;
        out.vertices.put(block, &self.located(&context, &around))?;
        drop(around);
        out.merges.put(block, &self.components.tentative)?;
        let inserted = &mut self.triangles[self.base..];
        inserted.sort_unstable();
        let mut mesh = std::mem::take(&mut self.mesh);
        mesh.extend_from_slice(inserted);
        // The sort needs the same memory again.
        self.report_usage(2 * bytes_of(&mesh));
        // Consists of two ascending runs, which this sort merges.
        mesh.sort();
        out.mesh.put(block, bytemuck::cast_slice(&mesh))
    }

    /// The interior triangles at context vertices, with their components.
    fn around_context(&mut self, context: &[bool]) -> Vec<TriangleIn> {
        let mut around = Vec::new();
        for number in (0..self.interior_base).chain(self.base..self.triangles.len()) {
            let t = self.triangles[number];
            if t.iter().any(|v| context[(v - self.ids.start) as usize]) {
                let component = self.components.reference(number as u32);
                around.push(TriangleIn {
                    triangle: t,
                    component: component.word(),
                });
            }
        }
        around
    }

    /// The vertices whose positions crossing candidates may need.
    fn located(&self, context: &[bool], around: &[TriangleIn]) -> Vec<VertexAt> {
        let in_context = |v: &u32| self.ids.contains(v) && context[(v - self.ids.start) as usize];
        let crossing = self.triangles[self.interior_base..self.base].iter();
        let touching = crossing.filter(|t| t.iter().any(in_context));
        let mut ids: Vec<u32> = touching.flatten().copied().collect();
        ids.extend(around.iter().flat_map(|t| t.triangle));
        ids.extend(self.ids.clone().filter(in_context));
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter()
            .map(|id| VertexAt {
                id,
                position: self.position(id),
            })
            .collect()
    }
}
