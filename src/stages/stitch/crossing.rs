//! T12 insertion across blocks (paper, section 3.5, second part): block by block in ascending
//! order, with only the surroundings of borders that are still needed in memory.

use super::interior::{Home, Interior, NOTHING};
use super::tests_of_paper::{Adjacent, Rank, Refusal, View, examine, rank};
use super::{InsertStats, SharedStats};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::layouts::SENT;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::surface::orient::{Oriented, consistent};
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::Triangle;
use crate::stages::triples::Triples;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use rustc_hash::FxHashMap;

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// The crossing part of the mesh.
#[derive(Debug)]
pub struct Crossing {
    /// `[block, i, j, k]` for each block that the triangle touches: crossing triangles of the mesh,
    /// and interior candidates that were inserted late.
    pub added: Sections<4>,
    /// `[block, i, j, k]`: interior triangles to be taken out again.
    pub removed: Sections<4>,
}

/// A triangle near a border.
#[derive(Debug, Clone, Copy)]
struct Tri {
    ids: Triangle,
    label: u32,
    flip: bool,
}

/// The surroundings of the borders of the blocks that are loaded.
struct Context<'a> {
    store: &'a PointStore,
    base: &'a Oriented,
    interior: &'a Interior,
    blocks: Blocks,
    sets: ParitySets,
    tris: Vec<Tri>,
    free: Vec<u32>,
    around: FxHashMap<u32, Vec<u32>>,
    /// Positions of all vertices of the triangles here, and how many blocks need each.
    positions: FxHashMap<u32, (Point, u32)>,
    /// Crossing triangles by ids, since several blocks bring them.
    crossing: FxHashMap<Triangle, u32>,
    workspace: &'a Workspace,
    loaded: FxHashMap<u32, Loaded>,
}

/// What a loaded block holds on to.
struct Loaded {
    /// Vertices whose positions it needs; one that it needs twice is listed twice.
    located: Vec<u32>,
    _held: Reservation,
}

impl View for Context<'_> {
    fn around(&self, v: u32, each: &mut dyn FnMut(u32, Triangle)) {
        for &n in self.around.get(&v).into_iter().flatten() {
            each(n, self.tris[n as usize].ids);
        }
    }

    fn position(&self, v: u32) -> Point {
        self.positions[&v].0
    }
}

/// Inserts what crosses blocks, and what inside them waits for it.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
#[expect(
    clippy::too_many_arguments,
    reason = "the inputs of a stage, each used once"
)]
pub fn insert(
    store: &PointStore,
    triples: &Triples,
    flags: &Sections<4>,
    base: &mut Oriented,
    interior: &Interior,
    blocks: Blocks,
    cos_max_angle: f64,
    stats: &SharedStats,
    workspace: &Workspace,
) -> Result<Crossing> {
    let _held = workspace.reserve("stitch: exchanges", 2 * EXCHANGE_BUFFER)?;
    let added = Exchange::<4>::new(workspace, "stitch.added", EXCHANGE_BUFFER).packed(SENT);
    let removed = Exchange::<4>::new(workspace, "stitch.removed", EXCHANGE_BUFFER).packed(SENT);
    let lives = Lives::of(triples, blocks)?;
    let sets = std::mem::take(&mut base.sets);
    let mut context = Context::new(store, base, interior, blocks, sets, workspace);
    let mut pending: Vec<(Rank, u32)> = Vec::new();
    let mut counts = InsertStats::default();
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        for &block in &lives.begin[group] {
            context.load(block as usize)?;
        }
        let gone = context.joints(group)?;
        counts.joints_removed += gone.len() as u64;
        removed.send(&gone)?;
        let here = |((.., t), _): &(Rank, u32)| t.iter().any(|v| blocks.of(*v) == group as u32);
        let (mut tried, mut waiting): (Vec<_>, Vec<_>) = pending.into_iter().partition(here);
        tried.extend(context.candidates(triples, flags, group)?);
        tried.sort_unstable();
        let new = context.rounds(&mut tried, cos_max_angle, &mut counts);
        added.send(&new)?;
        // What has no vertex in a later block will not be tried again.
        for candidate in tried {
            if blocks.of(candidate.0.2[2]) > group as u32 {
                waiting.push(candidate);
            } else {
                counts.unconnected += 1;
            }
        }
        pending = waiting;
        for &block in &lives.end[group] {
            context.unload(block);
        }
        workspace.observer.advance(1);
    }
    stats.add(&counts);
    send_base(base, blocks, &added)?;
    Ok(Crossing {
        added: added.deliver(workspace, blocks.count())?,
        removed: removed.deliver(workspace, blocks.count())?,
    })
}

/// The crossing triangles of the base belong to the mesh as well.
fn send_base(base: &Oriented, blocks: Blocks, added: &Exchange<4>) -> Result<()> {
    for block in 0..blocks.count() {
        let records = base.crossing.get(block)?;
        let records: Vec<_> = records.iter().map(|r| [r[0], r[1], r[2], r[3]]).collect();
        added.send(&records)?;
    }
    Ok(())
}

