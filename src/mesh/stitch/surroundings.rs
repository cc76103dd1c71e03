//! The mesh around the candidates of one turn of the pass across blocks. It is discarded between turns.

mod read;

use super::Insertion;
use super::admissibility::Neighborhood;
use super::components::Whose;
use super::deferred::Deferred;
use super::insertion::{Candidate, Mesh};
use crate::surface::parity::{OrientationConstraint, ParitySets, Turned, constraint, word};
use crate::surface::rows::TriangleTo;
use crate::surface::star::{Triangle, others};
use outcrop_disk::error::Result;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::{Holding, Reservation, bytes_of, table_bytes};
use outcrop_geom::Point;
use outcrop_stages::ids::{Block, Component, GlobalLabel, Id, TriangleIndex};
use read::{Found, Positions};
use rustc_hash::FxHashMap;

/// The star of a candidate's vertex.
#[derive(Default)]
struct VertexStar {
    position: Point,
    triangles: Vec<TriangleIndex>,
    /// Time of the last insertion.
    changed: u32,
}

row! {
    /// A triangle with positions; on disk, one that a turn inserted into or removed from a block.
    pub struct Change {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip`; [`Turned::NONE`] if the triangle was removed.
        label_flip: Turned<GlobalLabel>,
        /// Positions of the corners.
        at: [Point; 3],
    }
    packed Above Above Above Above Above Above Above Above Above Above Above Above Above
}

/// Bytes reserved for a vertex and for a triangle.
const VERTEX: u64 = 128;
const TRIANGLE: u64 = 80;

/// The mesh around the candidates of a turn. Their vertices are few and scattered over several blocks, so
/// their stars are in a hash table.
pub struct Surroundings<'a> {
    pub insertion: Insertion<'a>,
    /// The merged labels of the whole mesh.
    sets: ParitySets<GlobalLabel>,
    /// Labels of the local components used so far, by block and number.
    locals: FxHashMap<(Block, Component), GlobalLabel>,
    /// The triangles at vertices of candidates.
    triangles: Vec<Change>,
    stars: FxHashMap<Id, VertexStar>,
    /// Triangles inserted in this turn.
    inserted: Vec<TriangleIndex>,
    pub changes: Deferred<Change>,
    reserved: Vec<Reservation>,
    /// The memory reported by turns that do not report it to a unit.
    told: Reservation,
}

impl Neighborhood for Surroundings<'_> {
    fn star(&self, v: Id) -> impl Iterator<Item = (TriangleIndex, [Id; 2])> {
        let numbers = self.stars.get(&v).map(|star| star.triangles.iter());
        numbers
            .into_iter()
            .flatten()
            .map(move |&n| (n, others(self.triangles[n.index()].triangle, v)))
    }

    fn count(&self, v: Id) -> usize {
        self.stars.get(&v).map_or(0, |star| star.triangles.len())
    }

    fn position(&self, v: Id) -> Point {
        self.stars[&v].position
    }

    fn position_in(&self, number: TriangleIndex, v: Id) -> Point {
        let t = &self.triangles[number.index()];
        t.at[t.triangle.iter().position(|w| *w == v).unwrap_or(0)]
    }
}

impl Mesh for Surroundings<'_> {
    type Part = GlobalLabel;

    fn changed(&self, v: Id) -> u32 {
        self.stars.get(&v).map_or(0, |star| star.changed)
    }

    fn component(&mut self, number: TriangleIndex) -> OrientationConstraint<GlobalLabel> {
        constraint(self.triangles[number.index()].label_flip)
    }

    fn components(&mut self) -> &mut ParitySets<GlobalLabel> {
        &mut self.sets
    }

    fn insert(
        &mut self,
        t: Triangle,
        constraints: &[OrientationConstraint<GlobalLabel>],
        now: u32,
    ) {
        let number = TriangleIndex::at(self.triangles.len());
        self.triangles.push(Change {
            triangle: t,
            label_flip: word(constraints[0]),
            at: t.map(|v| self.position(v)),
        });
        self.inserted.push(number);
        for v in t {
            let star = self.stars.entry(v).or_default();
            star.triangles.push(number);
            star.changed = now;
        }
    }
}

impl<'a> Surroundings<'a> {
    pub fn new(insertion: Insertion<'a>) -> Result<Self> {
        Ok(Self {
            insertion,
            sets: insertion.base.surface.sets.clone(),
            locals: FxHashMap::default(),
            triangles: Vec::new(),
            stars: FxHashMap::default(),
            inserted: Vec::new(),
            changes: Deferred::new("stitch.changes", insertion.blocks.count()),
            reserved: Vec::new(),
            told: insertion.workspace.promise("stitch: borders", 0)?,
        })
    }

    /// Loads the mesh around the candidates `tried`. If that would take more than `most` bytes, returns false
    /// and loads nothing. A turn that is taken inside a unit of another step reports its memory to `held`.
    pub fn gather(
        &mut self,
        unit: &Unit<'_>,
        tried: &[Candidate],
        most: Option<u64>,
        held: &mut Option<Holding<'_>>,
    ) -> Result<bool> {
        let mut wanted: Vec<Id> = tried.iter().flat_map(|c| c.ids).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let lists = bytes_of(&wanted) + size_of_val(tried) as u64;
        let blocks = self.insertion.blocks;
        let mut fits = self.reserve(2 * lists, most)?;
        for part in wanted.chunk_by(|v, w| blocks.of(*v) == blocks.of(*w)) {
            unit.check_cancel()?;
            fits = fits && self.load(unit, part, lists, most, held)?;
        }
        if !fits {
            self.clear();
        }
        Ok(fits)
    }

    /// Reserves memory for this turn; false if the turn would then have more than `most` bytes.
    fn reserve(&mut self, bytes: u64, most: Option<u64>) -> Result<bool> {
        let before: u64 = self.reserved.iter().map(Reservation::bytes).sum();
        if most.is_some_and(|most| before + bytes > most) {
            return Ok(false);
        }
        let more = self.insertion.workspace.promise("stitch: borders", bytes)?;
        self.reserved.push(more);
        Ok(true)
    }

    /// Loads the mesh around `wanted`, ascending vertices of one block. `lists` is the bytes of the turn's
    /// other lists.
    fn load(
        &mut self,
        unit: &Unit<'_>,
        wanted: &[Id],
        lists: u64,
        most: Option<u64>,
        held: &mut Option<Holding<'_>>,
    ) -> Result<bool> {
        let Insertion {
            base,
            interior,
            blocks,
            ..
        } = self.insertion;
        let block = blocks.of(wanted[0]);
        let section = block.index();
        let files = [
            (interior.vertices.rows(unit, section)?, 16),
            (interior.context.rows(unit, section)?, 16),
            (base.surface.crossing.rows(section), 20),
            (self.changes.rows(section), 52),
        ];
        let read: usize = files.iter().map(|(records, bytes)| records * bytes).sum();
        // The data read are freed once the needed part has been copied.
        if !self.reserve(2 * read as u64, most)? {
            return Ok(false);
        }
        let found = self.find(unit, wanted, section)?;
        let kept = wanted.len() as u64 * VERTEX + found.count() as u64 * TRIANGLE;
        let reading = self.reserved.pop();
        if !self.reserve(kept, most)? {
            return Ok(false);
        }
        let ids = blocks.ids(section);
        let positions = Positions::new(ids, interior.vertices.get(unit, section)?);
        let tables = 5 * positions.places.len() as u64 + read as u64;
        self.stars.reserve(wanted.len());
        for &v in wanted {
            self.stars.entry(v).or_default().position = positions.at(v);
        }
        self.enter_all(&found, &positions, block);
        self.report_usage(lists + tables, held);
        drop(reading);
        Ok(true)
    }

    /// Reads the current triangles of a block at the vertices `wanted`.
    fn find(&self, unit: &Unit<'_>, wanted: &[Id], block: usize) -> Result<Found> {
        let ids = self.insertion.blocks.ids(block);
        let mut is_wanted = vec![false; ids.len()];
        let here = |v: Id| ids.find(v);
        wanted.iter().for_each(|v| is_wanted[here(*v)] = true);
        let touches = |t: Triangle| {
            let mut at = t.iter().map(|v| is_wanted.get(here(*v)));
            at.any(|wanted| wanted == Some(&true))
        };
        let mut interior = self.insertion.interior.context.get(unit, block)?;
        interior.retain(|t| touches(t.triangle));
        let mut crossing = self.insertion.base.surface.crossing.get(unit, block)?;
        crossing.retain(|t| touches(t.triangle));
        let (mut changes, mut gone) = (self.changes.get(unit, block)?, Vec::new());
        changes.retain(|change| {
            let is_gone = change.label_flip == Turned::NONE;
            if is_gone {
                gone.push(change.triangle);
            }
            !is_gone && touches(change.triangle)
        });
        if !gone.is_empty() {
            gone.sort_unstable();
            interior.retain(|t| gone.binary_search(&t.triangle).is_err());
        }
        Ok(Found {
            interior,
            crossing,
            changes,
        })
    }

    /// Adds the triangles found in a block.
    fn enter_all(&mut self, found: &Found, positions: &Positions, block: Block) {
        self.triangles.reserve(found.count());
        let located = |triangle: Triangle, label_flip: Turned<GlobalLabel>| Change {
            triangle,
            label_flip,
            at: triangle.map(|v| positions.at(v)),
        };
        for row in &found.interior {
            let (whose, flip) = row.component.parts();
            let label = match whose {
                Whose::Local(component) => {
                    let local = self.locals.entry((block, component));
                    *local.or_insert_with(|| self.sets.push())
                }
                Whose::Global(label) => label,
            };
            self.enter(located(row.triangle, word((label, flip))), block);
        }
        for row in &found.crossing {
            self.enter(located(row.triangle, row.label_flip), block);
        }
        for change in &found.changes {
            self.enter(*change, block);
        }
    }

    /// Adds a triangle to the stars of candidates' vertices in `block`.
    fn enter(&mut self, entry: Change, block: Block) {
        let number = TriangleIndex::at(self.triangles.len());
        self.triangles.push(entry);
        for v in entry.triangle {
            if self.insertion.blocks.of(v) == block
                && let Some(star) = self.stars.get_mut(&v)
            {
                star.triangles.push(number);
            }
        }
    }

    /// Reports the bytes of the lists and `more` bytes.
    fn report_usage(&mut self, more: u64, held: &mut Option<Holding<'_>>) {
        let stars = self.stars.values();
        let lists: u64 = stars.map(|star| bytes_of(&star.triangles) + 16).sum();
        let turn = lists + table_bytes(&self.stars) + bytes_of(&self.triangles) + more;
        let tables = table_bytes(&self.locals) + self.changes.bytes();
        match held {
            Some(held) => held.set(turn),
            None => self.told.set_held(turn + tables),
        }
    }

    /// Discards the loaded mesh.
    fn clear(&mut self) {
        self.triangles = Vec::new();
        self.stars = FxHashMap::default();
        self.inserted.clear();
        self.report_usage(0, &mut None);
        self.reserved.clear();
    }

    /// Ends the turn of a block. Returns the triangles that it inserted, once for each block that they touch.
    /// They are recorded for blocks that have a later turn, as given by `later`.
    pub fn end(
        &mut self,
        unit: &Unit<'_>,
        later: impl Fn(Block) -> bool,
    ) -> Result<Vec<TriangleTo>> {
        let mut sent = Vec::with_capacity(2 * self.inserted.len());
        for &number in &self.inserted {
            let t = self.triangles[number.index()].triangle;
            let first = self.insertion.blocks.of(t[0]);
            let all = std::iter::once(first).chain(self.insertion.blocks.visited(t));
            sent.extend(all.map(|block| (block, number)));
        }
        sent.sort_unstable();
        let entry = |number: TriangleIndex| self.triangles[number.index()];
        for part in sent.chunk_by(|a, b| a.0 == b.0).filter(|p| later(p[0].0)) {
            let rows: Vec<_> = part.iter().map(|(_, n)| entry(*n)).collect();
            self.changes.send(unit, part[0].0.index(), &rows)?;
        }
        let with_block = |&(to, number): &(Block, TriangleIndex)| TriangleTo {
            to,
            triangle: entry(number).triangle,
        };
        let inserted = sent.iter().map(with_block).collect();
        self.clear();
        Ok(inserted)
    }

    /// Confirms the tentative merges of a block in the whole mesh. Triangles whose merges contradict earlier
    /// ones are removed and returned.
    pub fn confirm_merges(&mut self, unit: &Unit<'_>, block: usize) -> Result<Vec<TriangleTo>> {
        let (mut gone, mut noted) = (Vec::new(), Vec::new());
        for merge in self.insertion.interior.merges.get(unit, block)? {
            let triangle = merge.triangle;
            let words = merge.constraints.into_iter().filter(|w| *w != Turned::NONE);
            let constraints: Vec<OrientationConstraint<_>> = words.map(constraint).collect();
            if !self.sets.merge(&constraints) {
                let to = Block::at(block);
                gone.push(TriangleTo { to, triangle });
                noted.push(Change {
                    triangle,
                    label_flip: Turned::NONE,
                    at: [[0; 3]; 3],
                });
                self.take_out(triangle);
            }
        }
        self.changes.send(unit, block, &noted)?;
        Ok(gone)
    }

    fn take_out(&mut self, t: Triangle) {
        for v in t {
            if let Some(star) = self.stars.get_mut(&v) {
                let triangles = &self.triangles;
                // No test depends on the order of the list.
                star.triangles
                    .retain(|n| triangles[n.index()].triangle != t);
            }
        }
    }
}
