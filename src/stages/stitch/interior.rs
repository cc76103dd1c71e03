//! T12 insertion inside a block (paper, section 3.5, second part): the candidates whose vertices
//! are all in one block, each block by itself.

use super::InsertStats;
use super::base::Base;
use super::fans::Fans;
use super::home::Home;
use super::tests_of_paper::{Adjacent, Candidate, Refusal, View, examine};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::layouts::{LABELLED, TRIANGLE};
use crate::spill::{Sections, Word};
use crate::stages::blocks::Blocks;
use crate::stages::located::{Located, Places};
use crate::stages::surface::orient::{Asks, consistent};
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::Triangle;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, bytes_of, hold};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// What the blocks leave for the crossing candidates.
#[derive(Debug)]
pub struct Interior {
    /// Interior triangles of the mesh, `[i, j, k]`, ascending, by block.
    pub mesh: Sections<3>,
    /// Joints in order of insertion: `[i, j, k, a, b, c]`; `a`, `b`, `c` are what the adjacent
    /// triangles ask for, `label << 1 | flip`, or [`NOTHING`].
    pub joints: Sections<6>,
    /// Interior triangles that touch a context vertex: `[i, j, k, home]`, see [`Home`].
    pub context: Sections<4>,
    /// Vertices of these, of the crossing base and the context vertices, ascending: `[v, x, y, z]`.
    pub vertices: Sections<4>,
    /// Crossing candidates with their smallest vertex in the block, and interior ones that failed
    /// only test I and touch a crossing triple; ascending, see [`Candidate::record`].
    pub ranked: Sections<5>,
}

impl Interior {
    /// Makes the files.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn create(workspace: &Workspace, count: usize) -> Result<Self> {
        Ok(Self {
            mesh: Sections::with_layout(workspace, "stitch.mesh", count, TRIANGLE)?,
            joints: Sections::create(workspace, "stitch.joints", count)?,
            context: Sections::with_layout(workspace, "stitch.context", count, LABELLED)?,
            vertices: Sections::create(workspace, "stitch.vertices", count)?,
            ranked: Sections::with_layout(workspace, "stitch.ranked", count, RANKED)?,
        })
    }
}

/// How records of candidates are packed.
pub const RANKED: [Word; 5] = [
    Word::Above,
    Word::Above,
    Word::Above,
    Word::Rising,
    Word::Rising,
];

/// Placeholder in a joint.
pub const NOTHING: u32 = u32::MAX;

/// Bytes that the work on a block takes.
pub fn block_bytes(base: &Base, block: usize) -> u64 {
    let triangles = base.surface.interior.records(block) + base.surface.crossing.records(block);
    let candidates = base.candidates.records(block) + base.crossing.records(block);
    let records = triangles + candidates + base.visiting.rows(block);
    180 * records as u64 + (4 << 20)
}

/// Inserts the interior candidates of a block; what became of them.
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
    let undecided = work.insert_all(cos_max_angle, &mut counts);
    let _undecided = hold(bytes_of(&undecided));
    work.write(out, block, &undecided, &mut counts)?;
    Ok(counts)
}

/// For each vertex of a block: is it in a crossing triple?
const BORDER: u8 = 1;
/// Is it in one that is not in the base, so that it may be a candidate?
const OPEN: u8 = 2;

/// [`BORDER`] and [`OPEN`] of the vertices of a block; `crossing` is the crossing base around it.
fn border(base: &Base, crossing: &[[u32; 5]], ids: &Range<u32>, block: usize) -> Result<Vec<u8>> {
    let mut border = vec![0; ids.len()];
    let mut mark = |t: Triangle, count: u32| {
        let in_base = || crossing.binary_search_by_key(&t, |r| [r[1], r[2], r[3]]);
        let open = count < 3 || in_base().is_err();
        for v in t.into_iter().filter(|v| ids.contains(v)) {
            border[(v - ids.start) as usize] |= if open { BORDER | OPEN } else { BORDER };
        }
    };
    for r in &bytemuck::cast_vec::<_, [u32; 5]>(base.visiting.get(block)?) {
        mark([r[1], r[2], r[3]], r[4]);
    }
    for r in &base.crossing.get(block)? {
        mark([r[0], r[1], r[2]], r[3]);
    }
    Ok(border)
}

