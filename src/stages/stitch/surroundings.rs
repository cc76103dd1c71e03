//! The mesh around the candidates of one turn of the pass across blocks. It is discarded between turns.

use super::admissibility::Neighborhood;
use super::base::Base;
use super::components::{ComponentRef, NOTHING};
use super::deferred::Deferred;
use super::insertion::{Candidate, Mesh};
use super::interior::{Interior, TriangleIn, VertexAt};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::row;
use crate::stages::blocks::Blocks;
use crate::stages::surface::parity::{OrientationConstraint, ParitySets, constraint, word};
use crate::stages::surface::rows::{LabelledTo, TriangleTo};
use crate::stages::surface::star::{Triangle, others};
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, Reservation, bytes_of, table_bytes};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// A triangle at a vertex of a candidate.
#[derive(Debug, Clone, Copy)]
struct Entry {
    ids: Triangle,
    /// `label << 1 | flip`.
    word: u32,
    /// Positions of its vertices.
    at: [Point; 3],
}

impl Entry {
    fn row(&self) -> Change {
        Change {
            triangle: self.ids,
            label_flip: self.word,
            at: self.at,
        }
    }
}

/// The star of a candidate's vertex.
#[derive(Default)]
struct VertexStar {
    position: Point,
    triangles: Vec<u32>,
    /// Time of the last insertion.
    changed: u32,
}

