//! The mesh around a block while its candidates are inserted.

use super::super::Insertion;
use super::super::admissibility::Neighborhood;
use super::super::base::Base;
use super::super::components::{BaseComponents, BlockComponents};
use super::super::insertion::{Candidate, Mesh};
use super::super::stats::InsertStats;
use super::{Interior, TriangleIn, VertexAt};
use crate::surface::parity::{OrientationConstraint, ParitySets};
use crate::surface::rows::{LabelledTo, LabelledTriangle, TriangleTo};
use crate::surface::star::{ByVertex, Triangle, others};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::{Holding, bytes_of};
use outcrop_geom::Point;
use outcrop_stages::cells::CountedTriple;
use outcrop_stages::ids::{Block, Component, Id, Ids, TriangleIndex};
use outcrop_stages::located::Located;

/// Mark of a vertex: it is in a crossing triple.
const CROSSING: u8 = 1;
/// Mark of a vertex: it is in a crossing triple that is not in the base and may be a candidate.
const OPEN: u8 = 2;

/// The mesh around a block during insertion.
#[derive(Default)]
pub(super) struct BlockWork {
    ids: Ids,
    /// The interior triangles of the base.
    mesh: Vec<Triangle>,
    /// For each vertex of a candidate (*active* vertices), the number and the other two vertices, ascending,
    /// of each triangle there.
    stars: ByVertex<(TriangleIndex, [Id; 2])>,
    /// For each vertex of the block, the time of the last insertion there.
    changed: Vec<u32>,
    /// The interior triangles of the base that touch a candidate or a crossing triple, then those of the
    /// crossing base, then inserted ones.
    triangles: Vec<Triangle>,
    components: BlockComponents,
    interior_base: usize,
    base: usize,
    pub(super) candidates: Vec<Candidate>,
    crossing_candidates: Vec<Candidate>,
    located: Located,
    /// For each vertex of the block, the marks [`CROSSING`] and [`OPEN`].
    marks: Vec<u8>,
    /// Triangles of the base that were removed at edges where two labels are not oriented alike.
    pub(super) cut: u64,
    /// Crossing candidates whose points are collinear in the file.
    pub(super) flat: u64,
}

impl Neighborhood for BlockWork {
    fn star(&self, v: Id) -> impl Iterator<Item = (TriangleIndex, [Id; 2])> {
        self.stars.at(v).iter().copied()
    }

    fn count(&self, v: Id) -> usize {
        self.stars.at(v).len()
    }

    fn position(&self, v: Id) -> Point {
        self.located.at(v)
    }
}

impl Mesh for BlockWork {
    type Part = Component;

    fn changed(&self, v: Id) -> u32 {
        self.changed[self.ids.place(v)]
    }

    fn component(&mut self, number: TriangleIndex) -> OrientationConstraint<Component> {
        self.components.find(number)
    }

    fn components(&mut self) -> &mut ParitySets<Component> {
        &mut self.components.joined
    }

    fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint<Component>], now: u32) {
        self.components.insert(t, constraints);
        self.enter(t);
        for v in t {
            self.changed[self.ids.place(v)] = now;
        }
    }
}

impl BlockWork {
    pub(super) fn load(
        insertion: Insertion<'_>,
        block: usize,
        held: &mut Holding<'_>,
        unit: &Unit<'_>,
    ) -> Result<Self> {
        let Insertion { base, blocks, .. } = insertion;
        let (ids, shape) = (blocks.ids(block), insertion.places.shape);
        let located = Located::load(shape, blocks, block, std::iter::empty())?;
        let mut candidates: Vec<Candidate> = Vec::with_capacity(base.candidates.rows(unit, block)?);
        for &CountedTriple { triple, count } in &base.candidates.get(unit, block)? {
            let at = triple.map(|v| located.at(v));
            candidates.push(Candidate::new(triple, count, at));
        }
        candidates.sort_unstable();
        let mut active = vec![false; ids.len()];
        for v in candidates.iter().flat_map(|c| c.ids) {
            active[ids.place(v)] = true;
        }
        let (interior, cut) = base.surface.inside(unit, block)?;
        let crossing = base.surface.crossing.get(unit, block)?;
        let marks = marks(base, &crossing, &ids, block, unit)?;
        let inside = interior.iter().map(|t| t.triangle);
        let across = crossing.iter().map(|t| t.triangle);
        let all = inside.chain(across).chain(candidates.iter().map(|c| c.ids));
        let is_active = |v: &Id| active.get(ids.find(*v)) == Some(&true);
        let stars = ByVertex::with_room(ids, all.flatten().filter(is_active));
        let mut work = Self {
            mesh: Vec::with_capacity(interior.len()),
            stars,
            changed: vec![0; ids.len()],
            candidates,
            located,
            marks,
            cut,
            ids,
            ..Self::default()
        };
        work.add_base(&interior, &crossing, &active, base, block);
        let read = bytes_of(&interior) + bytes_of(&crossing) + bytes_of(&active);
        held.set(work.bytes() + read);
        drop((interior, crossing));
        work.load_crossing_candidates(insertion, block, held, unit)?;
        Ok(work)
    }

    /// Allocated bytes.
    fn bytes(&self) -> u64 {
        let triangles = bytes_of(&self.mesh) + bytes_of(&self.triangles);
        let candidates = bytes_of(&self.candidates) + bytes_of(&self.crossing_candidates);
        let vertices = bytes_of(&self.changed) + bytes_of(&self.marks);
        let around = self.components.bytes() + self.stars.bytes() + self.located.bytes();
        triangles + candidates + vertices + around
    }