/// When the surroundings of each block are needed: from the first to the last group that has a
/// candidate at one of its vertices.
struct Lives {
    begin: Vec<Vec<u32>>,
    end: Vec<Vec<u32>>,
}

impl Lives {
    fn of(triples: &Triples, blocks: Blocks) -> Result<Self> {
        let count = blocks.count();
        let mut first: Vec<u32> = (0..count as u32).collect();
        let mut last = first.clone();
        for block in 0..count {
            for r in triples.visiting.get(block)? {
                let touched = [r[1], r[2], r[3]].map(|v| blocks.of(v));
                for b in touched {
                    let b = b as usize;
                    first[b] = first[b].min(touched[0]);
                    last[b] = last[b].max(touched[2]);
                }
            }
        }
        let mut lives = Self {
            begin: vec![Vec::new(); count],
            end: vec![Vec::new(); count],
        };
        for block in 0..count {
            lives.begin[first[block] as usize].push(block as u32);
            lives.end[last[block] as usize].push(block as u32);
        }
        Ok(lives)
    }
}

impl<'a> Context<'a> {
    fn new(
        store: &'a PointStore,
        base: &'a Oriented,
        interior: &'a Interior,
        blocks: Blocks,
        sets: ParitySets,
        workspace: &'a Workspace,
    ) -> Self {
        Self {
            store,
            base,
            interior,
            blocks,
            sets,
            tris: Vec::new(),
            free: Vec::new(),
            around: FxHashMap::default(),
            positions: FxHashMap::default(),
            crossing: FxHashMap::default(),
            workspace,
            loaded: FxHashMap::default(),
        }
    }

    fn load(&mut self, block: usize) -> Result<()> {
        let vertices = self.interior.vertices.get(block)?;
        let near = self.interior.context.get(block)?;
        let crossing = self.base.crossing.get(block)?;
        let bytes = (vertices.len() * 160 + (near.len() + crossing.len()) * 120) as u64;
        let held = self.workspace.reserve("stitch: borders", bytes)?;
        for v in &vertices {
            self.around.insert(v[0], Vec::new());
        }
        let mut local: FxHashMap<u32, u32> = FxHashMap::default();
        for r in &near {
            let home = Home::from_word(r[3]);
            let label = if home.local {
                *local.entry(home.number).or_insert_with(|| self.sets.push())
            } else {
                home.number
            };
            let tri = Tri {
                ids: [r[0], r[1], r[2]],
                label,
                flip: home.flip,
            };
            let number = self.put(tri);
            self.hang(number, block as u32);
        }
        for r in &crossing {
            let ids = [r[1], r[2], r[3]];
            let known = self.crossing.get(&ids).copied();
            let number = known.unwrap_or_else(|| {
                let number = self.put(Tri {
                    ids,
                    label: r[4] >> 1,
                    flip: r[4] & 1 == 1,
                });
                self.crossing.insert(ids, number);
                number
            });
            self.hang(number, block as u32);
        }
        let located = self.locate(&vertices, &near, &crossing)?;
        self.loaded.insert(
            block as u32,
            Loaded {
                located,
                _held: held,
            },
        );
        Ok(())
    }

    /// Fetches the positions of all vertices that a load brings.
    fn locate(
        &mut self,
        vertices: &[[u32; 1]],
        near: &[[u32; 4]],
        crossing: &[[u32; 5]],
    ) -> Result<Vec<u32>> {
        let mut ids: Vec<u32> = vertices.iter().map(|v| v[0]).collect();
        ids.extend(near.iter().flat_map(|r| [r[0], r[1], r[2]]));
        ids.extend(crossing.iter().flat_map(|r| [r[1], r[2], r[3]]));
        ids.sort_unstable();
        ids.dedup();
        let mut points = Vec::with_capacity(ids.len());
        self.store.fetch(&ids, &mut points)?;
        for (&v, point) in ids.iter().zip(points) {
            self.positions.entry(v).or_insert((point, 0)).1 += 1;
        }
        Ok(ids)
    }

    fn put(&mut self, tri: Tri) -> u32 {
        if let Some(number) = self.free.pop() {
            self.tris[number as usize] = tri;
            number
        } else {
            self.tris.push(tri);
            self.tris.len() as u32 - 1
        }
    }

    /// Enters a triangle at its context vertices in `block`.
    fn hang(&mut self, number: u32, block: u32) {
        for v in self.tris[number as usize].ids {
            if self.blocks.of(v) == block
                && let Some(around) = self.around.get_mut(&v)
            {
                around.push(number);
            }
        }
    }