/// The mesh around a block while candidates are inserted.
struct BlockWork {
    ids: Range<u32>,
    /// The interior triangles of the base.
    mesh: Vec<Triangle>,
    /// Around the vertices of candidates.
    fans: Fans,
    /// Those of base interior that touch a candidate or a crossing triple, base crossing, then
    /// inserted triangles.
    triangles: Vec<Triangle>,
    /// For each triangle its home's node and its orientation relative to it.
    homes: Vec<(u32, bool)>,
    interior_base: usize,
    base: usize,
    candidates: Vec<Candidate>,
    crossing_candidates: Vec<Candidate>,
    /// Homes absorbed into one another for good.
    absorbed: ParitySets,
    /// Homes joined for this block.
    joined: ParitySets,
    /// Global label of each node, [`NOTHING`] for local homes.
    global: Vec<u32>,
    joints: Vec<[u32; 6]>,
    located: Located,
    /// For each vertex of the block [`BORDER`] and [`OPEN`].
    border: Vec<u8>,
    /// Triangles of the base that went because the labels at an edge run against each other.
    cut: u64,
    /// Crossing candidates that would be on a line in the file.
    flat: u64,
    held: Holding,
}

impl View for BlockWork {
    fn around(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])> {
        self.fans.at(v)
    }

    fn count(&self, v: u32) -> usize {
        self.fans.count(v)
    }

    fn position(&self, v: u32) -> Point {
        self.located.at(v)
    }
}

impl BlockWork {
    fn load(places: Places<'_>, base: &Base, blocks: Blocks, block: usize) -> Result<Self> {
        let ids = blocks.ids(block);
        let located = Located::load(places.shape, blocks, block, std::iter::empty())?;
        let mut candidates: Vec<Candidate> = Vec::with_capacity(base.candidates.records(block));
        for &[i, j, k, count] in &base.candidates.get(block)? {
            let t = [i, j, k];
            candidates.push(Candidate::new(t, count, t.map(|v| located.at(v))));
        }
        candidates.sort_unstable();
        let mut active = vec![false; ids.len()];
        for v in candidates.iter().flat_map(|c| c.ids) {
            active[(v - ids.start) as usize] = true;
        }
        let (interior, cut) = base.surface.inside(block)?;
        let crossing = base.surface.crossing.get(block)?;
        let border = border(base, &crossing, &ids, block)?;
        let inside = interior.iter().map(|r| [r[0], r[1], r[2]]);
        let across = crossing.iter().map(|r| [r[1], r[2], r[3]]);
        let all = inside.chain(across).chain(candidates.iter().map(|c| c.ids));
        let fans = Fans::with_room(ids.clone(), &active, all);
        let mut work = Self {
            mesh: Vec::with_capacity(interior.len()),
            fans,
            triangles: Vec::new(),
            homes: Vec::new(),
            interior_base: 0,
            base: 0,
            candidates,
            crossing_candidates: Vec::new(),
            absorbed: ParitySets::default(),
            joined: ParitySets::default(),
            global: Vec::new(),
            joints: Vec::new(),
            located,
            border,
            cut,
            flat: 0,
            held: Holding::default(),
            ids,
        };
        work.add_base(&interior, &crossing, &active, base, block);
        work.tell(bytes_of(&interior) + bytes_of(&crossing) + bytes_of(&active));
        drop((interior, crossing));
        work.see_crossing(places, base, blocks, block)?;
        Ok(work)
    }

    /// Tells what its lists take, and `more` bytes.
    fn tell(&mut self, more: u64) {
        let triangles = bytes_of(&self.mesh) + bytes_of(&self.triangles) + bytes_of(&self.homes);
        let candidates = bytes_of(&self.candidates) + bytes_of(&self.crossing_candidates);
        let homes = bytes_of(&self.global) * 3 + bytes_of(&self.joints);
        self.held
            .set(triangles + candidates + homes + bytes_of(&self.border) + more);
    }

    /// Takes in which crossing triples are candidates, and where their vertices are.
    fn see_crossing(
        &mut self,
        places: Places<'_>,
        base: &Base,
        blocks: Blocks,
        block: usize,
    ) -> Result<()> {
        let flags = base.flags.get(block)?;
        let mut candidates = base.crossing.get(block)?;
        candidates.retain(|&[i, j, k, count]| {
            count < 3 || flags.binary_search(&[block as u32, i, j, k]).is_ok()
        });
        let vertices = |all: &[[u32; 4]]| -> Vec<u32> {
            let open = all.iter().flat_map(|r| [r[0], r[1], r[2]]);
            let base = self.triangles[self.interior_base..].iter().flatten();
            open.chain(base.copied()).collect()
        };
        let all = vertices(&candidates);
        self.located.add(places.shape, all.iter().copied())?;
        if places.limit_triangles() {
            let moved = places
                .differ()
                .then(|| Located::load(places.file, blocks, block, all.into_iter()))
                .transpose()?;
            let file = moved.as_ref().unwrap_or(&self.located);
            self.flat = places.drop_unfit(&mut candidates, file);
        }
        let new = |&[i, j, k, count]: &[u32; 4]| {
            let t = [i, j, k];
            Candidate::new(t, count, t.map(|v| self.position(v)))
        };
        self.crossing_candidates = candidates.iter().map(new).collect();
        self.tell(bytes_of(&candidates));
        Ok(())
    }

