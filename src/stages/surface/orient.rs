//! Components and orientation of a surface given block by block.

use super::border::Border;
use super::evidence::{Evidence, Votes};
use super::parity::ParitySets;
use super::star::{EDGES, Edges, Triangle, opposed};
use super::weigh::{vote, weigh_block};
use crate::error::Result;
use crate::spill::layouts::{LABELLED, SENT_LABELLED, TRIANGLE};
use crate::spill::{Exchange, Sections, Word};
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// An oriented surface: every triangle has a label and an orientation relative to it.
#[derive(Debug)]
pub struct Oriented {
    /// `[i, j, k, label << 1 | flip]` of interior triangles by block; labels are the block's own.
    pub interior: Sections<4>,
    /// `[block, i, j, k, label << 1 | flip]` of crossing triangles for each block they touch;
    /// labels are global.
    pub crossing: Sections<5>,
    /// For each block, the global label of its label 0 and the number of labels that are global.
    pub globals: Vec<(u32, u32)>,
    /// For each block, the number of its labels.
    pub labels: Vec<u32>,
    /// Relations of the global labels.
    pub sets: ParitySets,
    /// Which roots have a crossing triangle.
    pub crosses: Vec<bool>,
    /// Triangles removed because they close a Möbius band.
    pub mobius: u64,
    /// Triangles that are left.
    pub triangles: u64,
    _held: crate::workspace::memory::Reservation,
}

/// A surface whose blocks are oriented, but not yet what lies between them.
#[derive(Debug)]
pub struct OrientedInside {
    interior: Sections<4>,
    relations: Sections<7>,
    /// Votes of the candidates on global labels, `[a, b, votes]`, by block; if there is evidence.
    votes: Option<Sections<3>>,
    /// Crossing triangles by the block of their smallest vertex.
    crossing: Sections<3>,
    /// For each block, the number of labels that are global, and of all.
    labels: Vec<(u32, u32)>,
    mobius: u64,
    triangles: u64,
}

/// The triangles around a block, and what else was found there.
pub struct Around<T> {
    /// All that touch the block, ascending.
    pub triangles: Vec<Triangle>,
    /// What speaks for their orientation; without, the order of triangles decides.
    pub evidence: Option<Evidence>,
    /// What the caller wants to know of the block.
    pub found: T,
    /// What it holds.
    pub held: Holding,
}

/// Orients a surface: the interior triangles of every block by themselves, ascending; the crossing
/// ones follow in [`OrientedInside::join`]. A triangle that would make the surface non-orientable is
/// removed.
///
/// `around(block)` gives all triangles that touch a block, ascending; `bytes(block)` what that
/// takes in memory; `each` gets what else was found in each block.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn orient_inside<T: Persist + Send>(
    name: &str,
    around: impl Fn(usize) -> Result<Around<T>> + Sync,
    mut each: impl FnMut(usize, T) + Send,
    bytes: impl Fn(usize) -> u64 + Sync,
    blocks: Blocks,
    evidence: bool,
    workspace: &Workspace,
) -> Result<OrientedInside> {
    let count = blocks.count();
    let sections = |part: &str| format!("{name}.{part}");
    let interior = Sections::with_layout(workspace, &sections("interior"), count, LABELLED)?;
    let border = Sections::with_layout(workspace, &sections("border"), count, TRIANGLE)?;
    let letters = sections("relations");
    let above = [Word::Above; 7];
    let exchange = Exchange::between(workspace, &letters, EXCHANGE_BUFFER, count, above)?;
    let votes = evidence
        .then(|| Sections::create(workspace, &sections("votes"), count))
        .transpose()?;
    let work = |block| {
        let Around {
            triangles: mut inner,
            evidence,
            found,
            held: _held,
        } = around(block)?;
        let crossing: Vec<Triangle> = inner.extract_if(.., |t| blocks.crossing(*t)).collect();
        let _crossing = hold(bytes_of(&crossing));
        let done = orient_block(&inner, &crossing, evidence, blocks, block);
        if let Some(votes) = &votes {
            votes.put(block, &done.votes)?;
        }
        interior.put(block, &done.interior)?;
        exchange.send_from(block, &done.relations)?;
        let mine = |t: &&Triangle| blocks.of(t[0]) == block as u32;
        border.put(
            block,
            &crossing.iter().filter(mine).copied().collect::<Vec<_>>(),
        )?;
        workspace.advance(1);
        let own = (done.global, done.labels);
        Ok((own, (done.mobius, done.interior.len()), found))
    };
    let mut labels = vec![(0u32, 0u32); count];
    let (mut mobius, mut triangles) = (0, 0);
    workspace.units("block", count, &bytes, work, |block, (own, more, found)| {
        labels[block] = own;
        mobius += more.0;
        triangles += more.1 as u64;
        each(block, found);
        Ok(())
    })?;
    Ok(OrientedInside {
        interior,
        relations: exchange.deliver(workspace, count)?,
        votes,
        crossing: border,
        labels,
        mobius,
        triangles,
    })
}