    /// Determines which crossing triples are candidates, and the positions of their vertices.
    fn load_crossing_candidates(
        &mut self,
        insertion: Insertion<'_>,
        block: usize,
        held: &mut Holding<'_>,
        unit: &Unit<'_>,
    ) -> Result<()> {
        let (places, base, blocks) = (insertion.places, insertion.base, insertion.blocks);
        let flags = base.flags.get(unit, block)?;
        let mut candidates = base.crossing.get(unit, block)?;
        candidates.retain(|candidate| {
            let (to, triangle) = (Block::at(block), candidate.triple);
            candidate.count < 3 || flags.binary_search(&TriangleTo { to, triangle }).is_ok()
        });
        let open = candidates.iter().flat_map(|c| c.triple);
        let in_base = self.triangles[self.interior_base..].iter().flatten();
        let all: Vec<Id> = open.chain(in_base.copied()).collect();
        self.located.add(places.shape, all.iter().copied())?;
        if places.limit_triangles() {
            let moved = places
                .differ()
                .then(|| Located::load(places.file, blocks, block, all.into_iter()))
                .transpose()?;
            held.set(self.bytes() + moved.as_ref().map_or(0, Located::bytes));
            let file = moved.as_ref().unwrap_or(&self.located);
            self.flat = places.drop_unfit(&mut candidates, file);
        }
        let new = |&CountedTriple { triple, count }: &CountedTriple| {
            Candidate::new(triple, count, triple.map(|v| self.position(v)))
        };
        self.crossing_candidates = candidates.iter().map(new).collect();
        held.set(self.bytes() + bytes_of(&candidates));
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
        for t in interior {
            self.mesh.push(t.triangle);
            let slots = t.triangle.map(|v| self.ids.place(v));
            if slots.iter().any(|&v| active[v] || self.marks[v] != 0) {
                of.push(components.interior(t.label_flip));
                self.enter(t.triangle);
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
        let number = TriangleIndex::at(self.triangles.len());
        self.triangles.push(t);
        for v in t {
            self.stars.push(v, (number, others(t, v)));
        }
    }

    pub(super) fn write(
        &mut self,
        out: &Interior,
        block: usize,
        undecided: &[Candidate],
        counts: &mut InsertStats,
        held: &mut Holding<'_>,
        unit: &Unit<'_>,
    ) -> Result<()> {
        let slot = |v: Id| self.ids.place(v);
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
        held.set(self.bytes() + bytes_of(&ranked) + 20 * ranked.len() as u64);
        let ranked: Vec<_> = ranked.iter().map(Candidate::row).collect();
        out.ranked.put(unit, block, &ranked)?;
        drop(ranked);
        let around = self.around_context(&context);
        out.context.put(unit, block, &around)?;
        out.vertices
            .put(unit, block, &self.located(&context, &around))?;
        drop(around);
        out.merges.put(unit, block, &self.components.tentative)?;
        let inserted = &mut self.triangles[self.base..];
        inserted.sort_unstable();
        let mut mesh = std::mem::take(&mut self.mesh);
        mesh.extend_from_slice(inserted);
        // The sort needs the same memory again.
        held.set(self.bytes() + 2 * bytes_of(&mesh));
        // Consists of two ascending runs, which this sort merges.
        mesh.sort();
        out.mesh.put(unit, block, bytemuck::cast_slice(&mesh))
    }

    /// The interior triangles at context vertices, with their components.
    fn around_context(&mut self, context: &[bool]) -> Vec<TriangleIn> {
        let mut around = Vec::new();
        for number in (0..self.interior_base).chain(self.base..self.triangles.len()) {
            let triangle = self.triangles[number];
            let mut slots = triangle.iter().map(|v| self.ids.place(*v));
            if slots.any(|v| context[v]) {
                let component = self.components.reference(TriangleIndex::at(number));
                around.push(TriangleIn {
                    triangle,
                    component,
                });
            }
        }
        around
    }

    /// The vertices whose positions crossing candidates may need.
    fn located(&self, context: &[bool], around: &[TriangleIn]) -> Vec<VertexAt> {
        let in_context = |v: &Id| self.ids.contains(v) && context[self.ids.place(*v)];
        let crossing = self.triangles[self.interior_base..self.base].iter();
        let touching = crossing.filter(|t| t.iter().any(in_context));
        let mut ids: Vec<Id> = touching.flatten().copied().collect();
        ids.extend(around.iter().flat_map(|t| t.triangle));
        ids.extend(self.ids.iter().filter(in_context));
        ids.sort_unstable();
        ids.dedup();
        let at = |id| VertexAt {
            id,
            position: self.position(id),
        };
        ids.into_iter().map(at).collect()
    }
}

/// The marks [`CROSSING`] and [`OPEN`] of the vertices of a block; `crossing` is the crossing base around it.
fn marks(
    base: &Base,
    crossing: &[LabelledTo],
    ids: &Ids,
    block: usize,
    unit: &Unit<'_>,
) -> Result<Vec<u8>> {
    let mut marks = vec![0; ids.len()];
    let mut mark = |t: Triangle, count: u32| {
        let in_base = || crossing.binary_search_by_key(&t, |c| c.triangle);
        let open = count < 3 || in_base().is_err();
        for v in t.into_iter().filter(|v| ids.contains(v)) {
            marks[ids.place(v)] |= if open { CROSSING | OPEN } else { CROSSING };
        }
    };
    for t in &base.visiting.get(unit, block)? {
        mark(t.triple, t.count);
    }
    for t in &base.crossing.get(unit, block)? {
        mark(t.triple, t.count);
    }
    Ok(marks)
}