row! {
    /// A triangle that a turn inserted into or removed from a block.
    struct Change {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip`; [`NOTHING`] if the triangle was removed.
        label_flip: u32,
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
    pub base: &'a Base,
    pub interior: &'a Interior,
    pub blocks: Blocks,
    /// The merged labels of the whole mesh.
    sets: ParitySets,
    /// Labels of the local components used so far, by block and number.
    locals: FxHashMap<(u32, u32), u32>,
    triangles: Vec<Entry>,
    stars: FxHashMap<u32, VertexStar>,
    /// Triangles inserted in this turn.
    inserted: Vec<u32>,
    changes: Deferred<Change>,
    pub workspace: &'a Workspace,
    reserved: Vec<Reservation>,
    /// The memory reported by a turn that is taken inside a unit of work, whose reservation it uses.
    held: Option<Holding>,
    told: Reservation,
}

impl Neighborhood for Surroundings<'_> {
    fn star(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])> {
        let numbers = self.stars.get(&v).map(|star| star.triangles.iter());
        numbers
            .into_iter()
            .flatten()
            .map(move |&n| (n, others(self.triangles[n as usize].ids, v)))
    }

    fn count(&self, v: u32) -> usize {
        self.stars.get(&v).map_or(0, |star| star.triangles.len())
    }

    fn position(&self, v: u32) -> Point {
        self.stars[&v].position
    }

    fn position_in(&self, number: u32, v: u32) -> Point {
        let t = &self.triangles[number as usize];
        t.at[t.ids.iter().position(|w| *w == v).unwrap_or(0)]
    }
}

impl Mesh for Surroundings<'_> {
    fn changed(&self, v: u32) -> u32 {
        self.stars.get(&v).map_or(0, |star| star.changed)
    }

    fn component(&mut self, number: u32) -> OrientationConstraint {
        constraint(self.triangles[number as usize].word)
    }

    fn components(&mut self) -> &mut ParitySets {
        &mut self.sets
    }

    fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint], now: u32) {
        let number = self.triangles.len() as u32;
        self.triangles.push(Entry {
            ids: t,
            word: word(constraints[0]),
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

/// The triangles of a block at the requested vertices.
struct Found {
    interior: Vec<TriangleIn>,
    crossing: Vec<LabelledTo>,
    changes: Vec<Change>,
}

impl Found {
    fn count(&self) -> usize {
        self.interior.len() + self.crossing.len() + self.changes.len()
    }
}

/// The positions that a block wrote.
struct Positions {
    ids: Range<u32>,
    /// Vertices, ascending.
    vertices: Vec<VertexAt>,
    /// Indices in `vertices` of the block's own vertices, which are the great majority.
    places: Vec<u32>,
}

impl Positions {
    fn new(ids: Range<u32>, vertices: Vec<VertexAt>) -> Self {
        let mut places = vec![0u32; ids.len()];
        for (place, vertex) in (0..).zip(&vertices) {
            if ids.contains(&vertex.id) {
                places[(vertex.id - ids.start) as usize] = place;
            }
        }
        Self {
            ids,
            vertices,
            places,
        }
    }

    fn at(&self, v: u32) -> Point {
        let place = if self.ids.contains(&v) {
            self.places[(v - self.ids.start) as usize] as usize
        } else {
            self.vertices.partition_point(|vertex| vertex.id < v)
        };
        self.vertices[place].position
    }
}

impl<'a> Surroundings<'a> {
    pub fn new(
        base: &'a Base,
        interior: &'a Interior,
        blocks: Blocks,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        Ok(Self {
            base,
            interior,
            blocks,
            sets: base.surface.sets.clone(),
            locals: FxHashMap::default(),
            triangles: Vec::new(),
            stars: FxHashMap::default(),
            inserted: Vec::new(),
            changes: Deferred::new(workspace, "stitch.changes", blocks.count())?,
            workspace,
            reserved: Vec::new(),
            held: None,
            told: workspace.promise("stitch: borders", 0)?,
        })
    }

    /// Loads the mesh around the candidates `tried`. If that would take more than `most` bytes, returns false
    /// and loads nothing.
    pub fn gather(&mut self, tried: &[Candidate], most: Option<u64>) -> Result<bool> {
        let mut wanted: Vec<u32> = tried.iter().flat_map(|c| c.ids).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let lists = bytes_of(&wanted) + size_of_val(tried) as u64;
        let blocks = self.blocks;
        self.held = most.map(|_| Holding::default());
        let mut fits = self.reserve(2 * lists, most)?;
        for part in wanted.chunk_by(|v, w| blocks.of(*v) == blocks.of(*w)) {
            self.workspace.check_cancel()?;
            fits = fits && self.load(part, lists, most)?;
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
        let more = self.workspace.promise("stitch: borders", bytes)?;
        self.reserved.push(more);
        Ok(true)
    }

    /// Loads the mesh around `wanted`, ascending vertices of one block. `lists` is the bytes of the turn's
    /// other lists.
    fn load(&mut self, wanted: &[u32], lists: u64, most: Option<u64>) -> Result<bool> {
        let block = self.blocks.of(wanted[0]);
        let section = block as usize;
        let files = [
            (self.interior.vertices.rows(section), 16),
            (self.interior.context.rows(section), 16),
            (self.base.surface.crossing.rows(section), 20),
            (self.changes.rows(section), 52),
        ];
        let read: usize = files.iter().map(|(records, bytes)| records * bytes).sum();
        // The data read are freed once the needed part has been copied.
        if !self.reserve(2 * read as u64, most)? {
            return Ok(false);
        }
        let found = self.find(wanted, section)?;
        let kept = wanted.len() as u64 * VERTEX + found.count() as u64 * TRIANGLE;
        let reading = self.reserved.pop();
        if !self.reserve(kept, most)? {
            return Ok(false);
        }
        let ids = self.blocks.ids(section);
        let positions = Positions::new(ids, self.interior.vertices.get(section)?);
        let tables = 5 * positions.places.len() as u64 + read as u64;
        self.stars.reserve(wanted.len());
        for &v in wanted {
            let star = VertexStar {
                position: positions.at(v),
                ..VertexStar::default()
            };
            self.stars.insert(v, star);
        }
        self.enter_all(&found, &positions, block);
        self.report_usage(lists + tables);
        drop(reading);
        Ok(true)
    }

    /// Reads the current triangles of a block at the vertices `wanted`.
    fn find(&self, wanted: &[u32], block: usize) -> Result<Found> {
        let ids = self.blocks.ids(block);
        let mut is_wanted = vec![false; ids.len()];
        let here = |v: u32| v.wrapping_sub(ids.start) as usize;
        wanted.iter().for_each(|v| is_wanted[here(*v)] = true);
        let touches = |t: Triangle| {
            let mut at = t.iter().map(|v| is_wanted.get(here(*v)));
            at.any(|wanted| wanted == Some(&true))
        };
        let mut interior = self.interior.context.get(block)?;
        interior.retain(|t| touches(t.triangle));
        let mut crossing = self.base.surface.crossing.get(block)?;
        crossing.retain(|t| touches(t.triangle));
        let (mut changes, mut gone) = (self.changes.get(block)?, Vec::new());
        changes.retain(|change| {
            let is_gone = change.label_flip == NOTHING;
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
    fn enter_all(&mut self, found: &Found, positions: &Positions, block: u32) {
        self.triangles.reserve(found.count());
        for row in &found.interior {
            let component = ComponentRef::from_word(row.component);
            let label = if component.local {
                let local = self.locals.entry((block, component.number));
                *local.or_insert_with(|| self.sets.push())
            } else {
                component.number
            };
            let ids = row.triangle;
            let word = word((label, component.flip));
            let at = ids.map(|v| positions.at(v));
            self.enter(Entry { ids, word, at }, block);
        }
        for row in &found.crossing {
            let (ids, word) = (row.triangle, row.label_flip);
            let at = ids.map(|v| positions.at(v));
            self.enter(Entry { ids, word, at }, block);
        }
        for change in &found.changes {
            let (ids, word, at) = (change.triangle, change.label_flip, change.at);
            self.enter(Entry { ids, word, at }, block);
        }
    }

    /// Adds a triangle to the stars of candidates' vertices in `block`.
    fn enter(&mut self, entry: Entry, block: u32) {
        let number = self.triangles.len() as u32;
        self.triangles.push(entry);
        for v in entry.ids {
            if self.blocks.of(v) == block
                && let Some(star) = self.stars.get_mut(&v)
            {
                star.triangles.push(number);
            }
        }
    }

    /// Reports the bytes of the lists and `more` bytes.
    fn report_usage(&mut self, more: u64) {
        let stars = self.stars.values();
        let lists: u64 = stars.map(|star| bytes_of(&star.triangles) + 16).sum();
        let turn = lists + table_bytes(&self.stars) + bytes_of(&self.triangles) + more;
        let tables = table_bytes(&self.locals) + self.changes.bytes();
        match &mut self.held {
            Some(held) => held.set(turn),
            None => self.told.set_held(turn + tables),
        }
    }

    /// Discards the loaded mesh.
    fn clear(&mut self) {
        self.triangles = Vec::new();
        self.stars = FxHashMap::default();
        self.inserted.clear();
        self.held = None;
        self.report_usage(0);
        self.reserved.clear();
    }

    /// Ends the turn of a block. Returns the triangles that it inserted, once for each block that they touch.
    /// They are recorded for blocks that have a later turn, as given by `later`.
    pub fn end(&mut self, later: impl Fn(u32) -> bool) -> Result<Vec<TriangleTo>> {
        let mut sent = Vec::with_capacity(2 * self.inserted.len());
        for &number in &self.inserted {
            let t = self.triangles[number as usize].ids;
            let first = self.blocks.of(t[0]);
            let all = std::iter::once(first).chain(self.blocks.visited(t));
            sent.extend(all.map(|block| (block, number)));
        }
        sent.sort_unstable();
        let entry = |number: u32| self.triangles[number as usize];
        for part in sent.chunk_by(|a, b| a.0 == b.0).filter(|p| later(p[0].0)) {
            let rows: Vec<_> = part.iter().map(|(_, n)| entry(*n).row()).collect();
            self.changes.send(part[0].0, &rows)?;
        }
        let with_block = |&(to, number): &(u32, u32)| TriangleTo {
            to,
            triangle: entry(number).ids,
        };
        let inserted = sent.iter().map(with_block).collect();
        self.clear();
        Ok(inserted)
    }

    /// Confirms the tentative merges of a block in the whole mesh. Triangles whose merges contradict earlier
    /// ones are removed and returned.
    pub fn confirm_merges(&mut self, block: usize) -> Result<Vec<TriangleTo>> {
        let (mut gone, mut noted) = (Vec::new(), Vec::new());
        for merge in self.interior.merges.get(block)? {
            let triangle = merge.triangle;
            let words = merge.constraints.into_iter().filter(|w| *w != NOTHING);
            let constraints: Vec<OrientationConstraint> = words.map(constraint).collect();
            if !self.sets.merge(&constraints) {
                let to = block as u32;
                gone.push(TriangleTo { to, triangle });
                noted.push(Change {
                    triangle,
                    label_flip: NOTHING,
                    at: [[0; 3]; 3],
                });
                self.take_out(triangle);
            }
        }
        self.changes.send(block as u32, &noted)?;
        Ok(gone)
    }

    fn take_out(&mut self, t: Triangle) {
        for v in t {
            if let Some(star) = self.stars.get_mut(&v) {
                let triangles = &self.triangles;
                // No test depends on the order of the list.
                star.triangles.retain(|n| triangles[*n as usize].ids != t);
            }
        }
    }
}