    fn unload(&mut self, block: u32) {
        let ids = self.blocks.ids(block as usize);
        let mut gone = Vec::new();
        self.around.retain(|v, around| {
            if !ids.contains(v) {
                return true;
            }
            gone.append(around);
            false
        });
        gone.sort_unstable();
        gone.dedup();
        for number in gone {
            let t = self.tris[number as usize].ids;
            if !t.iter().any(|v| self.around.contains_key(v)) {
                self.crossing.remove(&t);
                self.free.push(number);
            }
        }
        for v in self
            .loaded
            .remove(&block)
            .map(|l| l.located)
            .unwrap_or_default()
        {
            if let Some((_, users)) = self.positions.get_mut(&v) {
                *users -= 1;
                if *users == 0 {
                    self.positions.remove(&v);
                }
            }
        }
    }

    /// Joins the homes that meet at the joints of a block; the joints that contradict.
    fn joints(&mut self, block: usize) -> Result<Vec<[u32; 4]>> {
        let mut gone = Vec::new();
        for r in self.interior.joints.get(block)? {
            let asks: Vec<(u32, bool)> = r[3..]
                .iter()
                .filter(|w| **w != NOTHING)
                .map(|w| (w >> 1, w & 1 == 1))
                .collect();
            if consistent(&mut self.sets, &asks) {
                self.join(&asks);
            } else {
                let t = [r[0], r[1], r[2]];
                gone.push([block as u32, t[0], t[1], t[2]]);
                self.take_out(t);
            }
        }
        Ok(gone)
    }

    fn join(&mut self, asks: &[(u32, bool)]) {
        let (first, flip) = asks[0];
        for &(other, turned) in &asks[1..] {
            self.sets.join(first, other, flip ^ turned);
        }
    }

    fn take_out(&mut self, t: Triangle) {
        let mut number = None;
        for v in t {
            if let Some(around) = self.around.get_mut(&v) {
                let tris = &self.tris;
                if let Some(at) = around.iter().position(|n| tris[*n as usize].ids == t) {
                    // The order of the list does not matter to any test.
                    number = Some(around.remove(at));
                }
            }
        }
        self.free.extend(number);
    }

    /// The crossing candidates whose smallest vertex is in the block, and the block's leftovers.
    fn candidates(
        &self,
        triples: &Triples,
        flags: &Sections<4>,
        block: usize,
    ) -> Result<Vec<(Rank, u32)>> {
        let flags = flags.get(block)?;
        let flagged = |t: Triangle| {
            flags
                .binary_search(&[block as u32, t[0], t[1], t[2]])
                .is_ok()
        };
        let own = triples.own.get(block)?;
        let crossing = own.iter().filter(|r| {
            let t = [r[0], r[1], r[2]];
            self.blocks.crossing(t) && (r[3] < 3 || flagged(t))
        });
        let leftovers = self.interior.leftovers.get(block)?;
        Ok(crossing
            .chain(&leftovers)
            .map(|r| {
                let t = [r[0], r[1], r[2]];
                (rank(t, r[3], t.map(|v| self.position(v))), r[3])
            })
            .collect())
    }

    /// Rounds over the candidates until one inserts nothing; `[block, i, j, k]` of the inserted.
    fn rounds(
        &mut self,
        pending: &mut Vec<(Rank, u32)>,
        cos_max_angle: f64,
        counts: &mut InsertStats,
    ) -> Vec<[u32; 4]> {
        let mut inserted = Vec::new();
        loop {
            let before = inserted.len();
            pending.retain(|&((.., t), _)| match examine(t, self, cos_max_angle) {
                Err(Refusal::Unconnected) => true,
                Err(refusal) => {
                    counts.refuse(refusal);
                    false
                }
                Ok(adjacent) => {
                    if self.try_insert(t, adjacent) {
                        counts.accepted += 1;
                        inserted.push([self.blocks.of(t[0]), t[0], t[1], t[2]]);
                        let blocks = self.blocks;
                        inserted.extend(blocks.visited(t).map(|b| [b, t[0], t[1], t[2]]));
                    } else {
                        counts.orientation += 1;
                    }
                    false
                }
            });
            if inserted.len() == before {
                return inserted;
            }
        }
    }

    fn try_insert(&mut self, t: Triangle, adjacent: [Option<Adjacent>; 3]) -> bool {
        let asks: Vec<(u32, bool)> = adjacent
            .into_iter()
            .flatten()
            .map(|(number, turned)| {
                let other = &self.tris[number as usize];
                (other.label, other.flip ^ turned)
            })
            .collect();
        if !consistent(&mut self.sets, &asks) {
            return false;
        }
        self.join(&asks);
        let number = self.put(Tri {
            ids: t,
            label: asks[0].0,
            flip: asks[0].1,
        });
        for v in t {
            self.around.entry(v).or_default().push(number);
            // A block may outlive the others that the triangle touches.
            if let Some(loaded) = self.loaded.get_mut(&self.blocks.of(v)) {
                for w in t {
                    if let Some((_, users)) = self.positions.get_mut(&w) {
                        *users += 1;
                        loaded.located.push(w);
                    }
                }
            }
        }
        true
    }
}
