//! T12 insertion inside a block (paper, section 3.5, second part): the candidates whose vertices
//! are all in one block, each block by itself.

use super::base::block_bytes;
use super::tests_of_paper::{Adjacent, Rank, Refusal, View, examine, rank};
use super::{InsertStats, SharedStats};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::Sections;
use crate::spill::layouts::{LABELLED, TRIANGLE};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::surface::orient::{Oriented, consistent};
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::{Star, Triangle};
use crate::stages::triples::Triples;
use crate::workspace::Workspace;
use rustc_hash::{FxHashMap, FxHashSet};
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
    /// Context vertices of the block, ascending.
    pub vertices: Sections<1>,
    /// Interior candidates that failed only test I and touch a crossing triple: `[i, j, k, count]`.
    pub leftovers: Sections<4>,
}

/// Placeholder in a joint.
pub const NOTHING: u32 = u32::MAX;

/// A home as a word: `number << 2 | local << 1 | flip`; `number` is a global label, or a number
/// within the block if `local`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Home {
    /// Global label, or number within the block.
    pub number: u32,
    /// Whose number it is.
    pub local: bool,
    /// Orientation of the triangle relative to its home.
    pub flip: bool,
}

impl Home {
    /// As one word.
    #[must_use]
    pub fn word(self) -> u32 {
        self.number << 2 | u32::from(self.local) << 1 | u32::from(self.flip)
    }

    /// From a word.
    #[must_use]
    pub fn from_word(word: u32) -> Self {
        Self {
            number: word >> 2,
            local: word & 2 != 0,
            flip: word & 1 != 0,
        }
    }
}

/// Inserts the interior candidates of all blocks.
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
    base: &Oriented,
    blocks: Blocks,
    cos_max_angle: f64,
    stats: &SharedStats,
    workspace: &Workspace,
) -> Result<Interior> {
    let count = blocks.count();
    let out = Interior {
        mesh: Sections::with_layout(workspace, "stitch.mesh", count, TRIANGLE)?,
        joints: Sections::create(workspace, "stitch.joints", count)?,
        context: Sections::with_layout(workspace, "stitch.context", count, LABELLED)?,
        vertices: Sections::create(workspace, "stitch.vertices", count)?,
        leftovers: Sections::with_layout(workspace, "stitch.leftovers", count, LABELLED)?,
    };
    // Candidates, their ranks, homes and what is written at the end.
    let bytes = |block| 2 * block_bytes(triples, block);
    workspace.for_each_unit("stitch: block", count, bytes, |block| {
        let mut work = BlockWork::load(store, triples, flags, base, blocks, block)?;
        let undecided = work.insert_all(cos_max_angle, stats);
        work.write(&out, block, &undecided, stats)?;
        workspace.observer.advance(1);
        Ok(())
    })?;
    Ok(out)
}

/// The mesh around a block while candidates are inserted.
struct BlockWork {
    ids: Range<u32>,
    star: Star,
    /// Base interior, base crossing, then inserted triangles.
    triangles: Vec<Triangle>,
    /// For each triangle its home's node and its orientation relative to it.
    homes: Vec<(u32, bool)>,
    interior_base: usize,
    base: usize,
    candidates: Vec<(Rank, u32)>,
    /// Homes absorbed into one another for good.
    absorbed: ParitySets,
    /// Homes joined for this block.
    joined: ParitySets,
    /// Global label of each node, [`NOTHING`] for local homes.
    global: Vec<u32>,
    joints: Vec<[u32; 6]>,
    own: Vec<Point>,
    foreign: FxHashMap<u32, Point>,
    /// Vertices of the block in crossing triples.
    border: FxHashSet<u32>,
}

impl View for BlockWork {
    fn around(&self, v: u32, each: &mut dyn FnMut(u32, Triangle)) {
        for &n in self.star.at(v) {
            each(n, self.triangles[n as usize]);
        }
    }

    fn position(&self, v: u32) -> Point {
        if self.ids.contains(&v) {
            self.own[(v - self.ids.start) as usize]
        } else {
            self.foreign[&v]
        }
    }
}

impl BlockWork {
    fn load(
        store: &PointStore,
        triples: &Triples,
        flags: &Sections<4>,
        base: &Oriented,
        blocks: Blocks,
        block: usize,
    ) -> Result<Self> {
        let ids = blocks.ids(block);
        let interior = base.interior.get(block)?;
        let crossing = base.crossing.get(block)?;
        let flags = flags.get(block)?;
        let own = store.slice(ids.start as usize..ids.end as usize)?;
        let mut border = FxHashSet::default();
        let mut mark = |t: Triangle| border.extend(t.into_iter().filter(|v| ids.contains(v)));
        triples
            .visiting
            .get(block)?
            .iter()
            .for_each(|r| mark([r[1], r[2], r[3]]));
        let at = |v: u32| own[(v - ids.start) as usize];
        let mut candidates = Vec::new();
        for &[i, j, k, count] in &triples.own.get(block)? {
            let t = [i, j, k];
            if blocks.crossing(t) {
                mark(t);
            } else if count < 3 || flags.binary_search(&[block as u32, i, j, k]).is_ok() {
                candidates.push((rank(t, count, t.map(at)), count));
            }
        }
        candidates.sort_unstable();
        let mut work = Self {
            star: Star::with_room(
                ids.clone(),
                interior
                    .iter()
                    .map(|r| [r[0], r[1], r[2]])
                    .chain(crossing.iter().map(|r| [r[1], r[2], r[3]]))
                    .chain(candidates.iter().map(|((.., t), _)| *t)),
            ),
            ids,
            triangles: Vec::with_capacity(interior.len() + crossing.len() + candidates.len() / 2),
            homes: Vec::new(),
            interior_base: interior.len(),
            base: interior.len() + crossing.len(),
            candidates,
            absorbed: ParitySets::default(),
            joined: ParitySets::default(),
            global: Vec::new(),
            joints: Vec::new(),
            own,
            foreign: FxHashMap::default(),
            border,
        };
        work.add_base(&interior, &crossing, base, block);
        work.fetch_foreign(store)?;
        Ok(work)
    }