impl Persist for Oriented {
    fn save(&self, out: &mut Vec<u8>) {
        self.interior.save(out);
        self.crossing.save(out);
        self.globals.save(out);
        self.labels.save(out);
        self.sets.save(out);
        self.crosses.save(out);
        (self.mobius, self.triangles).save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (interior, crossing) = Persist::load(from)?;
        let (globals, labels) = Persist::load(from)?;
        let sets = ParitySets::load(from)?;
        let crosses = Persist::load(from)?;
        let (mobius, triangles) = Persist::load(from)?;
        let bytes = label_bytes(sets.len());
        Ok(Self {
            interior,
            crossing,
            globals,
            labels,
            _held: from.workspace.reserve("labels", bytes)?,
            sets,
            crosses,
            mobius,
            triangles,
        })
    }
}

/// Bytes that so many global labels take.
fn label_bytes(labels: usize) -> u64 {
    labels as u64 * 16 + 1024
}

impl OrientedInside {
    /// The second half of [`orient_inside`]: the crossing triangles, ascending, without those in
    /// `removed`, `[block, i, j, k]` by the block of their smallest vertex.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn join(
        self,
        name: &str,
        removed: &Sections<4>,
        blocks: Blocks,
        workspace: &Workspace,
    ) -> Result<Oriented> {
        let mut globals = Vec::with_capacity(self.labels.len());
        let mut next = 0u32;
        for (global, _) in &self.labels {
            globals.push((next, *global));
            next += global;
        }
        let held = workspace.reserve("labels", label_bytes(next as usize))?;
        let mut surface = Oriented {
            interior: self.interior,
            crossing: Sections::create(workspace, &format!("{name}.none"), 0)?,
            globals,
            labels: self.labels.into_iter().map(|(_, all)| all).collect(),
            sets: ParitySets::new(next as usize),
            crosses: vec![false; next as usize],
            mobius: self.mobius,
            triangles: self.triangles,
            _held: held,
        };
        let border = |block: usize| {
            let mut triangles = self.crossing.get(block)?;
            let removed = removed.get(block)?;
            let gone = |t: &Triangle| removed.binary_search(&[block as u32, t[0], t[1], t[2]]);
            triangles.retain(|t| gone(t).is_err());
            Ok(triangles)
        };
        if let Some(votes) = &self.votes {
            vote(
                &mut surface,
                border,
                &self.relations,
                votes,
                blocks,
                workspace,
            )?;
        }
        orient_crossing(
            &mut surface,
            name,
            border,
            &self.relations,
            blocks,
            workspace,
        )?;
        Ok(surface)
    }
}

pub(super) struct OrientedBlock {
    interior: Vec<[u32; 4]>,
    /// `[owner block, i, j, k, this block, label << 1 | flip, weight]`: what an interior triangle of
    /// this block asks of the crossing triangle `i, j, k`.
    relations: Vec<[u32; 7]>,
    votes: Vec<[u32; 3]>,
    /// Number of labels that occur in relations; they come first.
    global: u32,
    labels: u32,
    mobius: u64,
    _held: Holding,
}