    fn add_base(
        &mut self,
        interior: &[[u32; 4]],
        crossing: &[[u32; 5]],
        active: &[bool],
        base: &Base,
        block: usize,
    ) {
        let base = &base.surface;
        let (first, globals) = base.globals[block];
        // Nodes: the block's own labels; those whose set has a crossing triangle are one node for
        // each set, shared with the crossing triangles.
        let mut node_of_root: FxHashMap<u32, u32> = FxHashMap::default();
        let mut of_label: Vec<(u32, bool)> = Vec::with_capacity(base.labels[block] as usize);
        let mut node_for = |work: &mut Self, label: u32| {
            let (root, flip) = base.sets.look(label);
            let global = if base.crosses[root as usize] {
                root
            } else {
                NOTHING
            };
            let node = *node_of_root.entry(root).or_insert_with(|| {
                work.global.push(global);
                work.global.len() as u32 - 1
            });
            (node, flip)
        };
        for label in 0..base.labels[block] {
            let home = if label < globals {
                node_for(self, first + label)
            } else {
                self.global.push(NOTHING);
                (self.global.len() as u32 - 1, false)
            };
            of_label.push(home);
        }
        for r in interior {
            let t = [r[0], r[1], r[2]];
            self.mesh.push(t);
            let slots = t.map(|v| (v - self.ids.start) as usize);
            if slots.iter().any(|&v| active[v] || self.border[v] != 0) {
                let (node, flip) = of_label[(r[3] >> 1) as usize];
                self.put(t, (node, flip ^ (r[3] & 1 == 1)));
            }
        }
        self.interior_base = self.triangles.len();
        for r in crossing {
            let (node, flip) = node_for(self, r[4] >> 1);
            self.put([r[1], r[2], r[3]], (node, flip ^ (r[4] & 1 == 1)));
        }
        self.base = self.triangles.len();
        self.absorbed = ParitySets::new(self.global.len());
        self.joined = ParitySets::new(self.global.len());
    }

    fn put(&mut self, t: Triangle, home: (u32, bool)) {
        let number = self.triangles.len() as u32;
        self.triangles.push(t);
        self.fans.add(t, number, self.now());
        self.homes.push(home);
    }

    /// The time is told by the number of triangles, and is never 0.
    fn now(&self) -> u32 {
        self.triangles.len() as u32 + 1
    }

    /// Rounds over the candidates in rank order until one inserts nothing; those left undecided.
    fn insert_all(&mut self, cos_max_angle: f64, counts: &mut InsertStats) -> Vec<Candidate> {
        let mut pending = std::mem::take(&mut self.candidates);
        let mut link = Vec::new();
        loop {
            let before = self.triangles.len();
            pending.retain_mut(|candidate| {
                let t = candidate.ids;
                // What fails test I needs a triangle at another of its edges.
                let changed = t.map(|v| u8::from(self.fans.changed(v) > candidate.tried));
                if candidate.tried > 0 && changed.iter().sum::<u8>() < 2 {
                    return true;
                }
                candidate.tried = self.now();
                match examine(t, self, cos_max_angle, &mut link) {
                    Err(Refusal::Unconnected) => return true,
                    Err(refusal) => counts.refuse(refusal),
                    Ok(adjacent) if self.try_insert(t, adjacent) => counts.accepted += 1,
                    Ok(_) => counts.orientation += 1,
                }
                false
            });
            if self.triangles.len() == before {
                return pending;
            }
        }
    }

    /// Test IV and the insertion.
    fn try_insert(&mut self, t: Triangle, adjacent: [Option<Adjacent>; 3]) -> bool {
        let mut asks = Asks::default();
        for (number, turned) in adjacent.into_iter().flatten() {
            let (node, flip) = self.homes[number as usize];
            let (home, up) = self.absorbed.find(node);
            asks.push((home, flip ^ up ^ turned));
        }
        let (asks, home) = (asks.all(), asks.all()[0]);
        // Absorbed homes are joined too, so one check covers both.
        if !consistent(&mut self.joined, asks) {
            return false;
        }
        self.meet(t, asks);
        let (root, up) = self.absorbed.find(home.0);
        self.put(t, (root, home.1 ^ up));
        true
    }

