//! What the pass across blocks keeps in memory: the surroundings of the borders of the blocks that are
//! loaded.

use super::InsertStats;
use super::base::Base;
use super::home::Home;
use super::interior::{Interior, NOTHING};
use super::tests_of_paper::{Adjacent, Candidate, Refusal, View, examine};
use crate::error::Result;
use crate::geom::Point;
use crate::stages::blocks::Blocks;
use crate::stages::surface::orient::{Asks, consistent};
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::{Triangle, others};
use crate::workspace::Workspace;
use crate::workspace::memory::{Reservation, bytes_of, table_bytes};
use rustc_hash::FxHashMap;

/// A triangle near a border.
#[derive(Debug, Clone, Copy)]
struct Tri {
    ids: Triangle,
    label: u32,
    flip: bool,
}

/// The triangles at a context vertex.
#[derive(Default)]
struct Around {
    triangles: Vec<u32>,
    /// When one was last inserted, as a number of insertions.
    changed: u32,
}

/// The surroundings of the borders of the blocks that are loaded.
pub struct Context<'a> {
    pub base: &'a Base,
    pub interior: &'a Interior,
    pub blocks: Blocks,
    sets: ParitySets,
    tris: Vec<Tri>,
    free: Vec<u32>,
    around: FxHashMap<u32, Around>,
    /// Positions of all vertices of the triangles here, and how many blocks need each.
    positions: FxHashMap<u32, (Point, u32)>,
    /// Crossing triangles by ids, since several blocks bring them.
    crossing: FxHashMap<Triangle, u32>,
    pub workspace: &'a Workspace,
    loaded: FxHashMap<u32, Loaded>,
    /// Bytes reserved for the blocks that are loaded.
    held: u64,
    told: Reservation,
}

/// What a loaded block holds on to.
struct Loaded {
    /// Vertices whose positions it needs; one that it needs twice is listed twice.
    located: Vec<u32>,
    bytes: u64,
    _held: Reservation,
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
        self.positions[&v].0
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
            tris: Vec::new(),
            free: Vec::new(),
            around: FxHashMap::default(),
            positions: FxHashMap::default(),
            crossing: FxHashMap::default(),
            workspace,
            loaded: FxHashMap::default(),
            held: 0,
            told: workspace.promise("stitch: borders", 0)?,
        })
    }

    /// Loads the surroundings of a block's borders; false if that would take more than `most` bytes.
    pub fn load(&mut self, block: u32, most: Option<u64>) -> Result<bool> {
        let section = block as usize;
        let (interior, surface) = (self.interior, &self.base.surface);
        let vertices = interior.vertices.get(section)?;
        let context = vertices.iter().filter(|r| r[1] == 1).map(|r| r[0]);
        let context: Vec<u32> = context.collect();
        let mut crossing = surface.crossing.get(section)?;
        crossing.retain(|r| r[1..4].iter().any(|v| context.binary_search(v).is_ok()));
        let triangles = interior.context.records(section) + crossing.len();
        let bytes = (context.len() * 160 + triangles * 120) as u64;
        if most.is_some_and(|most| self.held + bytes > most) {
            return Ok(false);
        }
        let held = self.workspace.promise("stitch: borders", bytes)?;
        self.held += bytes;
        let near = interior.context.get(section)?;
        for &v in &context {
            self.around.insert(v, Around::default());
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
            self.hang(number, block);
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
            self.hang(number, block);
        }
        for &[v, _, x, y, z] in &vertices {
            let point = [x, y, z].map(|c| c as i32);
            self.positions.entry(v).or_insert((point, 0)).1 += 1;
        }
        let located = vertices.into_iter().map(|r| r[0]).collect();
        let loaded = Loaded {
            located,
            bytes,
            _held: held,
        };
        self.loaded.insert(block, loaded);
        let read = (triangles * 20) as u64 + bytes_of(&context);
        self.tell(read);
        Ok(true)
    }

    /// Tells what the surroundings take, and `more` bytes.
    fn tell(&mut self, more: u64) {
        let lists: u64 = self
            .around
            .values()
            .map(|a| bytes_of(&a.triangles) + 16)
            .sum();
        let located: u64 = self.loaded.values().map(|l| bytes_of(&l.located)).sum();
        let tables = table_bytes(&self.around) + table_bytes(&self.positions);
        let triangles = bytes_of(&self.tris) + bytes_of(&self.free) + table_bytes(&self.crossing);
        self.told
            .set_held(lists + located + tables + triangles + more);
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
                around.triangles.push(number);
            }
        }
    }

    pub fn unload(&mut self, block: u32) {
        let ids = self.blocks.ids(block as usize);
        let mut gone = Vec::new();
        self.around.retain(|v, around| {
            if !ids.contains(v) {
                return true;
            }
            gone.append(&mut around.triangles);
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
        let Some(loaded) = self.loaded.remove(&block) else {
            return;
        };
        self.held -= loaded.bytes;
        for v in loaded.located {
            if let Some((_, users)) = self.positions.get_mut(&v) {
                *users -= 1;
                if *users == 0 {
                    self.positions.remove(&v);
                }
            }
        }
    }

    /// Joins the homes that meet at the joints of a block; the joints that contradict.
    pub fn joints(&mut self, block: usize) -> Result<Vec<[u32; 4]>> {
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
                if let Some(at) = around
                    .triangles
                    .iter()
                    .position(|n| tris[*n as usize].ids == t)
                {
                    // The order of the list does not matter to any test.
                    number = Some(around.triangles.swap_remove(at));
                }
            }
        }
        self.free.extend(number);
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
        self.around.values_mut().for_each(|a| a.changed = 0);
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
            let other = &self.tris[number as usize];
            asks.push((other.label, other.flip ^ turned));
        }
        let asks = asks.all();
        if !consistent(&mut self.sets, asks) {
            return false;
        }
        self.join(asks);
        let number = self.put(Tri {
            ids: t,
            label: asks[0].0,
            flip: asks[0].1,
        });
        for v in t {
            let around = self.around.entry(v).or_default();
            around.triangles.push(number);
            around.changed = now;
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
