//! What the pass across blocks has in memory: in the turn of a block, the surroundings of the
//! candidates that are tried, and nothing of it between turns.

use super::InsertStats;
use super::base::Base;
use super::home::Home;
use super::interior::{Interior, NOTHING};
use super::mail::Mail;
use super::tests_of_paper::{Adjacent, Candidate, Refusal, View, examine};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::Word;
use crate::stages::blocks::Blocks;
use crate::stages::surface::orient::{Asks, consistent};
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::{Triangle, others};
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, Reservation, bytes_of, table_bytes};
use rustc_hash::FxHashMap;

/// A triangle at a vertex of a candidate.
#[derive(Debug, Clone, Copy)]
struct Tri {
    ids: Triangle,
    /// `label << 1 | flip`.
    word: u32,
    /// Where its vertices are.
    at: [Point; 3],
}

/// The triangles at a vertex of a candidate.
#[derive(Default)]
struct Around {
    position: Point,
    triangles: Vec<u32>,
    /// When one was last inserted, as a number of insertions.
    changed: u32,
}

/// What turns changed at a block: `[i, j, k, label << 1 | flip, positions]` of a triangle that was
/// inserted, [`NOTHING`] instead of the label for one that was taken out.
const CHANGES: [Word; 13] = [Word::Above; 13];

/// What a vertex and a triangle are reckoned to take.
const VERTEX: u64 = 128;
const TRIANGLE: u64 = 80;

/// The surroundings of the candidates of a turn.
pub struct Context<'a> {
    pub base: &'a Base,
    pub interior: &'a Interior,
    pub blocks: Blocks,
    sets: ParitySets,
    /// Labels of the local homes that were met, by block and number.
    locals: FxHashMap<(u32, u32), u32>,
    tris: Vec<Tri>,
    around: FxHashMap<u32, Around>,
    /// Triangles inserted in this turn.
    inserted: Vec<u32>,
    changes: Mail<13>,
    pub workspace: &'a Workspace,
    reserved: Vec<Reservation>,
    /// What is told of a turn that is taken within a unit of work: it has what the unit had.
    held: Option<Holding>,
    told: Reservation,
}

impl View for Context<'_> {
    fn around(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])> {
        let around = self.around.get(&v).map(|a| a.triangles.iter());
        around
            .into_iter()
            .flatten()
            .map(move |&n| (n, others(self.tris[n as usize].ids, v)))
    }

    fn count(&self, v: u32) -> usize {
        self.around.get(&v).map_or(0, |a| a.triangles.len())
    }

    fn position(&self, v: u32) -> Point {
        self.around[&v].position
    }

    fn third(&self, number: u32, v: u32) -> Point {
        let t = &self.tris[number as usize];
        t.at[t.ids.iter().position(|w| *w == v).unwrap_or(0)]
    }
}