    /// Absorbs or joins the homes that meet at an inserted triangle.
    fn meet(&mut self, t: Triangle, asks: &[(u32, bool)]) {
        let mut current = asks[0];
        let mut globals = [NOTHING; 3];
        let mut count = 0;
        for &(next, flip) in asks {
            self.joined.join(current.0, next, current.1 ^ flip);
            let (a, up_a) = self.absorbed.find(current.0);
            let (b, up_b) = self.absorbed.find(next);
            current = (a, current.1 ^ up_a);
            let next = (b, flip ^ up_b);
            if a == b {
                continue;
            }
            let turned = current.1 ^ next.1;
            // The one that stays a root is the global one, or the first.
            if self.global[b as usize] == NOTHING {
                self.absorbed.join(a, b, turned);
            } else if self.global[a as usize] == NOTHING {
                self.absorbed.join(b, a, turned);
                current = next;
            }
        }
        for &(home, flip) in asks {
            let (root, up) = self.absorbed.find(home);
            let label = self.global[root as usize];
            let word = label << 1 | u32::from(flip ^ up);
            if label != NOTHING && !globals[..count].contains(&word) {
                globals[count] = word;
                count += 1;
            }
        }
        if count > 1 {
            self.joints
                .push([t[0], t[1], t[2], globals[0], globals[1], globals[2]]);
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
        let mut context: Vec<bool> = self.border.iter().map(|b| b & OPEN != 0).collect();
        let mut ranked = std::mem::take(&mut self.crossing_candidates);
        for candidate in undecided {
            if candidate.ids.iter().any(|&v| self.border[slot(v)] != 0) {
                ranked.push(*candidate);
                candidate.ids.iter().for_each(|&v| context[slot(v)] = true);
            } else {
                counts.unconnected += 1;
            }
        }
        ranked.sort_unstable();
        self.tell(bytes_of(&ranked) + 20 * ranked.len() as u64);
        let ranked: Vec<_> = ranked.iter().map(Candidate::record).collect();
        out.ranked.put(block, &ranked)?;
        drop(ranked);
        let around = self.around_context(&context);
        out.context.put(block, &around)?;
        out.vertices.put(block, &self.located(&context, &around))?;
        drop(around);
        out.joints.put(block, &self.joints)?;
        let inserted = &mut self.triangles[self.base..];
        inserted.sort_unstable();
        let mut mesh = std::mem::take(&mut self.mesh);
        mesh.extend_from_slice(inserted);
        // The sort takes as much again.
        self.tell(2 * bytes_of(&mesh));
        // Two ascending runs: this sort merges them.
        mesh.sort();
        out.mesh.put(block, &mesh)
    }

    /// The interior triangles at context vertices with their homes.
    fn around_context(&mut self, context: &[bool]) -> Vec<[u32; 4]> {
        let mut around = Vec::new();
        for number in (0..self.interior_base).chain(self.base..self.triangles.len()) {
            let t = self.triangles[number];
            if t.iter().any(|v| context[(v - self.ids.start) as usize]) {
                let (node, flip) = self.homes[number];
                let (root, up) = self.absorbed.find(node);
                let label = self.global[root as usize];
                let local = label == NOTHING;
                let home = Home {
                    number: if local { root } else { label },
                    local,
                    flip: flip ^ up,
                };
                around.push([t[0], t[1], t[2], home.word()]);
            }
        }
        around
    }

    /// The vertices whose positions the crossing candidates may need.
    fn located(&self, context: &[bool], around: &[[u32; 4]]) -> Vec<[u32; 4]> {
        let in_context = |v: &u32| self.ids.contains(v) && context[(v - self.ids.start) as usize];
        let crossing = self.triangles[self.interior_base..self.base].iter();
        let touching = crossing.filter(|t| t.iter().any(in_context));
        let mut ids: Vec<u32> = touching.flatten().copied().collect();
        ids.extend(around.iter().flat_map(|r| [r[0], r[1], r[2]]));
        ids.extend(self.ids.clone().filter(in_context));
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter()
            .map(|v| {
                let [x, y, z] = self.position(v).map(|c| c as u32);
                [v, x, y, z]
            })
            .collect()
    }
}