/// What the triangles adjacent to one ask for: their label, and if the triangle must be turned
/// against it. At most two at each edge.
#[derive(Debug, Default)]
pub struct Asks {
    list: [(u32, bool); 6],
    len: usize,
}

impl Asks {
    /// Adds one.
    pub fn push(&mut self, ask: (u32, bool)) {
        // A third triangle at an edge would be no surface; it is not looked at.
        if self.len < 6 {
            self.list[self.len] = ask;
            self.len += 1;
        }
    }

    /// All of them in order.
    #[must_use]
    pub fn all(&self) -> &[(u32, bool)] {
        &self.list[..self.len]
    }
}

fn orient_block(
    inner: &[Triangle],
    crossing: &[Triangle],
    evidence: Option<Evidence>,
    blocks: Blocks,
    block: usize,
) -> OrientedBlock {
    if let Some(evidence) = evidence {
        return weigh_block(inner, crossing, &evidence, blocks, block);
    }
    let ids = blocks.ids(block);
    let mut edges = Edges::with_room(ids.clone(), inner);
    let mut sets = ParitySets::new(inner.len());
    let mut kept = Vec::with_capacity(inner.len());
    let (_held, mut mobius) = (hold(8 * inner.len() as u64), 0);
    for (number, &t) in inner.iter().enumerate() {
        let number = number as u32;
        // Either all adjacent triangles agree and are joined, or the triangle goes.
        let mut asks = Asks::default();
        adjacent(t, &edges, inner, &ids, |other, flip| {
            asks.push((other, flip))
        });
        if !consistent(&mut sets, asks.all()) {
            mobius += 1;
            continue;
        }
        for &(other, flip) in asks.all() {
            sets.join(other, number, flip);
        }
        edges.add(t, number);
        kept.push(number);
    }
    let mut bonds = Bonds::default();
    for &c in crossing {
        adjacent(c, &edges, inner, &ids, |other, flip| {
            bonds.relations.push((c, other, flip, 1));
        });
    }
    number_labels(inner, &kept, bonds, &mut sets, blocks, block, mobius)
}

/// What speaks for how the sets of a block run.
#[derive(Default)]
pub(super) struct Bonds {
    /// A crossing triangle, an interior one at an edge of it, whether one must be turned against the
    /// other, and the weight of that.
    pub relations: Vec<(Triangle, u32, bool, i64)>,
    /// The same of two interior triangles at a candidate.
    pub votes: Vec<(u32, u32, bool, i64)>,
}

/// Gives labels to the sets, those in relations first, both in order of first appearance.
pub(super) fn number_labels(
    inner: &[Triangle],
    kept: &[u32],
    bonds: Bonds,
    sets: &mut ParitySets,
    blocks: Blocks,
    block: usize,
    mobius: u64,
) -> OrientedBlock {
    const NONE: u32 = u32::MAX;
    let mut label_of = vec![NONE; inner.len()];
    let mut labels = 0;
    let mut find = |triangle: u32| {
        let (root, turned) = sets.find(triangle);
        let label = &mut label_of[root as usize];
        if *label == NONE {
            *label = labels;
            labels += 1;
        }
        (*label, turned, labels)
    };
    let mut global = 0;
    let mut sent = Vec::with_capacity(bonds.relations.len());
    for (c, other, flip, weight) in bonds.relations {
        let (label, turned, labels) = find(other);
        global = labels;
        let word = label << 1 | u32::from(flip ^ turned);
        let owner = blocks.of(c[0]);
        sent.push([owner, c[0], c[1], c[2], block as u32, word, weight as u32]);
    }
    let mut interior = Vec::with_capacity(kept.len());
    for &number in kept {
        let (label, turned, _) = find(number);
        let t = inner[number as usize];
        interior.push([t[0], t[1], t[2], label << 1 | u32::from(turned)]);
    }
    let mut held = hold(4 * inner.len() as u64 + bytes_of(&interior) + bytes_of(&sent));
    let mut counted = Votes::default();
    for (a, b, flip, weight) in bonds.votes {
        let ((a, turned_a, _), (b, turned_b, _)) = (find(a), find(b));
        if a < global && b < global {
            counted.add(a, b, flip ^ turned_a ^ turned_b, weight);
        }
    }
    let votes = counted.counted().into_iter();
    let votes = votes
        .map(|(a, b, votes)| [a, b, votes as i32 as u32])
        .collect();
    held.set(bytes_of(&interior) + bytes_of(&sent));
    OrientedBlock {
        _held: held,
        interior,
        relations: sent,
        votes,
        global,
        labels,
        mobius,
    }
}