impl<'a> Context<'a> {
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
            tris: Vec::new(),
            around: FxHashMap::default(),
            inserted: Vec::new(),
            changes: Mail::new(workspace, "stitch.changes", blocks.count(), CHANGES)?,
            workspace,
            reserved: Vec::new(),
            held: None,
            told: workspace.promise("stitch: borders", 0)?,
        })
    }

    /// Gathers what is around the candidates `tried`; false, and nothing, if that would take more than
    /// `most` bytes.
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

    /// Reserves for this turn; false if it has more than `most` bytes then.
    fn reserve(&mut self, bytes: u64, most: Option<u64>) -> Result<bool> {
        let before: u64 = self.reserved.iter().map(Reservation::bytes).sum();
        if most.is_some_and(|most| before + bytes > most) {
            return Ok(false);
        }
        let more = self.workspace.promise("stitch: borders", bytes)?;
        self.reserved.push(more);
        Ok(true)
    }

    /// Takes in what is around `wanted`, ascending vertices of one block. `lists` is what the turn has
    /// beside.
    fn load(&mut self, wanted: &[u32], lists: u64, most: Option<u64>) -> Result<bool> {
        let block = self.blocks.of(wanted[0]);
        let (section, ids) = (block as usize, self.blocks.ids(block as usize));
        let (interior, surface) = (self.interior, &self.base.surface);
        let files = [
            (interior.vertices.records(section), 16),
            (interior.context.records(section), 16),
            (surface.crossing.records(section), 20),
            (self.changes.records(section), 52),
        ];
        let read: usize = files.iter().map(|(records, bytes)| records * bytes).sum();
        // What is read goes when its part was taken.
        if !self.reserve(2 * read as u64, most)? {
            return Ok(false);
        }
        let here = |v: u32| (v - ids.start) as usize;
        let mut is_wanted = vec![false; ids.len()];
        wanted.iter().for_each(|v| is_wanted[here(*v)] = true);
        let touches = |t: Triangle| t.iter().any(|v| ids.contains(v) && is_wanted[here(*v)]);
        let mut near = interior.context.get(section)?;
        near.retain(|r| touches([r[0], r[1], r[2]]));
        let mut crossing = surface.crossing.get(section)?;
        crossing.retain(|r| touches([r[1], r[2], r[3]]));
        let (mut changes, mut gone) = (self.changes.get(section)?, Vec::new());
        changes.retain(|r| {
            let t = [r[0], r[1], r[2]];
            if r[3] == NOTHING {
                gone.push(t);
            }
            r[3] != NOTHING && touches(t)
        });
        if !gone.is_empty() {
            gone.sort_unstable();
            near.retain(|r| gone.binary_search(&[r[0], r[1], r[2]]).is_err());
        }
        let triangles = near.len() + crossing.len() + changes.len();
        let kept = wanted.len() as u64 * VERTEX + triangles as u64 * TRIANGLE;
        let reading = self.reserved.pop();
        if !self.reserve(kept, most)? {
            return Ok(false);
        }
        let vertices = interior.vertices.get(section)?;
        // Where the positions of the block's own vertices are, which is nearly all of them.
        let mut places = vec![0u32; ids.len()];
        for (place, r) in (0..).zip(&vertices) {
            if ids.contains(&r[0]) {
                places[here(r[0])] = place;
            }
        }
        let position = |v: u32| {
            let place = if ids.contains(&v) {
                places[here(v)] as usize
            } else {
                vertices.partition_point(|r| r[0] < v)
            };
            let [_, x, y, z] = vertices[place];
            [x, y, z].map(|c| c as i32)
        };
        self.around.reserve(wanted.len());
        for &v in wanted {
            let around = Around {
                position: position(v),
                ..Around::default()
            };
            self.around.insert(v, around);
        }
        self.tris.reserve(triangles);
        for r in &near {
            let home = Home::from_word(r[3]);
            let label = if home.local {
                let local = self.locals.entry((block, home.number));
                *local.or_insert_with(|| self.sets.push())
            } else {
                home.number
            };
            let ids = [r[0], r[1], r[2]];
            self.hang(
                Tri {
                    ids,
                    word: label << 1 | u32::from(home.flip),
                    at: ids.map(position),
                },
                block,
            );
        }
        for r in &crossing {
            let ids = [r[1], r[2], r[3]];
            self.hang(
                Tri {
                    ids,
                    word: r[4],
                    at: ids.map(position),
                },
                block,
            );
        }
        for r in &changes {
            let at = |n: usize| [r[n], r[n + 1], r[n + 2]].map(|c| c as i32);
            self.hang(
                Tri {
                    ids: [r[0], r[1], r[2]],
                    word: r[3],
                    at: [at(4), at(7), at(10)],
                },
                block,
            );
        }
        let tables = bytes_of(&places) + bytes_of(&is_wanted) + read as u64;
        self.tell(lists + tables);
        drop(reading);
        Ok(true)
    }

    /// Tells what the surroundings take, and `more` bytes.
    fn tell(&mut self, more: u64) {
        let lists: u64 = self
            .around
            .values()
            .map(|a| bytes_of(&a.triangles) + 16)
            .sum();
        let turn = lists + table_bytes(&self.around) + bytes_of(&self.tris) + more;
        let tables = table_bytes(&self.locals) + self.changes.bytes();
        match &mut self.held {
            Some(held) => held.set(turn),
            None => self.told.set_held(turn + tables),
        }
    }

    /// Enters a triangle at the vertices of candidates in `block`; its number.
    fn hang(&mut self, tri: Tri, block: u32) -> u32 {
        let number = self.tris.len() as u32;
        self.tris.push(tri);
        for v in tri.ids {
            if self.blocks.of(v) == block
                && let Some(around) = self.around.get_mut(&v)
            {
                around.triangles.push(number);
            }
        }
        number
    }

    /// Forgets the surroundings.
    fn clear(&mut self) {
        self.tris = Vec::new();
        self.around = FxHashMap::default();
        self.inserted.clear();
        self.held = None;
        self.tell(0);
        self.reserved.clear();
    }

    /// Ends the turn of a block: what it changed is noted for blocks that have a later one, which
    /// `later` tells.
    pub fn end(&mut self, later: impl Fn(u32) -> bool) -> Result<()> {
        let mut sent = Vec::with_capacity(2 * self.inserted.len());
        for &number in &self.inserted {
            let t = self.tris[number as usize].ids;
            let first = self.blocks.of(t[0]);
            let all = std::iter::once(first).chain(self.blocks.visited(t));
            sent.extend(all.filter(|b| later(*b)).map(|b| (b, number)));
        }
        sent.sort_unstable();
        for part in sent.chunk_by(|a, b| a.0 == b.0) {
            let records: Vec<_> = part
                .iter()
                .map(|(_, number)| {
                    let Tri { ids, word, at } = self.tris[*number as usize];
                    let mut record = [0; 13];
                    record[..3].copy_from_slice(&ids);
                    record[3] = word;
                    let words = at.iter().flatten().map(|c| *c as u32);
                    record[4..].iter_mut().zip(words).for_each(|(r, w)| *r = w);
                    record
                })
                .collect();
            self.changes.send(part[0].0, &records)?;
        }
        self.clear();
        Ok(())
    }

    /// Joins the homes that meet at the joints of a block; the joints that contradict.
    pub fn joints(&mut self, block: usize) -> Result<Vec<[u32; 4]>> {
        let (mut gone, mut noted) = (Vec::new(), Vec::new());
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
                let mut record = [0; 13];
                record[..4].copy_from_slice(&[t[0], t[1], t[2], NOTHING]);
                noted.push(record);
                self.take_out(t);
            }
        }
        self.changes.send(block as u32, &noted)?;
        Ok(gone)
    }

    fn join(&mut self, asks: &[(u32, bool)]) {
        let (first, flip) = asks[0];
        for &(other, turned) in &asks[1..] {
            self.sets.join(first, other, flip ^ turned);
        }
    }

    fn take_out(&mut self, t: Triangle) {
        for v in t {
            if let Some(around) = self.around.get_mut(&v) {
                let tris = &self.tris;
                // The order of the list does not matter to any test.
                around.triangles.retain(|n| tris[*n as usize].ids != t);
            }
        }
    }

    /// Rounds over the candidates until one inserts nothing; `[block, i, j, k]` of the inserted.
    pub fn rounds(
        &mut self,
        pending: &mut Vec<Candidate>,
        cos_max_angle: f64,
        counts: &mut InsertStats,
    ) -> Vec<[u32; 4]> {
        let mut inserted = Vec::new();
        let mut link = Vec::new();
        // Turns begin a new count of insertions, so that 32 bits do.
        let mut now = 1;
        loop {
            let before = now;
            pending.retain_mut(|candidate| {
                let t = candidate.ids;
                // What fails test I needs a triangle at another of its edges.
                let last = |v| self.around.get(&v).map_or(0, |a| a.changed);
                let changed = t.map(|v| u8::from(last(v) > candidate.tried));
                if candidate.tried > 0 && changed.iter().sum::<u8>() < 2 {
                    return true;
                }
                candidate.tried = now;
                match examine(t, self, cos_max_angle, &mut link) {
                    Err(Refusal::Unconnected) => return true,
                    Err(refusal) => counts.refuse(refusal),
                    Ok(adjacent) => {
                        if self.try_insert(t, adjacent, now + 1) {
                            now += 1;
                            counts.accepted += 1;
                            inserted.push([self.blocks.of(t[0]), t[0], t[1], t[2]]);
                            let visited = self.blocks.visited(t);
                            inserted.extend(visited.map(|b| [b, t[0], t[1], t[2]]));
                        } else {
                            counts.orientation += 1;
                        }
                    }
                }
                false
            });
            if now == before {
                return inserted;
            }
        }
    }

    fn try_insert(&mut self, t: Triangle, adjacent: [Option<Adjacent>; 3], now: u32) -> bool {
        let mut asks = Asks::default();
        for (number, turned) in adjacent.into_iter().flatten() {
            let word = self.tris[number as usize].word;
            asks.push((word >> 1, (word & 1 == 1) ^ turned));
        }
        let asks = asks.all();
        if !consistent(&mut self.sets, asks) {
            return false;
        }
        self.join(asks);
        let number = self.tris.len() as u32;
        self.tris.push(Tri {
            ids: t,
            word: asks[0].0 << 1 | u32::from(asks[0].1),
            at: t.map(|v| self.position(v)),
        });
        self.inserted.push(number);
        for v in t {
            let around = self.around.entry(v).or_default();
            around.triangles.push(number);
            around.changed = now;
        }
        true
    }
}