    fn add_base(
        &mut self,
        interior: &[[u32; 4]],
        crossing: &[[u32; 5]],
        base: &Oriented,
        block: usize,
    ) {
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
            let (node, flip) = of_label[(r[3] >> 1) as usize];
            self.put([r[0], r[1], r[2]], (node, flip ^ (r[3] & 1 == 1)));
        }
        for r in crossing {
            let (node, flip) = node_for(self, r[4] >> 1);
            self.put([r[1], r[2], r[3]], (node, flip ^ (r[4] & 1 == 1)));
        }
        self.absorbed = ParitySets::new(self.global.len());
        self.joined = ParitySets::new(self.global.len());
    }

    fn put(&mut self, t: Triangle, home: (u32, bool)) {
        self.star.add(t, self.triangles.len() as u32);
        self.triangles.push(t);
        self.homes.push(home);
    }

    fn fetch_foreign(&mut self, store: &PointStore) -> Result<()> {
        let crossing = &self.triangles[self.interior_base..];
        let mut ids: Vec<u32> = crossing
            .iter()
            .flatten()
            .copied()
            .filter(|v| !self.ids.contains(v))
            .collect();
        ids.sort_unstable();
        ids.dedup();
        let mut points = Vec::with_capacity(ids.len());
        store.fetch(&ids, &mut points)?;
        self.foreign = ids.into_iter().zip(points).collect();
        Ok(())
    }

    /// Rounds over the candidates in rank order until one inserts nothing; those left undecided.
    fn insert_all(&mut self, cos_max_angle: f64, stats: &SharedStats) -> Vec<(Rank, u32)> {
        let mut pending = std::mem::take(&mut self.candidates);
        let mut local = InsertStats::default();
        loop {
            let before = self.triangles.len();
            pending.retain(|&((.., t), _)| match examine(t, self, cos_max_angle) {
                Err(Refusal::Unconnected) => true,
                Err(refusal) => {
                    local.refuse(refusal);
                    false
                }
                Ok(adjacent) => {
                    if self.try_insert(t, adjacent) {
                        local.accepted += 1;
                    } else {
                        local.orientation += 1;
                    }
                    false
                }
            });
            if self.triangles.len() == before {
                break;
            }
        }
        stats.add(&local);
        pending
    }

    /// Test IV and the insertion.
    fn try_insert(&mut self, t: Triangle, adjacent: [Option<Adjacent>; 3]) -> bool {
        let asks: Vec<(u32, bool)> = adjacent
            .into_iter()
            .flatten()
            .map(|(number, turned)| {
                let (node, flip) = self.homes[number as usize];
                let (home, up) = self.absorbed.find(node);
                (home, flip ^ up ^ turned)
            })
            .collect();
        let (fits, home) = (consistent(&mut self.joined, &asks), asks[0]);
        // Absorbed homes are joined too, so one check covers both.
        if !fits {
            return false;
        }
        self.meet(t, &asks);
        let (root, up) = self.absorbed.find(home.0);
        self.put(t, (root, home.1 ^ up));
        true
    }

    /// Absorbs or joins the homes that meet at an inserted triangle.
    fn meet(&mut self, t: Triangle, asks: &[(u32, bool)]) {
        let mut current = asks[0];
        let mut globals: Vec<u32> = Vec::new();
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
            if label != NOTHING && !globals.contains(&word) {
                globals.push(word);
            }
        }
        if globals.len() > 1 {
            globals.resize(3, NOTHING);
            self.joints
                .push([t[0], t[1], t[2], globals[0], globals[1], globals[2]]);
        }
    }

    fn write(
        &mut self,
        out: &Interior,
        block: usize,
        undecided: &[(Rank, u32)],
        stats: &SharedStats,
    ) -> Result<()> {
        let mut context: FxHashSet<u32> = self.border.clone();
        let mut leftovers = Vec::new();
        for &((.., t), count) in undecided {
            if t.iter().any(|v| self.border.contains(v)) {
                leftovers.push([t[0], t[1], t[2], count]);
                context.extend(t);
            } else {
                stats.add(&InsertStats {
                    unconnected: 1,
                    ..InsertStats::default()
                });
            }
        }
        let mut mesh = Vec::with_capacity(self.triangles.len());
        let mut around = Vec::new();
        for number in (0..self.interior_base).chain(self.base..self.triangles.len()) {
            let t = self.triangles[number];
            mesh.push(t);
            if t.iter().any(|v| context.contains(v)) {
                let (node, flip) = self.homes[number];
                let (root, up) = self.absorbed.find(node);
                let label = self.global[root as usize];
                let local = label == NOTHING;
                let number = if local { root } else { label };
                around.push([
                    t[0],
                    t[1],
                    t[2],
                    Home {
                        number,
                        local,
                        flip: flip ^ up,
                    }
                    .word(),
                ]);
            }
        }
        mesh.sort_unstable();
        let mut vertices: Vec<[u32; 1]> = context.into_iter().map(|v| [v]).collect();
        vertices.sort_unstable();
        out.mesh.put(block, &mesh)?;
        out.joints.put(block, &self.joints)?;
        out.context.put(block, &around)?;
        out.vertices.put(block, &vertices)?;
        out.leftovers.put(block, &leftovers)
    }
}