/// Calls `each` with the triangles that share an edge inside the block with `t`, and whether `t`
/// must be turned against them.
pub(super) fn adjacent(
    t: Triangle,
    edges: &Edges,
    triangles: &[Triangle],
    ids: &std::ops::Range<u32>,
    mut each: impl FnMut(u32, bool),
) {
    for (a, b, ..) in EDGES {
        let (low, high) = (t[a], t[b]);
        if ids.contains(&high) {
            for n in edges.at(low, high) {
                each(n, opposed(t, triangles[n as usize], low, high));
            }
        }
    }
}

/// True if no two of `asks`, taken together with what is joined already, contradict each other.
#[must_use]
pub fn consistent(sets: &mut ParitySets, asks: &[(u32, bool)]) -> bool {
    asks.iter().enumerate().all(|(x, &(a, flip_a))| {
        asks[..x].iter().all(|&(b, flip_b)| {
            sets.relation(a, b)
                .is_none_or(|turned| turned == (flip_a ^ flip_b))
        })
    })
}

/// The crossing triangles in ascending order, each against those before it.
fn orient_crossing(
    base: &mut Oriented,
    name: &str,
    border: impl Fn(usize) -> Result<Vec<Triangle>>,
    relations: &Sections<7>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<()> {
    let exchange = Exchange::<5>::new(workspace, &format!("{name}.crossing"), EXCHANGE_BUFFER)?
        .packed(SENT_LABELLED);
    let mut edges = Border::new(workspace)?;
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        let relations = relations.get(group)?;
        let mut sent = Vec::new();
        let triangles = border(group)?;
        edges.make_room(triangles.len())?;
        for t in triangles {
            let Some(word) = orient_one(base, t, &relations, group as u32, &edges) else {
                base.mobius += 1;
                continue;
            };
            base.triangles += 1;
            edges.put(t, word);
            sent.push([blocks.of(t[0]), t[0], t[1], t[2], word]);
            sent.extend(blocks.visited(t).map(|b| [b, t[0], t[1], t[2], word]));
        }
        exchange.send(&sent)?;
        edges.end(group, blocks);
    }
    base.crossing = exchange.deliver(workspace, blocks.count())?;
    base.sets.flatten();
    // Crossing marks were set on labels; what counts is the set.
    for label in 0..base.sets.len() as u32 {
        if base.crosses[label as usize] {
            let (root, _) = base.sets.find(label);
            base.crosses[root as usize] = true;
        }
    }
    Ok(())
}

/// Joins one crossing triangle; its label and flip, or `None` if it closes a Möbius band.
fn orient_one(
    base: &mut Oriented,
    t: Triangle,
    relations: &[[u32; 7]],
    group: u32,
    edges: &Border,
) -> Option<u32> {
    let key = [group, t[0], t[1], t[2]];
    let start = relations.partition_point(|r| r[..4] < key[..]);
    let mut asks: Vec<(u32, bool)> = relations[start..]
        .iter()
        .take_while(|r| r[..4] == key[..])
        .map(|r| (base.globals[r[4] as usize].0 + (r[5] >> 1), r[5] & 1 == 1))
        .collect();
    asks.extend(edges.asks(t));
    if !consistent(&mut base.sets, &asks) {
        return None;
    }
    let (label, flip) = match asks.first() {
        Some(&first) => first,
        None => {
            base.crosses.push(false);
            (base.sets.push(), false)
        }
    };
    for &(other, turned) in &asks {
        base.sets.join(label, other, flip ^ turned);
    }
    base.crosses[label as usize] = true;
    Some(label << 1 | u32::from(flip))
}
